"""A moving scene → raw samples, against the phase of its echoes."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from facet_scatterers import (
    Scatterers,
    facet_scatterers,
    mean_phasor,
    point_scatterers,
    scatterers_at,
)
from facet_signal import capture_scene, echo, simulate_capture
from hypothesis import given, settings
from hypothesis import strategies as st

from sd2core.errors import Sd2Error
from sd2core.fmcw.options import Reflector, SignalOptions
from sd2core.fmcw.processing import doppler_map, range_doppler
from sd2core.fmcw.scene import MeshScene, radar_times_s
from sd2core.io.radar import load_capture
from sd2core.io.radar.infineon import write_capture
from sd2core.mesh.sequence import MeshSequence
from sd2core.progress import Cancelled
from sd2core.radar_config import PAPER_RADAR, SPEED_OF_LIGHT_MPS
from sd2core.radar_profiles import RADARS
from sd2core.sensor import VirtualSensor
from sd2core.timebase import Timebase

CAMERA = VirtualSensor()
SILENT = SignalOptions(snr_db=math.inf)


def plate(
    width_m: float, distance_m: float, cells: int = 8, frames: int = 1, speed_mps: float = 0.0
) -> MeshSequence:
    """Square plate across the optical axis, facing the camera, approaching."""
    grid = np.linspace(-0.5, 0.5, cells + 1) * width_m
    x, y = np.meshgrid(grid, grid, indexing="ij")
    corner = np.arange((cells + 1) * cells).reshape(cells, cells + 1)[:, :-1].ravel()
    a, b, c, d = corner, corner + 1, corner + cells + 1, corner + cells + 2
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([b, d, c], 1)])
    time_s = np.arange(frames) / 30.0
    vertices = np.zeros((frames, x.size, 3))
    vertices[..., 0], vertices[..., 1] = x.ravel(), y.ravel()
    vertices[..., 2] = (distance_m - speed_mps * time_s)[:, None]
    return MeshSequence(vertices, faces.astype(np.int32), Timebase(time_s), source="plate.npz")


def by_quadrature(phase: np.ndarray, order: int = 40) -> np.ndarray:
    """Mean of exp(j phase) over triangles by Gauss-Legendre on the collapsed square."""
    node, weight = np.polynomial.legendre.leggauss(order)
    node, weight = 0.5 * (node + 1.0), 0.5 * weight
    u, v = np.meshgrid(node, node, indexing="ij")
    share = np.stack([1 - u, u * (1 - v), u * v])  # (3, order, order)
    values = np.exp(1j * np.einsum("nk,kij->nij", phase, share))
    return np.einsum("nij,ij->n", values, 2.0 * u * np.outer(weight, weight))


@pytest.mark.slow
@settings(max_examples=200)
@given(
    start=st.floats(-100.0, 100.0),
    exponents=st.tuples(st.floats(-18, 1.3), st.floats(-18, 1.3)),
    signs=st.tuples(st.sampled_from([-1.0, 0.0, 1.0]), st.sampled_from([-1.0, 1.0])),
)
def test_mean_phasor_is_exact_however_close_the_phases(
    start: float, exponents: tuple[float, float], signs: tuple[float, float]
) -> None:
    steps = [sign * 10.0**power for sign, power in zip(signs, exponents, strict=True)]
    phase = np.array([[start, start + steps[0], start + steps[1]]])
    np.testing.assert_allclose(mean_phasor(phase), by_quadrature(phase), rtol=0, atol=1e-13)


def test_mean_phasor_has_no_seam_between_its_two_forms() -> None:
    spread = np.linspace(0.99, 1.01, 2001)
    phase = np.stack([np.zeros_like(spread), 0.3 * spread, spread], axis=1)
    steps = np.abs(np.diff(mean_phasor(phase), n=2))
    assert steps.max() < 1e-10


@pytest.mark.parametrize("receivers", [1, 2, 3])
def test_echo_is_the_sum_of_every_scatterers_phase(receivers: int) -> None:
    config = replace(PAPER_RADAR, receivers=receivers, chirps_per_frame=7, samples_per_chirp=11)
    sensor = VirtualSensor(position_m=(0.3, -0.2, 0.1), azimuth_deg=20.0)
    random = np.random.default_rng(2)
    position = random.normal((0.0, 0.0, 3.0), 1.0, size=(30, 3))
    velocity = random.normal(size=(30, 3))
    amplitude = random.normal(size=30) + 1j * random.normal(size=30)
    found = echo(Scatterers(position, velocity, amplitude), config, sensor)

    wavelength_m = SPEED_OF_LIGHT_MPS / 60e9
    chirp_s = (np.arange(7) - 3.0) * config.chirp_repetition_s
    sample_s = (np.arange(11) - 5.5) / config.sample_rate_hz
    right = np.array([math.cos(math.radians(20)), 0.0, -math.sin(math.radians(20))])
    expected = np.zeros_like(found)
    for receiver in range(receivers):
        offset = (receiver - 0.5 * (receivers - 1)) * 0.5 * wavelength_m
        antennas = [np.array(sensor.position_m), np.array(sensor.position_m) + offset * right]
        for place, motion, strength in zip(position, velocity, amplitude, strict=True):
            away = [place - antenna for antenna in antennas]
            path_m = sum(float(np.linalg.norm(a)) for a in away)
            rate_mps = sum(float(motion @ a / np.linalg.norm(a)) for a in away)
            delay_s = path_m / SPEED_OF_LIGHT_MPS
            moved_s = rate_mps / SPEED_OF_LIGHT_MPS * (chirp_s[:, None] + sample_s)
            turns = 60e9 * (delay_s + moved_s) + config.slope_hz_per_s * delay_s * sample_s
            expected[receiver] += (strength * np.exp(2j * np.pi * turns)).real
    np.testing.assert_allclose(found, expected, atol=1e-9)


def test_facets_do_not_depend_on_how_finely_the_plate_is_cut() -> None:
    # 0.3 m across at 1.5 m: the phase turns six times from the middle to a corner.
    coarse, fine = (plate(0.3, 1.5, cells) for cells in (24, 96))
    found = []
    for mesh in (coarse, fine):
        assert mesh.faces is not None
        scatterers = facet_scatterers(
            mesh.frame(0), np.zeros_like(mesh.frame(0)), mesh.faces, CAMERA, PAPER_RADAR
        )
        assert len(scatterers.amplitude) == len(mesh.faces)
        found.append(echo(scatterers, PAPER_RADAR, CAMERA))
    scale = np.abs(found[1]).max()
    by_facets = np.abs(found[0] - found[1]).max()
    assert by_facets < 0.002 * scale
    # One point per facet is far worse: this is why the phase is integrated.
    by_points = np.abs(echo(as_points(coarse), PAPER_RADAR, CAMERA) - found[1]).max()
    assert by_points > 30 * by_facets


def as_points(mesh: MeshSequence) -> Scatterers:
    """The plate's facets as bare points of the same area."""
    assert mesh.faces is not None
    corners = mesh.frame(0)[mesh.faces]
    centre = corners.mean(axis=1)
    area = np.full(len(centre), 0.3**2 / len(centre))
    return point_scatterers(centre, (0.0, 0.0, 0.0), area, CAMERA)


def test_a_small_facet_echoes_area_times_cosine_over_range_squared() -> None:
    side = 1e-5
    tilt = math.radians(60)
    corners = np.array([[0, 0, 0], [0, side, 0], [side * math.cos(tilt), 0, side * math.sin(tilt)]])
    faces = np.array([[0, 1, 2]], dtype=np.int32)
    still = np.zeros((3, 3))
    for range_m in (2.0, 6.0):
        place = corners + np.array([0.0, 0.0, range_m])
        seen = facet_scatterers(place, still, faces, CAMERA, PAPER_RADAR)
        expected = 0.5 * side**2 * math.cos(tilt) / range_m**2
        assert abs(seen.amplitude[0]) == pytest.approx(expected, rel=1e-4)
    away = facet_scatterers(place, still, faces[:, ::-1].copy(), CAMERA, PAPER_RADAR)
    assert len(away.amplitude) == 0


def test_hidden_facets_do_not_echo() -> None:
    mesh = plate(0.2, 2.0, frames=3)
    assert mesh.faces is not None
    visible = np.zeros((3, len(mesh.faces)), dtype=bool)
    visible[1, :5] = True
    scene = MeshScene(mesh, PAPER_RADAR, CAMERA, visible)
    assert [len(scatterers_at(scene, time).amplitude) for time in mesh.times_s] == [0, 5, 0]
    with pytest.raises(Sd2Error, match=r"visibility has shape \(3, 4\)"):
        MeshScene(mesh, PAPER_RADAR, CAMERA, visible[:, :4])


@pytest.mark.parametrize("speed_mps", [1.3, -0.7])
def test_a_plate_has_its_velocity_and_range(speed_mps: float) -> None:
    mesh = plate(0.1, 2.4, frames=12, speed_mps=speed_mps)
    capture = simulate_capture(mesh, PAPER_RADAR, options=SignalOptions(snr_db=20))
    assert capture.simulated
    assert capture.samples.dtype == np.uint16
    np.testing.assert_allclose(capture.timebase.times_s, mesh.times_s)
    columns = doppler_map(capture, bins=32, v_max_mps=2.0)
    assert columns.kind == "simulated"
    peaks = columns.peak_velocity_mps()
    assert (np.abs(peaks - speed_mps) <= 0.5 * columns.axis.bin_width_mps).all()
    for frame in (0, 11):
        cells = range_doppler(capture, frame)
        expected_m = 2.4 - speed_mps * frame / 30
        found_m = cells.range_m[cells.range_profile.argmax()]
        assert abs(found_m - expected_m) <= PAPER_RADAR.range_resolution_m


def test_frames_between_mesh_frames_are_interpolated() -> None:
    mesh = plate(0.05, 2.4, frames=31, speed_mps=0.9)
    radar = replace(PAPER_RADAR, frame_repetition_s=0.026)
    scene = MeshScene(mesh, radar, CAMERA)
    times_s = radar_times_s(mesh.timebase, radar)
    assert len(times_s) == 39
    for time_s in times_s:
        seen = scatterers_at(scene, float(time_s))
        np.testing.assert_allclose(seen.position_m[:, 2], 2.4 - 0.9 * time_s, atol=1e-9)
        np.testing.assert_allclose(seen.velocity_mps[:, 2], -0.9, atol=1e-9)


def test_noise_has_the_power_that_was_asked_for() -> None:
    mesh = plate(0.1, 2.4, frames=10, speed_mps=1.0)
    options = SignalOptions(snr_db=6.0, peak_share=0.3)
    clean = simulate_capture(mesh, PAPER_RADAR, options=replace(options, snr_db=math.inf))
    noisy = simulate_capture(mesh, PAPER_RADAR, options=options)
    signal = clean.samples.astype(np.float64) - 2048
    noise = noisy.samples.astype(np.float64) - clean.samples
    measured_db = 10 * np.log10(np.mean(signal**2) / np.mean(noise**2))
    assert measured_db == pytest.approx(6.0, abs=0.1)
    assert abs(noise.mean()) < 0.05 * noise.std()
    assert np.abs(signal).max() == pytest.approx(0.3 * 2048, abs=1.0)
    levels = noisy.meta["simulation"]
    assert levels["noise_rms_counts"] == pytest.approx(noise.std(), rel=0.02)
    assert levels["clipped_share"] == 0.0


def test_static_reflectors_stand_still_at_their_range() -> None:
    mesh = plate(0.1, 2.4, frames=4, speed_mps=1.0)
    room = (Reflector((0.0, 0.0, 6.0), 0.05),)
    capture = simulate_capture(
        mesh, PAPER_RADAR, options=SignalOptions(snr_db=math.inf, reflectors=room)
    )
    cells = range_doppler(capture, 2, range_m=(5.0, 7.0))
    at_rest = np.abs(cells.axis.centres_mps) < 0.11
    assert cells.values[:, at_rest].sum() > 0.9 * cells.values.sum()
    assert cells.range_m[cells.range_profile.argmax()] == pytest.approx(6.0, abs=0.31)
    cleared = doppler_map(capture, clutter="mean")
    assert (np.abs(cleared.peak_velocity_mps() - 1.0) <= 0.1).all()


def test_same_seed_same_bits() -> None:
    mesh = plate(0.1, 2.4, frames=3, speed_mps=1.0)
    first, again, other = (
        simulate_capture(mesh, PAPER_RADAR, options=SignalOptions(seed=seed)).samples
        for seed in (7, 7, 8)
    )
    np.testing.assert_array_equal(first, again)
    assert (first != other).any()


def test_a_simulated_recording_survives_the_disk_and_says_what_it_is(tmp_path: Path) -> None:
    mesh = plate(0.1, 2.4, frames=3, speed_mps=1.0)
    capture = simulate_capture(mesh, PAPER_RADAR, options=SILENT)
    folder = write_capture(
        tmp_path / "radar",
        capture.samples,
        capture.config,
        capture.timebase.times_s,
        simulated=capture.simulated,
        meta=capture.meta,
    )
    loaded = load_capture(folder)
    assert loaded.simulated
    assert loaded.notes == ()
    np.testing.assert_array_equal(loaded.samples[:], capture.samples)
    assert loaded.meta["simulation"] == json.loads(json.dumps(capture.meta["simulation"]))
    assert loaded.meta["simulation"]["source"] == "plate.npz"
    assert doppler_map(loaded).kind == "simulated"


def test_nothing_in_view_is_noise_and_never_nan() -> None:
    mesh = plate(0.1, -2.0, frames=2)  # behind the sensor, showing its back
    capture = simulate_capture(mesh, PAPER_RADAR)
    assert capture.samples.std() == pytest.approx(4.0, rel=0.05)
    inside = simulate_capture(plate(0.1, 0.0, frames=2), PAPER_RADAR, options=SILENT)
    assert np.isfinite(doppler_map(inside).values).all()
    far = simulate_capture(plate(0.1, 1e6, frames=2), PAPER_RADAR, options=SILENT)
    assert np.isfinite(doppler_map(far).values).all()


def test_one_mesh_frame_stands_still() -> None:
    capture = simulate_capture(plate(0.1, 2.0), PAPER_RADAR, options=SILENT)
    assert capture.frame_count == 1
    assert abs(doppler_map(capture).peak_velocity_mps()[0]) <= 0.05001


def test_a_point_cloud_and_a_wide_converter_are_refused() -> None:
    cloud = MeshSequence(np.zeros((2, 3, 3)), None, Timebase([0.0, 0.1]), source="cloud.npz")
    with pytest.raises(Sd2Error, match=r"cloud\.npz has no faces"):
        simulate_capture(cloud, PAPER_RADAR)
    with pytest.raises(Sd2Error, match="24 bits"):
        simulate_capture(plate(0.1, 2.0), replace(PAPER_RADAR, adc_bits=24))


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"snr_db": -math.inf}, "snr_db is -inf"),
        ({"snr_db": math.nan}, "snr_db is nan"),
        ({"peak_share": 0.0}, "peak_share is 0.0"),
    ],
)
def test_levels_that_make_no_sense_are_refused(options: dict, sentence: str) -> None:
    with pytest.raises(Sd2Error, match=sentence):
        SignalOptions(**options)


def test_it_reports_and_stops_when_told() -> None:
    mesh = plate(0.1, 2.4, frames=6)
    steps: list[tuple[int, int]] = []
    simulate_capture(mesh, PAPER_RADAR, progress=lambda done, total: steps.append((done, total)))
    assert steps == [(done, 6) for done in range(7)]

    def stop(done: int, total: int) -> None:
        if done == 2:
            raise Cancelled

    with pytest.raises(Cancelled):
        simulate_capture(mesh, PAPER_RADAR, progress=stop)


def test_points_can_be_simulated_without_a_mesh() -> None:
    capture = capture_scene(
        lambda time_s: point_scatterers(
            [[0.0, 0.0, 3.0 + 0.8 * time_s]], [[0.0, 0.0, 0.8]], 0.01, CAMERA
        ),
        np.arange(4) / 30,
        PAPER_RADAR,
        options=SILENT,
    )
    peaks = doppler_map(capture, bins=32, v_max_mps=2.0).peak_velocity_mps()
    np.testing.assert_allclose(peaks, -0.8125)


def test_a_radar_of_complex_samples_is_refused() -> None:
    with pytest.raises(Sd2Error, match="samples I and Q"):
        simulate_capture(plate(0.5, 2.0), RADARS["iwr6843"])
