"""Facets, paths and sums of the FMCW simulation against closed forms."""

from __future__ import annotations

import itertools
import json
import math
import tracemalloc
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from facet_scatterers import facet_scatterers, mean_phasor
from facet_signal import echo
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles.plain_sum import plain_sum

from sd2core.errors import Sd2Error
from sd2core.fmcw.cutting import subdivided
from sd2core.fmcw.facet import bent_facet_mean, facet_mean, unit_phasor
from sd2core.fmcw.options import (
    Antenna,
    Mirror,
    Reflector,
    SignalOptions,
    WaveOptions,
    paths,
)
from sd2core.fmcw.processing import doppler_map
from sd2core.fmcw.scene import MeshScene, radar_times_s
from sd2core.fmcw.simulation import simulate_radar
from sd2core.fmcw.sums import Echoes, direct, nufft
from sd2core.fmcw.wave import WaveScene
from sd2core.io.radar import load_capture
from sd2core.io.radar.infineon import write_capture
from sd2core.mesh.sequence import MeshSequence
from sd2core.progress import Cancelled
from sd2core.radar_config import PAPER_RADAR, SPEED_OF_LIGHT_MPS, RadarConfig
from sd2core.scattering.beam import sensor_axes
from sd2core.sensor import VirtualSensor
from sd2core.timebase import Timebase

CAMERA = VirtualSensor()
LAMBDA_M = PAPER_RADAR.wavelength_m
SILENT = SignalOptions(snr_db=math.inf)


def sheet(width_m: float, place_m: Any, cells: int = 1, tilt_deg: float = 0.0) -> MeshSequence:
    """Square plate whose front looks to -z before it is tilted about y; (T, 3) places."""
    grid = np.linspace(-0.5, 0.5, cells + 1) * width_m
    x, y = np.meshgrid(grid, grid, indexing="ij")
    corner = np.arange((cells + 1) * cells).reshape(cells, cells + 1)[:, :-1].ravel()
    a, b, c, d = corner, corner + 1, corner + cells + 1, corner + cells + 2
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([b, d, c], 1)])
    tilt = math.radians(tilt_deg)
    flat = np.stack([x.ravel() * math.cos(tilt), y.ravel(), x.ravel() * math.sin(tilt)], axis=1)
    places = np.atleast_2d(np.asarray(place_m, dtype=np.float64))
    vertices = flat + places[:, None, :]
    return MeshSequence(
        vertices, faces.astype(np.int32), Timebase.regular(len(places), 30.0), "sheet.npz"
    )


def echoes_of(
    mesh: MeshSequence, wave: WaveOptions, config: RadarConfig = PAPER_RADAR, receiver: int = 0
) -> Echoes:
    scene = WaveScene(mesh, config, CAMERA, wave=wave)
    still = np.zeros((mesh.vertex_count, 3))
    return scene.echoes(mesh.frame(0).astype(np.float64), still, None, receiver)


def at_the_middle(echoes: Echoes) -> complex:
    """Sum of the echoes without modulation."""
    return complex((echoes.amplitude * np.exp(4j * np.pi / LAMBDA_M * echoes.range_m)).sum())


def random_echoes(seed: int, count: int, far_m: float, fast_mps: float) -> Echoes:
    random = np.random.default_rng(seed)
    return Echoes(
        far_m * random.uniform(0.1, 1.0, count),
        fast_mps * random.uniform(-1.0, 1.0, count),
        random.normal(size=count) + 1j * random.normal(size=count),
    )


@settings(max_examples=40, deadline=None, derandomize=True)
@given(
    seed=st.integers(0, 1000),
    count=st.integers(1, 40),
    chirps=st.integers(2, 17),
    samples=st.integers(2, 19),
    far_m=st.sampled_from([0.01, 2.0, 30.0, 2.5e6]),
    fast_mps=st.sampled_from([0.0, 1.0, 300.0]),
)
def test_nufft_with_a_block_per_chirp_is_the_direct_sum(
    seed: int, count: int, chirps: int, samples: int, far_m: float, fast_mps: float
) -> None:
    config = replace(PAPER_RADAR, chirps_per_frame=chirps, samples_per_chirp=samples)
    echoes = random_echoes(seed, count, far_m, fast_mps)
    apart = np.abs(nufft(echoes, config, chirps) - direct(echoes, config)).max()
    assert apart <= 1e-7 * np.abs(echoes.amplitude).sum()


@pytest.mark.parametrize("far_m", [3.0, 2.5e6])
def test_direct_sum_in_extended_precision(far_m: float) -> None:
    # 2.5e6 m is 1e9 turns of the carrier.
    config = replace(PAPER_RADAR, chirps_per_frame=5, samples_per_chirp=6)
    echoes = random_echoes(1, 20, far_m, 5.0)
    wide = np.longdouble
    carrier = wide(2.0) / wide(config.wavelength_m)
    slope = wide(2.0) * wide(config.slope_hz_per_s) / wide(SPEED_OF_LIGHT_MPS)
    expected = np.zeros((5, 6), np.clongdouble)
    for m in range(5):
        for n in range(6):
            t_m = wide(m - 2) * wide(config.chirp_repetition_s)
            t_n = wide(n - 3) / wide(config.sample_rate_hz)
            range_m, rate = echoes.range_m.astype(wide), echoes.rate_mps.astype(wide)
            turns = carrier * (range_m + rate * (t_m + t_n)) + slope * (range_m + rate * t_m) * t_n
            angle = 2 * np.pi * (turns - np.floor(turns)).astype(np.float64)
            expected[m, n] = (echoes.amplitude * np.exp(1j * angle)).sum()
    apart = np.abs(direct(echoes, config) - expected).max()
    # A range in float64 is good to 2^-53 of itself, times 2 pi turns per half wavelength.
    rounding = 2.0**-52 * far_m * 4 * np.pi / config.wavelength_m
    assert apart <= (1e-12 + 2.0 * rounding) * np.abs(echoes.amplitude).sum()


def test_more_blocks_follow_the_change_of_range() -> None:
    config = replace(PAPER_RADAR, start_frequency_hz=59e9, end_frequency_hz=61e9)
    echoes = random_echoes(3, 50, 4.0, 3.0)
    reference = direct(echoes, config)
    errors = [
        np.linalg.norm(nufft(echoes, config, blocks) - reference) / np.linalg.norm(reference)
        for blocks in (1, 2, 4, 8)
    ]
    assert 0.01 < errors[0] < 0.5
    for fewer, more in itertools.pairwise(errors):
        assert more == pytest.approx(0.5 * fewer, rel=0.25)  # the phase left out is halved


def test_uneven_blocks_leave_no_chirp_out() -> None:
    config = replace(PAPER_RADAR, chirps_per_frame=7)
    echoes = random_echoes(4, 9, 3.0, 0.0)
    for blocks in (1, 2, 3, 7, 100):
        np.testing.assert_allclose(nufft(echoes, config, blocks), direct(echoes, config), atol=1e-6)


def test_one_block_is_the_signal_of_the_sample() -> None:
    config = replace(PAPER_RADAR, receivers=2)
    mesh = sheet(0.4, [[0.1, -0.15, 2.0]], cells=40)
    assert mesh.faces is not None
    velocity = np.broadcast_to([0.4, -0.9, 1.1], (mesh.vertex_count, 3)).copy()
    sensor = VirtualSensor(azimuth_deg=15.0)
    seen = facet_scatterers(mesh.frame(0), velocity, mesh.faces, sensor, config)
    scene = WaveScene(mesh, config, sensor)
    expected = echo(seen, config, sensor)
    for receiver in (0, 1):
        found = nufft(scene.echoes(mesh.frame(0), velocity, None, receiver), config).real
        # The sample takes a facet's amplitude at the transmitter for every receiver, and of
        # the bend of the phase (0.06 rad here) only the mean.
        assert np.abs(found - expected[receiver]).max() <= 0.02 * np.abs(expected).max()


@settings(max_examples=200, deadline=None, derandomize=True)
@given(st.tuples(*[st.floats(-200, 200)] * 3), st.sampled_from([1.0, 1e-2, 1e-3, 1e-9, 0.0]))
def test_the_mean_over_a_facet_with_linear_phase(
    phases: tuple[float, float, float], scale: float
) -> None:
    p, q, r = (scale * phase for phase in phases)
    found, _ = facet_mean(p, q, r, *(1.0,) * 3, *(0.0,) * 6)
    # A span below 1e-3 rad is taken as none, which leaves 1e-6 / 36; rounding is divided
    # by a span squared.
    assert abs(found - mean_phasor(np.array([[p, q, r]]))[0]) < 1e-7


@settings(max_examples=40, deadline=None, derandomize=True)
@given(
    st.tuples(*[st.floats(-20, 20)] * 3),
    st.tuples(*[st.floats(0.5, 1.5)] * 3),
    st.tuples(*[st.floats(-2, 2)] * 3),
    st.tuples(*[st.floats(0.0, 0.3)] * 3),
)
def test_the_mean_over_a_facet_by_cubature(
    phase: tuple[float, ...],
    weight: tuple[float, ...],
    turn: tuple[float, ...],
    bend: tuple[float, ...],
) -> None:
    wanted = cut_mean(phase, weight, bend)
    found, _ = facet_mean(*phase, *weight, *turn, *bend)
    # Second order: half the square of what a bend leaves about its mean, at most a quarter.
    assert abs(found - wanted) < 1.5 * 0.5 * (0.25 * sum(bend)) ** 2 + 1e-3
    _, change = facet_mean(*phase, *(1.0,) * 3, *turn, *(0.0,) * 3)
    later, before = (
        facet_mean(*np.add(phase, step * np.array(turn)), *(1.0,) * 3, *(0.0,) * 6)[0]
        for step in (1e-3, -1e-3)
    )
    # Central difference; where the span is taken as none the change is too.
    assert abs(change - (later - before) / 2e-3) < 2e-3


def cut_mean(phase: Any, weight: Any, bend: Any) -> complex:
    """Mean over a facet in 4096 pieces, each with linear phase and constant weight."""
    corners = subdivided(np.eye(3)[None], 6)  # (pieces, 3 corners, 3 shares)
    a, b, c = np.moveaxis(corners, 2, 0)
    sag = a * b * bend[0] + b * c * bend[1] + c * a * bend[2]
    weights = (corners @ np.asarray(weight)).mean(axis=1)
    return complex((weights * mean_phasor(corners @ np.asarray(phase) - sag)).mean())


def test_bends_are_followed_to_first_order() -> None:
    phase, weight = (0.0, 2.0, 5.0), (0.9, 1.0, 1.2)
    errors = []
    for scale in (0.4, 0.2, 0.1):
        bend = scale * np.array([0.2, 1.0, 0.6])
        wanted = cut_mean(phase, weight, bend)
        errors.append(abs(facet_mean(*phase, *weight, *(0.0,) * 3, *bend)[0] - wanted))
    # The product of a bend and an uneven weight is left out: some 0.03 x 0.2.
    assert errors[0] < 0.01
    assert errors[2] < 0.5 * errors[0]
    flat = abs(facet_mean(*phase, *weight, *(0.0,) * 6)[0] - cut_mean(phase, weight, (0, 0, 0)))
    assert flat < 1e-4
    even = [
        abs(
            facet_mean(*phase, *(1.0,) * 3, *(0.0,) * 3, *bend)[0]
            - cut_mean(phase, (1.0,) * 3, bend)
        )
        for bend in (scale * np.array([0.2, 1.0, 0.6]) for scale in (0.8, 0.4, 0.2))
    ]
    assert even[1] < 0.3 * even[0]  # what is left is of second order
    assert even[2] < 0.3 * even[1]


@pytest.mark.slow
def test_a_facet_that_bends_much_is_cut() -> None:
    phase, weight, bend = (3.0, 0.0, 7.0), (0.9, 1.0, 1.1), (1.5, 0.8, 2.0)
    wanted = cut_mean(phase, weight, bend)
    whole, cut = (
        abs(mean(*phase, *weight, 1.0, -2.0, 0.5, *bend)[0] - wanted)
        for mean in (facet_mean, bent_facet_mean)
    )
    # Bends of a quarter leave a sixteenth of the second order.
    assert cut < 0.2 * whole
    little = (*phase, *weight, 1.0, -2.0, 0.5, 0.2, 0.1, 0.3)
    assert bent_facet_mean(*little) == facet_mean(*little)
    # Changes leave the bend out, which is small in every piece.
    _, change = bent_facet_mean(*phase, *(1.0,) * 3, 1.0, -2.0, 0.5, 1.0, 0.0, 0.0)
    later, before = (
        bent_facet_mean(
            *np.add(phase, step * np.array([1.0, -2.0, 0.5])), *(1.0,) * 3, *(0.0,) * 3, 1.0, 0, 0
        )[0]
        for step in (1e-3, -1e-3)
    )
    assert abs(change - (later - before) / 2e-3) < 0.05 * abs(change)


@settings(max_examples=200, deadline=None, derandomize=True)
@given(st.floats(-1e7, 1e7))
def test_a_phasor_is_cosine_and_sine(phase_rad: float) -> None:
    # The first term of the sine left out: (pi / 4)^15 / 15!.
    expected = complex(math.cos(phase_rad), math.sin(phase_rad))
    assert abs(unit_phasor(phase_rad) - expected) < 3e-14


@settings(max_examples=20, deadline=None, derandomize=True)
@given(st.integers(0, 1000), st.sampled_from([2.0, 2.5e6]), st.integers(1, 3))
def test_the_direct_sum_is_that_of_every_phase_by_itself(
    seed: int, far_m: float, terms: int
) -> None:
    one = random_echoes(seed, 20, far_m, 5.0)
    random = np.random.default_rng(seed)
    amplitude = random.normal(size=(terms, 20)) + 1j * random.normal(size=(terms, 20))
    echoes = Echoes(one.range_m, one.rate_mps, amplitude)
    apart = np.abs(direct(echoes, PAPER_RADAR) - plain_sum(echoes, PAPER_RADAR)).max()
    # Phases of up to 1e5 turns from sample to sample are rounded before they are reduced.
    assert apart <= 1e-9 * np.abs(amplitude).sum()
    apart = np.abs(nufft(echoes, PAPER_RADAR, 64) - direct(echoes, PAPER_RADAR)).max()
    assert apart <= 1e-7 * np.abs(amplitude).sum()


@pytest.mark.parametrize("tilt_deg", [0.0, 1.0, 4.0, 12.0])
def test_a_far_plate_has_the_pattern_of_its_aperture(tilt_deg: float) -> None:
    width_m, range_m = 0.05, 1000.0
    mesh = sheet(width_m, [[0.0, 0.0, range_m]], cells=10, tilt_deg=tilt_deg)
    tilt = math.radians(tilt_deg)
    aperture = np.sinc(2.0 * width_m * math.sin(tilt) / LAMBDA_M)
    expected = width_m**2 * math.cos(tilt) / range_m**2 * aperture
    found = at_the_middle(echoes_of(mesh, WaveOptions())) * np.exp(-4j * np.pi / LAMBDA_M * range_m)
    # What is left is the curvature of the wave: 4 pi / lambda * (w / 2)^2 / R.
    assert found == pytest.approx(expected, abs=2e-3 * width_m**2 / range_m**2)


def test_two_receivers_differ_by_the_angle_of_arrival() -> None:
    sensor = VirtualSensor(position_m=(0.2, 0.1, -0.3), azimuth_deg=25.0, elevation_deg=10.0)
    config = replace(PAPER_RADAR, receivers=3)
    step = 0.5 * LAMBDA_M
    wave = WaveOptions(receiver_offsets_m=((0, 0, 0), (step, 0, 0), (0, step, 0)))
    axes = sensor_axes(sensor)
    right, down = math.sin(math.radians(20.0)), math.sin(math.radians(-7.0))
    towards = np.array([right, down, math.sqrt(1 - right**2 - down**2)]) @ axes
    place = np.array(sensor.position_m) + 500.0 * towards
    scene = WaveScene(sheet(1.0, [[0, 0, 5.0]]), config, sensor, wave=wave)
    phase = []
    for out, back in (ways[None][0] for ways in scene.paths):
        path_m = np.linalg.norm(place - out.position_m) + np.linalg.norm(place - back.position_m)
        phase.append(2 * np.pi / LAMBDA_M * path_m)
    signal = scene.static((Reflector(tuple(place), 1.0),))
    # From chirp to chirp nothing moves; along the samples the beat is common to all.
    spectrum = np.fft.rfft(signal[:, 0], axis=1)
    strongest = np.abs(spectrum[0]).argmax()
    found = np.angle(spectrum[1:, strongest] / spectrum[0, strongest])
    # pi per half wavelength and sine of the angle, nearer means less phase.
    expected = -np.pi * np.array([right, down])
    np.testing.assert_allclose(np.subtract(phase[1:], phase[0]), expected, atol=1e-3)
    np.testing.assert_allclose(found, expected, atol=0.05)


def test_the_sensors_frame() -> None:
    np.testing.assert_allclose(sensor_axes(CAMERA), np.eye(3), atol=1e-15)
    turned = sensor_axes(VirtualSensor(azimuth_deg=30, elevation_deg=-20))
    np.testing.assert_allclose(turned @ turned.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(turned) == pytest.approx(1.0)
    assert turned[0, 1] == 0.0  # to the right stays level


def test_receivers_stand_half_a_wavelength_apart_unless_told() -> None:
    config = replace(PAPER_RADAR, receivers=3)
    places = [ways[None][0][1].position_m for ways in paths(CAMERA, config, WaveOptions())]
    np.testing.assert_allclose(np.diff(places, axis=0), [[0.5 * LAMBDA_M, 0, 0]] * 2)
    np.testing.assert_allclose(places[1], 0.0)
    with pytest.raises(Sd2Error, match="1 receivers are placed, and the radar has 3"):
        paths(CAMERA, config, WaveOptions(receiver_offsets_m=((0.0, 0.0, 0.0),)))


def test_the_beam_is_3_db_down_each_way_at_its_edge() -> None:
    for width_deg in (20.0, 60.0, 120.0):
        wave = WaveOptions(beam_width_deg=width_deg)
        gains = []
        for angle_deg in (0.0, 0.5 * width_deg, 100.0):
            sensor = VirtualSensor(azimuth_deg=angle_deg)
            scene = WaveScene(sheet(1e-4, [[0, 0, 2.0]]), PAPER_RADAR, sensor, wave=wave)
            still = np.zeros((4, 3))
            facets = scene.echoes(scene.scene.mesh.frame(0), still, None)
            point = scene.static((Reflector((0.0, 0.0, 2.0), 1e-8),))
            gains.append((abs(facets.amplitude.sum()), np.abs(point).max()))
        for ahead, edge, behind in zip(*gains, strict=True):
            assert edge == pytest.approx(0.5 * ahead, rel=1e-4)
            assert behind == 0.0


def test_two_rays_make_the_fringe_of_the_textbook() -> None:
    floor = Mirror.ground(1.0, -0.6)
    range_m = 8.0
    for height_m in np.linspace(-0.5, 0.95, 30):  # y is down: 0.95 is just above the floor
        scene = WaveScene(
            sheet(1.0, [[0, 0, 5.0]]), PAPER_RADAR, CAMERA, wave=WaveOptions(mirror=floor)
        )
        place = np.array([0.0, height_m, range_m])
        straight, bounced = np.linalg.norm(place), np.linalg.norm(place - [0.0, 2.0, 0.0])
        # Out and back by either way: the one-way sum squared.
        one_way = sum(
            gain / path_m * np.exp(2j * np.pi / LAMBDA_M * path_m)
            for gain, path_m in ((1.0, straight), (-0.6, bounced))
        )
        parts = [
            scene._points((Reflector(tuple(place), 1.0),), out, back)
            for out, back in scene.paths[0][None]
        ]
        found = sum(at_the_middle(part) for part in parts)
        assert found == pytest.approx(one_way**2, abs=1e-9)
        facet = sheet(1e-5, [place], tilt_deg=0.0)
        small = echoes_of(facet, WaveOptions(mirror=floor))
        # A facet weighs every path with the mean of its two cosines.
        cosines = range_m / straight, range_m / bounced
        expected = 1e-10 * sum(
            gain_a
            * gain_b
            / (a * b)
            * 0.5
            * (cos_a + cos_b)
            * np.exp(2j * np.pi / LAMBDA_M * (a + b))
            for gain_a, a, cos_a in zip((1.0, -0.6), (straight, bounced), cosines, strict=True)
            for gain_b, b, cos_b in zip((1.0, -0.6), (straight, bounced), cosines, strict=True)
        )
        assert at_the_middle(small) == pytest.approx(expected, abs=1e-13)


def test_there_is_no_reflection_from_beyond_the_plane() -> None:
    behind = sheet(0.1, [[0.0, 0.0, 6.0]])
    walled = echoes_of(behind, WaveOptions(mirror=Mirror.wall(4.0, 0.9)))
    np.testing.assert_array_equal(walled.amplitude, echoes_of(behind, WaveOptions()).amplitude)
    image = Antenna(np.array([0.0, 0.0, 1.0]), np.eye(3)).mirrored(Mirror.wall(4.0))
    np.testing.assert_allclose(image.position_m, [0, 0, 7])
    np.testing.assert_allclose(image.axes[2], [0, 0, -1])


def test_a_rough_surface_adds_powers() -> None:
    mesh = sheet(0.3, [[0.0, 0.0, 2.0]], cells=6)
    still = np.zeros((mesh.vertex_count, 3))
    scenes = [
        WaveScene(mesh, PAPER_RADAR, CAMERA, wave=WaveOptions(coherent=False), seed=seed)
        for seed in range(2000)
    ]
    echoes = [scene.echoes(mesh.frame(0), still, None) for scene in scenes]
    powers = np.array([abs(at_the_middle(one)) ** 2 for one in echoes])
    expected = (np.abs(echoes[0].amplitude) ** 2).sum()
    # Exponential: its mean over n is off by 1 / sqrt(n); 4 of these.
    assert powers.mean() == pytest.approx(expected, rel=4 / math.sqrt(2000))
    assert powers.std() == pytest.approx(expected, rel=0.15)
    # Power neither depends on the cut nor differs from gamma A cos / R^4.
    finer = echoes_of(sheet(0.3, [[0.0, 0.0, 2.0]], cells=60), WaveOptions(coherent=False))
    assert (np.abs(finer.amplitude) ** 2).sum() == pytest.approx(expected, rel=1e-3)
    assert expected == pytest.approx(0.09 * (0.5 * LAMBDA_M) ** 2 / 2.0**4, rel=0.03)


@pytest.mark.parametrize("coherent", [True, False])
def test_phase_runs_on_from_frame_to_frame(coherent: bool) -> None:
    # Frames without a gap: the chirp after the last of a frame is the first of the next.
    config = replace(PAPER_RADAR, frame_repetition_s=64 * PAPER_RADAR.chirp_repetition_s)
    speed_mps = 0.8
    places = np.zeros((12, 3))
    places[:, 2] = 3.0 - speed_mps * np.arange(12) / 30
    scene = WaveScene(
        sheet(0.005, places), config, CAMERA, wave=WaveOptions(coherent=coherent), seed=4
    )
    times_s = radar_times_s(scene.scene.mesh.timebase, config)[4:8]
    rows = []
    for time_s in times_s:
        position, velocity = scene.scene.moving(float(time_s))
        rows.append(nufft(scene.echoes(position, velocity, None), config, 64)[:, 16])
    steps = np.angle(np.concatenate(rows)[1:] / np.concatenate(rows)[:-1])
    expected = -4 * np.pi / LAMBDA_M * speed_mps * config.chirp_repetition_s
    np.testing.assert_allclose(steps, expected, atol=2e-3)


def test_vertices_are_interpolated_at_every_chirp() -> None:
    # Constant acceleration: central differences and cubics through them are exact.
    times_s = np.arange(9) / 30
    distance_m = 3.0 - 0.5 * times_s - 0.5 * 12.0 * (times_s - 0.13) ** 2
    places = np.stack([0 * times_s, 0 * times_s, distance_m], axis=1)
    mesh = sheet(0.004, places)
    middle_s = float(times_s[4])
    config = PAPER_RADAR
    chirp_s = middle_s + (np.arange(64) - 31.5) * config.chirp_repetition_s
    scene = MeshScene(mesh, config, CAMERA)
    expected_m = 3.0 - 0.5 * chirp_s - 6.0 * (chirp_s - 0.13) ** 2
    for (position, velocity), want_m, time_s in zip(
        scene.between(chirp_s), expected_m, chirp_s, strict=True
    ):
        np.testing.assert_allclose(position[:, 2], want_m, atol=1e-12)
        np.testing.assert_allclose(velocity[:, 2], -0.5 - 12.0 * (time_s - 0.13), atol=1e-9)
    signals = {
        (model, motion): WaveScene(
            mesh, config, CAMERA, wave=WaveOptions(model=model, motion=motion, blocks=64)
        ).frame(middle_s)
        for model in ("nufft", "direct")
        for motion in ("constant", "interpolated")
    }
    scale = np.abs(signals["direct", "interpolated"]).max()
    for motion in ("constant", "interpolated"):
        apart = signals["nufft", motion] - signals["direct", motion]
        assert np.abs(apart).max() < 1e-7 * scale
    # Half of 12 m/s^2 times (12.5 ms)^2 is 1 mm, 2.4 rad at the frame's ends.
    apart = np.abs(signals["direct", "interpolated"] - signals["direct", "constant"])[0].max(axis=1)
    assert apart[[0, 63]].min() > 0.5 * scale
    assert apart[30:34].max() < 0.01 * scale


def test_one_frame_stands_still_on_every_path() -> None:
    scene = MeshScene(sheet(0.1, [[0, 0, 2.0]]), PAPER_RADAR, CAMERA)
    position, velocity = next(scene.between(np.zeros(1)))
    np.testing.assert_array_equal(position, scene.mesh.frame(0))
    np.testing.assert_array_equal(velocity, 0.0)


def test_a_capture_survives_the_disk_and_says_how_it_was_made(tmp_path: Path) -> None:
    places = np.array([[0.0, 0.0, 2.4 - 1.1 * k / 30] for k in range(6)])
    wave = WaveOptions(mirror=Mirror.ground(1.2), beam_width_deg=60.0, blocks=2)
    config = replace(PAPER_RADAR, receivers=2)
    capture = simulate_radar(
        sheet(0.1, places, cells=6),
        config,
        wave=wave,
        options=SignalOptions(snr_db=20.0, reflectors=(Reflector((0.5, 0.0, 4.0), 0.01),)),
    )
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
    assert loaded.meta["simulation"] == json.loads(json.dumps(capture.meta["simulation"]))
    assert loaded.meta["simulation"]["wave"]["mirror"]["reflection"] == -0.39
    spectrum = doppler_map(loaded, bins=32, v_max_mps=2.0, clutter="mean")
    assert spectrum.kind == "simulated"
    assert np.abs(spectrum.peak_velocity_mps()[1:-1] - 1.1).max() <= 0.125


def test_same_seed_same_bits_whatever_the_threads() -> None:
    mesh = sheet(0.2, np.linspace([0, 0, 2.0], [0, 0, 2.5], 9), cells=5)
    wave = WaveOptions(coherent=False)
    first, again, other = (
        simulate_radar(mesh, PAPER_RADAR, wave=wave, options=SignalOptions(seed=seed)).samples
        for seed in (3, 3, 4)
    )
    np.testing.assert_array_equal(first, again)
    assert (first != other).any()


@pytest.mark.slow
def test_a_small_budget_of_memory_changes_nothing_but_the_memory() -> None:
    # 300 frames of 16 kB in single precision and 8 kB of counts.
    config = replace(PAPER_RADAR, receivers=2)
    mesh = sheet(0.1, np.linspace([0, 0, 2.0], [0, 0, 2.5], 300))
    peaks, captures = [], []
    for budget in (100_000, 100_000_000):
        tracemalloc.start()
        captures.append(
            simulate_radar(mesh, config, options=SignalOptions(20.0), memory_bytes=budget)
        )
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    on_disk, in_memory = captures
    np.testing.assert_array_equal(on_disk.samples, in_memory.samples)
    assert on_disk.meta == in_memory.meta
    assert isinstance(on_disk.samples, np.memmap)
    whole = on_disk.samples.size * (4 + 2)
    assert peaks[1] > whole
    assert peaks[0] < 0.5 * whole
    # Read like any other capture.
    np.testing.assert_array_equal(on_disk.read(7, 9), in_memory.read(7, 9))


@pytest.mark.parametrize("model", ["nufft", "direct"])
def test_it_reports_and_stops_when_told(model: Any) -> None:
    mesh = sheet(0.2, np.linspace([0, 0, 2.0], [0, 0, 2.5], 9), cells=5)
    steps: list[tuple[int, int]] = []
    wave = WaveOptions(model=model)
    simulate_radar(mesh, PAPER_RADAR, wave=wave, progress=lambda *step: steps.append(step))
    assert steps[0] == (0, 9)
    assert steps[-1] == (9, 9)
    assert steps == sorted(steps)

    def stop(done: int, total: int) -> None:
        if done:
            raise Cancelled

    with pytest.raises(Cancelled):
        simulate_radar(mesh, PAPER_RADAR, wave=wave, progress=stop)

    def stop_late(done: int, total: int) -> None:
        rounding.append(done)
        if rounding.count(total) == 3:
            raise Cancelled

    rounding: list[int] = []
    with pytest.raises(Cancelled):  # while samples are rounded
        simulate_radar(mesh, PAPER_RADAR, wave=wave, progress=stop_late)


def test_a_direct_sum_stops_in_the_middle_of_a_frame() -> None:
    asked = 0

    def go_on() -> None:
        nonlocal asked
        asked += 1
        if asked == 3:
            raise Cancelled

    with pytest.raises(Cancelled):
        direct(random_echoes(1, 5000, 3.0, 1.0), PAPER_RADAR, go_on=go_on)


@pytest.mark.parametrize("distance_m", [1e-3, 0.0, 0.3, 1e6])
def test_extreme_distances_stay_finite(distance_m: float) -> None:
    mesh = sheet(0.2, [[0.0, 0.0, distance_m]] * 2, cells=4)
    for coherent in (True, False):
        wave = WaveOptions(coherent=coherent, mirror=Mirror.ground(1.0), beam_width_deg=50.0)
        capture = simulate_radar(mesh, PAPER_RADAR, wave=wave, options=SILENT)
        assert np.isfinite(doppler_map(capture).values).all()


def test_a_sliver_and_a_missing_vertex() -> None:
    mesh = sheet(0.2, [[0.0, 0.0, 2.0]] * 2, cells=2)
    assert mesh.faces is not None
    flat = mesh.faces.copy()
    flat[0] = flat[0, [0, 0, 1]]
    thin = MeshSequence(mesh.vertices, flat, mesh.timebase)
    assert len(echoes_of(thin, WaveOptions()).range_m) == len(flat) - 1
    broken = np.array(mesh.vertices)
    broken[1, 3, 2] = np.inf
    with pytest.raises(Sd2Error, match=r"sheet\.npz: vertex 3 of frame 1 is at"):
        simulate_radar(MeshSequence(broken, mesh.faces, mesh.timebase, "sheet.npz"), PAPER_RADAR)


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"model": "fft"}, "model is 'fft'"),
        ({"motion": "none"}, "motion is 'none'"),
        ({"blocks": 0}, "blocks is 0"),
        ({"beam_width_deg": 180.0}, "180.0 degrees wide"),
        ({"receiver_offsets_m": ((0.0, math.nan, 0.0),)}, "A receiver is at"),
    ],
)
def test_options_that_make_no_sense_are_refused(options: dict, sentence: str) -> None:
    with pytest.raises(Sd2Error, match=sentence):
        WaveOptions(**options)


def test_planes_that_make_no_sense_are_refused() -> None:
    with pytest.raises(Sd2Error, match=r"coefficient is 1\.5"):
        Mirror.wall(3.0, 1.5)
    with pytest.raises(Sd2Error, match="normal"):
        Mirror((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    with pytest.raises(Sd2Error, match="lies in the reflecting plane"):
        WaveScene(
            sheet(0.1, [[0, 0, 2.0]]),
            PAPER_RADAR,
            CAMERA,
            wave=WaveOptions(mirror=Mirror.wall(0.0)),
        )
