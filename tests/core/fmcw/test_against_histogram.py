"""The same motion through the radar signal and through counting."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from facet_visibility import facet_visibility
from velocity_response import velocity_response

from sd2core.doppler import PRESETS, SynthesisOptions, Synthesizer
from sd2core.files.resources import resource_path
from sd2core.fmcw import (
    ProcessingOptions,
    SignalOptions,
    WaveOptions,
    doppler_map,
    frame_spectra,
    simulate_radar,
)
from sd2core.io.mesh import load_mesh
from sd2core.maps import DopplerMap
from sd2core.mesh.sequence import MeshSequence
from sd2core.radar_config import PAPER_RADAR
from sd2core.sensor import VelocityAxis, VirtualSensor
from sd2core.timebase import Timebase

AXIS = VelocityAxis()
FRAMES = 60
TIMES_S = np.arange(FRAMES) / 30.0


def plate(distance_m: np.ndarray) -> MeshSequence:
    """Plate of 0.1 m across the optical axis, facing the camera, moving along it."""
    cells = 6
    grid = np.linspace(-0.05, 0.05, cells + 1)
    x, y = np.meshgrid(grid, grid, indexing="ij")
    corner = np.arange((cells + 1) * cells).reshape(cells, cells + 1)[:, :-1].ravel()
    a, b, c, d = corner, corner + 1, corner + cells + 1, corner + cells + 2
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([b, d, c], 1)])
    vertices = np.zeros((len(distance_m), x.size, 3), dtype=np.float32)
    vertices[..., 0], vertices[..., 1] = x.ravel(), y.ravel()
    vertices[..., 2] = distance_m[:, None]
    return MeshSequence(vertices, faces.astype(np.int32), Timebase(TIMES_S))


def both(mesh: MeshSequence, sensor: VirtualSensor) -> tuple[DopplerMap, DopplerMap]:
    counted = Synthesizer(mesh, replace(PRESETS["paper"], null_bins=())).map(sensor)
    capture = simulate_radar(mesh, PAPER_RADAR, sensor=sensor, options=SignalOptions(snr_db=20.0))
    return counted, doppler_map(capture, axis=AXIS)


def test_a_plate_at_1_3_metres_per_second() -> None:
    counted, measured = both(plate(4.0 - 1.3 * TIMES_S), VirtualSensor())
    assert (counted.axis, measured.axis) == (AXIS, AXIS)
    np.testing.assert_allclose(counted.times_s, measured.times_s, atol=1e-9)
    for found in (counted, measured):
        off = np.abs(found.peak_velocity_mps() - 1.3)
        assert off.max() <= AXIS.bin_width_mps
    apart = np.abs(counted.peak_velocity_mps() - measured.peak_velocity_mps())
    assert apart.max() <= AXIS.bin_width_mps


@pytest.mark.parametrize("position_m", [(0.0, 0.0, 0.0), (0.5, -0.3, 0.4)])
def test_a_swinging_plate(position_m: tuple[float, float, float]) -> None:
    # +-1.5 m/s at 0.7 Hz; seen from the side only the part along the line of sight.
    swing_m = 1.5 / (2 * np.pi * 0.7) * np.sin(2 * np.pi * 0.7 * TIMES_S)
    counted, measured = both(plate(2.4 - swing_m), VirtualSensor(position_m=position_m))
    apart = np.abs(counted.peak_velocity_mps() - measured.peak_velocity_mps())
    assert apart.max() <= AXIS.bin_width_mps + 1e-9
    # Neither is late: the best lag of one against the other is 0.
    a, b = counted.peak_velocity_mps(), measured.peak_velocity_mps()
    mismatch = {lag: np.abs(a[2:-2] - np.roll(b, lag)[2:-2]).mean() for lag in (-2, -1, 0, 1, 2)}
    assert min(mismatch, key=lambda lag: mismatch[lag]) == 0


@pytest.mark.slow
def test_the_samples_gestures_move_as_fast_either_way() -> None:
    """The rough surface's power against counting by the same law, peak within one bin.

    Counted is the area turned towards the sensor over R^4, shown through the radar's own
    window and clutter filter: 4 native bins are as wide as 3 of the axis, and the still body
    spills over the nulled bins without them. A frame moves when its counted peak
    lies outside the nulled bins. A single look has speckle, which counting does not
    know; powers are averaged over looks with other random phases.
    """
    stored = load_mesh(resource_path("swipes.sd2") / "mesh.zarr")
    mesh = MeshSequence(stored.read(0, 450), stored.faces, stored.timebase)
    nulled = [14, 15, 16]
    fine = VelocityAxis(252, AXIS.v_max_mps)
    by_area = SynthesisOptions(
        weight="projected", axis=fine, null_bins=(), velocity_sigma_bins=0, time_sigma_s=0
    )
    filtered = ProcessingOptions(clutter="mean")
    response = velocity_response(PAPER_RADAR, fine.centres_mps, processing=filtered)
    counted = response @ Synthesizer(mesh, by_area).map(VirtualSensor()).values
    moving = np.flatnonzero(~np.isin(counted.argmax(axis=0), nulled))
    assert len(moving) > 60
    visible = np.zeros((450, len(mesh.faces)), np.bool_)  # type: ignore[arg-type]
    times_s = mesh.times_s[moving]
    some = MeshSequence(mesh.vertices[moving], mesh.faces, Timebase(times_s - times_s[0]))
    visible[moving] = facet_visibility(some, VirtualSensor())
    power = sum(
        frame_spectra(
            mesh,
            PAPER_RADAR,
            times_s,
            visibility=visible,
            wave=WaveOptions(coherent=False),
            processing=filtered,
            seed=look,
        )
        for look in range(36)
    )
    counted, power = counted[:, moving], np.array(power)
    counted[nulled] = power[nulled] = 0
    apart = np.abs(counted.argmax(axis=0) - power.argmax(axis=0))
    assert np.mean(apart <= 1) >= 0.95


@pytest.mark.parametrize("coherent", [True, False])
def test_a_rigid_plate_moves_as_fast_either_way_at_any_speed(coherent: bool) -> None:
    # 0 to 1.8 m/s and back: every bin on one side, the slow ones too.
    speed = 1.8 * np.sin(np.pi * np.arange(FRAMES) / (FRAMES - 1)) ** 2
    mesh = plate(4.0 - np.cumsum(speed) / 30.0)
    fine = VelocityAxis(252, AXIS.v_max_mps)
    options = SynthesisOptions(
        weight="projected", axis=fine, null_bins=(), velocity_sigma_bins=0, time_sigma_s=0
    )
    filtered = ProcessingOptions(clutter="mean")
    response = velocity_response(PAPER_RADAR, fine.centres_mps, processing=filtered)
    counted = response @ Synthesizer(mesh, options).map(VirtualSensor()).values
    power = frame_spectra(
        mesh,
        PAPER_RADAR,
        mesh.times_s,
        wave=WaveOptions(coherent=coherent),
        processing=filtered,
    )
    moving = ~np.isin(counted.argmax(axis=0), [14, 15, 16])
    assert moving.sum() > 40
    apart = np.abs(counted.argmax(axis=0) - power.argmax(axis=0))[moving]
    assert np.mean(apart <= 1) == 1.0
