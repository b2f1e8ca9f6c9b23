"""Converged frames, and Doppler columns of single frames."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from velocity_response import velocity_response

from sd2core.errors import Sd2Error
from sd2core.fmcw import ProcessingOptions, SignalOptions, WaveOptions, doppler_map, simulate_radar
from sd2core.fmcw.cutting import subdivided
from sd2core.fmcw.reference import converged_frame, doppler_marginal
from sd2core.fmcw.spectra import frame_spectra
from sd2core.fmcw.sums import direct
from sd2core.fmcw.wave import WaveScene
from sd2core.mesh.sequence import MeshSequence
from sd2core.progress import Cancelled
from sd2core.radar_config import PAPER_RADAR
from sd2core.sensor import VelocityAxis, VirtualSensor
from sd2core.timebase import Timebase

CAMERA = VirtualSensor()
RADAR = replace(PAPER_RADAR, chirps_per_frame=16, samples_per_chirp=16, chirp_repetition_s=1.5e-3)


def flapping(cells: int = 4, frames: int = 7) -> MeshSequence:
    """A door of 0.2 m that swings about a vertical axis by 6 rad/s and comes nearer."""
    grid = np.linspace(-0.1, 0.1, cells + 1)
    x, y = (values.ravel() for values in np.meshgrid(grid, grid, indexing="ij"))
    corner = np.arange((cells + 1) * cells).reshape(cells, cells + 1)[:, :-1].ravel()
    a, b, c, d = corner, corner + 1, corner + cells + 1, corner + cells + 2
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([b, d, c], 1)])
    times_s = np.arange(frames) / 30.0
    angle = 6.0 * (times_s - times_s[-1] / 2)[:, None]
    places = np.stack(
        [x * np.cos(angle), y + 0 * angle, 1.5 - 0.4 * times_s[:, None] + x * np.sin(angle)], axis=2
    )
    return MeshSequence(places, faces.astype(np.int32), Timebase(times_s), "door")


def test_halved_edges_fill_the_triangle() -> None:
    corners = np.random.default_rng(0).normal(size=(3, 3, 3))
    pieces = subdivided(corners, 2)
    assert pieces.shape == (48, 3, 3)

    def normals(parts: np.ndarray) -> np.ndarray:
        return np.cross(parts[:, 1] - parts[:, 0], parts[:, 2] - parts[:, 0])

    # Every piece has a sixteenth of its facet's area and looks where it looks.
    np.testing.assert_allclose(normals(pieces), np.tile(normals(corners) / 16, (16, 1)))
    centre = pieces.mean(axis=1).reshape(16, 3, 3).mean(axis=0)
    np.testing.assert_allclose(centre, corners.mean(axis=1), atol=1e-15)


@pytest.mark.parametrize("motion", ["constant", "interpolated"])
def test_large_facets_converge_to_what_small_ones_give(motion: str) -> None:
    wave = WaveOptions(motion=motion)  # type: ignore[arg-type]
    found = [
        converged_frame(WaveScene(flapping(cells), RADAR, CAMERA, wave=wave), 0.1, tolerance=1e-3)
        for cells in (4, 16)
    ]
    for one in found:
        assert one.changes[-1] <= 1e-3
        assert one.pieces == tuple(4**k for k in range(len(one.changes) + 1))
    coarse, fine = (doppler_marginal(one.signal) for one in found)
    # What is left after the last change is no larger than it, for either.
    assert np.abs(coarse - fine).sum() <= 2e-3


def test_real_samples_are_the_real_part_of_complex_ones() -> None:
    radars = [replace(RADAR, sampling=kind) for kind in ("real", "complex")]
    scenes = (WaveScene(flapping(), radar, CAMERA) for radar in radars)
    real, both = (converged_frame(one, 0.1, tolerance=0.0, most_cuts=1) for one in scenes)
    np.testing.assert_allclose(both.signal.real, real.signal)
    assert np.abs(both.signal.imag).max() > 0.5 * np.abs(real.signal).max()


def test_what_does_not_converge_says_how_far_it_is() -> None:
    scene = WaveScene(flapping(), RADAR, CAMERA)
    one = converged_frame(scene, 0.1, tolerance=1e-9, most_cuts=1)
    assert one.pieces == (1, 4)
    assert one.changes[-1] > 1e-9


def test_a_rough_surface_is_summed_as_it_is() -> None:
    scene = WaveScene(flapping(), RADAR, CAMERA, wave=WaveOptions(coherent=False), seed=3)
    one = converged_frame(scene, 0.1)
    assert (one.pieces, one.changes) == ((1,), ())
    position, velocity = scene.scene.moving(0.1)
    expected = direct(scene.echoes(position, velocity, None), RADAR).real
    np.testing.assert_allclose(one.signal[0], expected, atol=1e-12 * np.abs(expected).max())


def test_hidden_facets_stay_hidden_and_a_reference_can_be_stopped() -> None:
    mesh = flapping()
    assert mesh.faces is not None
    hidden = np.zeros((mesh.frame_count, len(mesh.faces)), np.bool_)
    assert not converged_frame(WaveScene(mesh, RADAR, CAMERA, hidden), 0.1).signal.any()
    half = hidden.copy()
    half[:, ::2] = True
    one = converged_frame(WaveScene(mesh, RADAR, CAMERA, half), 0.1)
    some = MeshSequence(mesh.vertices, mesh.faces[::2], mesh.timebase)
    other = converged_frame(WaveScene(some, RADAR, CAMERA), 0.1)
    np.testing.assert_allclose(one.signal, other.signal, atol=1e-12 * np.abs(one.signal).max())

    def stop() -> None:
        raise Cancelled

    with pytest.raises(Cancelled):
        converged_frame(WaveScene(mesh, RADAR, CAMERA), 0.1, go_on=stop)


@pytest.mark.parametrize(
    ("wave", "processing", "receivers"),
    [
        (WaveOptions(), ProcessingOptions(), 1),
        (WaveOptions(coherent=False), ProcessingOptions(clutter="mean"), 1),
        (WaveOptions(blocks=2), ProcessingOptions(clutter="mean", range_m=(0.5, 3.0)), 2),
    ],
)
def test_columns_of_single_frames_are_those_of_the_whole_map(
    wave: WaveOptions, processing: ProcessingOptions, receivers: int
) -> None:
    mesh = flapping()
    config = replace(RADAR, receivers=receivers, adc_bits=16)
    axis = VelocityAxis(24, 1.5)
    capture = simulate_radar(mesh, config, wave=wave, options=SignalOptions(snr_db=math.inf))
    whole = doppler_map(
        capture, axis=axis, clutter=processing.clutter, range_m=processing.range_m
    ).values
    some = [1, 4, 6]
    for threads in (1, "all"):
        columns = frame_spectra(
            mesh,
            config,
            mesh.times_s[some],
            wave=wave,
            axis=axis,
            processing=processing,
            threads=threads,  # type: ignore[arg-type]
        )
        assert columns.shape == (24, 3)
        expected = whole[:, some] / whole[:, some].sum()
        # Rounding to 16 bits.
        np.testing.assert_allclose(columns / columns.sum(), expected, atol=1e-4)


def test_far_echoes_do_not_vanish() -> None:
    mesh = flapping()
    sensor = VirtualSensor((0.0, 0.0, -1e6))
    config = replace(RADAR, end_frequency_hz=RADAR.start_frequency_hz + 1.0)
    columns = frame_spectra(mesh, config, [0.1], sensor=sensor, processing=ProcessingOptions())
    assert np.isfinite(columns).all()
    assert columns.max() > 0


def test_a_moving_average_needs_the_frames_between() -> None:
    with pytest.raises(Sd2Error, match="moving average"):
        frame_spectra(
            flapping(), RADAR, [0.1], processing=ProcessingOptions(clutter="moving"), threads=1
        )


@pytest.mark.parametrize("clutter", ["none", "mean", "regression"])
@pytest.mark.parametrize("speed_mps", [-0.9, -0.1, 0.05, 0.6])
def test_the_response_to_a_velocity_is_the_column_of_a_point(
    clutter: str, speed_mps: float
) -> None:
    # A facet far smaller than the wave, at a gate's middle and far from the leakage.
    gate_m = 5 * PAPER_RADAR.range_resolution_m
    times_s = np.arange(3) / 30.0
    corners = 1e-4 * np.array([[0.0, 0, 0], [0, 1, 0], [1, 0, 0]])
    places = (
        corners
        + np.array([0, 0, 1.0]) * (gate_m - speed_mps * (times_s - times_s[1]))[:, None, None]
    )
    mesh = MeshSequence(places, np.array([[0, 1, 2]], np.int32), Timebase(times_s))
    processing = ProcessingOptions(clutter=clutter)  # type: ignore[arg-type]
    column = frame_spectra(mesh, PAPER_RADAR, times_s[1:2], processing=processing)[:, 0]
    shown = velocity_response(PAPER_RADAR, [speed_mps], processing=processing)[:, 0]
    if clutter == "none":
        assert shown.sum() == pytest.approx(1.0, abs=1e-4)
    # Migration through range, and what of the windows' skirts lies beyond the gates.
    np.testing.assert_allclose(column / column.sum(), shown / shown.sum(), atol=0.01)
