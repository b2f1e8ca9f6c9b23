"""The FMCW simulation at the extremes of wavelength, range, speed, and numbers of samples."""

from __future__ import annotations

import math
from dataclasses import replace
from decimal import Decimal, localcontext

import numpy as np
import pytest
from extreme_tables import DIGITS, PI, exact_mean_phasor, exact_phasor, exact_ranges
from facet_scatterers import mean_phasor
from facet_visibility import facet_visibility
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.fmcw.cutting import subdivided
from sd2core.fmcw.facet import facet_mean, unit_phasor
from sd2core.fmcw.kernels import facet_echoes
from sd2core.fmcw.options import SignalOptions
from sd2core.fmcw.processing import doppler_map
from sd2core.fmcw.simulation import simulate_radar
from sd2core.fmcw.sums import NUFFT_TOLERANCE, Echoes, direct, nufft
from sd2core.mesh.sequence import MeshSequence
from sd2core.radar_config import SPEED_OF_LIGHT_MPS, RadarConfig
from sd2core.scattering.beam_kernels import beam_tables
from sd2core.sensor import VirtualSensor
from sd2core.timebase import Timebase

DOUBLE = 2.0**-53
WAVELENGTHS_M = (1e-3, 5e-3, 1.0)
RANGES_M = (1e-3, 0.5, 300.0, 1e6)
EVEN = (1.0, 1.0, 1.0, *(0.0,) * 6)
"""Weights of 1, nothing turns and nothing is bent."""
FLAT = 1e-7
"""Spans below 1e-3 rad are taken as none, 1e-6 / 36; from there on rounding, some 10 units,
is divided by a span squared."""
SPEEDS_MPS = (1e-9, 0.1, 2.0, 300.0)
COUNTS = ((2, 2), (2, 1024), (1024, 2), (64, 32), (256, 1024))


def radar(wavelength_m: float, chirps: int = 64, samples: int = 32) -> RadarConfig:
    """A radar of this wavelength with 1 % bandwidth and a burst of 25 ms."""
    centre_hz = SPEED_OF_LIGHT_MPS / wavelength_m
    repetition_s = 25e-3 / chirps
    return RadarConfig(
        start_frequency_hz=0.995 * centre_hz,
        end_frequency_hz=1.005 * centre_hz,
        samples_per_chirp=samples,
        chirps_per_frame=chirps,
        chirp_repetition_s=repetition_s,
        frame_repetition_s=1.0 / 30.0,
        sample_rate_hz=2.0 * samples / repetition_s,
    )


@pytest.mark.parametrize("about_rad", [0.0, 1.0, 2e3 * math.pi, 2e9 * math.pi])
@pytest.mark.parametrize("span_rad", [0.0, 1e-12, 1e-6, 0.3, 0.999, 1.001, 7.0, 300.0, 1e6])
def test_mean_phasor_of_a_triangle(span_rad: float, about_rad: float) -> None:
    for share in (0.0, 1e-9, 0.3, 0.5, 1.0):
        corners = about_rad + span_rad * np.array([-0.5, share - 0.5, 0.5])
        truth = exact_mean_phasor(corners)
        # The mean of three phases is rounded: by half a unit of a phase of 1e9 turns,
        # 5e-7 rad. The rest are some 30 operations on numbers of about 1.
        tolerance = 32 * DOUBLE + 4 * DOUBLE * np.abs(corners).max()
        assert abs(mean_phasor(corners[None])[0] - truth) <= tolerance
        assert abs(facet_mean(*corners, *EVEN)[0] - truth) <= tolerance + FLAT


@given(st.floats(-1e10, 1e10) | st.floats(-2e5, 2e5) | st.floats(-10.0, 10.0))
@settings(max_examples=200, derandomize=True)
def test_a_phasor_of_any_phase(phase_rad: float) -> None:
    with localcontext() as context:
        context.prec = DIGITS
        cosine, sine = exact_phasor(Decimal(phase_rad) / (2 * PI))
    # As it says; up to 100,000 quarter turns by its own series, the C library's beyond.
    assert abs(unit_phasor(phase_rad) - complex(float(cosine), float(sine))) <= 3e-14


@given(
    st.lists(st.floats(-50.0, 50.0), min_size=3, max_size=3),
    st.sampled_from([1e-15, 1e-6, 1.0, 1e3]),
)
@settings(max_examples=100, derandomize=True)
def test_mean_phasor_of_any_triangle(corners: list[float], scale: float) -> None:
    phases = np.array(corners) * scale
    tolerance = 32 * DOUBLE + 4 * DOUBLE * np.abs(phases).max()
    truth = exact_mean_phasor(phases)
    assert abs(mean_phasor(phases[None])[0] - truth) <= tolerance
    assert abs(facet_mean(*phases, *EVEN)[0] - truth) <= tolerance + FLAT


@pytest.mark.parametrize("range_m", RANGES_M)
@pytest.mark.parametrize("wavelength_m", WAVELENGTHS_M)
def test_range_rate_and_phase_of_an_echo(wavelength_m: float, range_m: float) -> None:
    random = np.random.default_rng(3)
    centre = range_m * random.normal(size=(20, 3))
    centre *= range_m / np.linalg.norm(centre, axis=1, keepdims=True)
    # Facets an eighth of a wavelength wide, and no wider than a tenth of the range.
    across = min(0.125 * wavelength_m, 0.1 * range_m)
    corners = centre[:, None] + across * random.normal(size=(20, 3, 3))
    vertices = corners.reshape(-1, 3)
    faces = np.arange(60, dtype=np.int32).reshape(-1, 3)
    velocity = np.repeat(random.normal(size=(20, 3)), 3, axis=0)
    found = echoes_of(vertices, velocity, faces, wavelength_m)
    turned = echoes_of(vertices, velocity, faces[:, ::-1].copy(), wavelength_m)
    assert len(found.range_m) + len(turned.range_m) == 20
    index, range_found = found.index, found.range_m
    middles = vertices[faces[index]].mean(axis=1)
    truth = np.array([float(value) for value in exact_ranges(middles.T, np.zeros(3))])
    # Three sums and a root of numbers of the range's size.
    np.testing.assert_allclose(range_found, truth, rtol=8 * DOUBLE)
    rates = (velocity[faces[index, 0]] * middles).sum(axis=1) / truth
    np.testing.assert_allclose(found.rate_mps, rates, rtol=0, atol=32 * DOUBLE)
    for facet, amplitude in zip(index.tolist(), found.amplitude.tolist(), strict=True):
        corners = vertices[faces[facet]]
        expected = cut_echo(corners, wavelength_m)
        edge_m = np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1).max()
        bend = 4 * np.pi / wavelength_m * edge_m**2 / (2 * range_m)
        # 1 / R^3 as a plane: its second derivative, 12, over an edge. The bend to first
        # order here, and to none in a piece of a thousandth of it. Differences of ranges,
        # in radians, and rounding of the normal.
        tolerance = 12 / 8 * (edge_m / range_m) ** 2 + 0.5 * bend**2 + 1e-3 * bend + FLAT
        tolerance += 32 * DOUBLE * (1 + 4 * np.pi * range_m / wavelength_m)
        assert abs(amplitude / expected - 1) <= tolerance


class Found:
    """What ``facet_echoes`` finds, cut to its length."""

    def __init__(self, count: int) -> None:
        self.index = np.empty(count, np.int32)
        self.range_m, self.rate_mps = np.empty(count), np.empty(count)
        self.amplitude = np.empty((1, count), np.complex128)

    def cut(self, count: int) -> None:
        self.index, self.range_m = self.index[:count], self.range_m[:count]
        self.rate_mps, self.amplitude = self.rate_mps[:count], self.amplitude[0, :count]


def echoes_of(
    vertices: NDArray[np.float64],
    velocity: NDArray[np.float64],
    faces: NDArray[np.int32],
    wavelength_m: float,
) -> Found:
    antenna = np.vstack([np.zeros(3), np.eye(3)])
    plane = np.array([0.0, 0.0, 0.0, 1.0])
    found = Found(len(faces))
    everyone = np.ones(len(faces), np.bool_)
    number = facet_echoes(
        vertices, velocity, faces, everyone, antenna, antenna, plane, 4 * np.pi / wavelength_m,
        0.0, *beam_tables(None)[1:], True, 0.0, found.index, found.range_m, found.rate_mps,
        found.amplitude,
    )  # fmt: skip
    found.cut(number)
    return found


def cut_echo(corners: NDArray[np.float64], wavelength_m: float) -> complex:
    """Echo of a facet about its centre in 1024 pieces with a linear phase on each."""
    pieces = subdivided(corners[None], 5)
    normal = 0.5 * np.cross(corners[1] - corners[0], corners[2] - corners[0])
    middle_m = np.linalg.norm(corners.mean(axis=0))
    phase = 4 * np.pi / wavelength_m * (np.linalg.norm(pieces, axis=2) - middle_m)
    centre = pieces.mean(axis=1)
    weight = -(centre @ normal) / np.maximum(np.linalg.norm(centre, axis=1), 0.05) ** 3
    return complex((weight * mean_phasor(phase)).mean())


@pytest.mark.one_in(5)
@pytest.mark.parametrize("range_m", [0.5, 1e6])
@pytest.mark.parametrize("wavelength_m", WAVELENGTHS_M)
@pytest.mark.parametrize(("chirps", "samples"), COUNTS)
def test_sums_against_exact_phases(
    chirps: int, samples: int, wavelength_m: float, range_m: float
) -> None:
    config = radar(wavelength_m, chirps, samples)
    random = np.random.default_rng(chirps + samples)
    count = 5
    echoes = Echoes(
        range_m * random.uniform(0.5, 1.0, count),
        np.array([0.0, 1e-9, -2.0, 30.0, -300.0]),
        random.normal(size=count) + 1j * random.normal(size=count),
    )
    everything = float(np.abs(echoes.amplitude).sum())
    found = direct(echoes, config)
    still = Echoes(echoes.range_m, np.zeros(count), echoes.amplitude)
    # Turns of the range, of the motion over the burst and of the beat over a chirp, each
    # rounded a few times.
    turns = (
        2 * range_m / config.wavelength_m
        + 2 * 300 * 25e-3 / config.wavelength_m
        + samples * 2 / SPEED_OF_LIGHT_MPS * config.slope_hz_per_s / config.sample_rate_hz * range_m
    )
    tolerance = (64 * DOUBLE + 2 * np.pi * 8 * DOUBLE * turns) * everything
    # Turned from sample to sample by a phasor that is right to 3e-14.
    tolerance = 3 * tolerance + 3e-14 * samples * everything
    places = random.integers(0, [chirps, samples], (6, 2)).tolist()
    for m, n in [(0, 0), (chirps - 1, samples - 1), *places]:
        assert abs(found[m, n] - exact_sum(echoes, config, m, n)) <= tolerance
    # One transform is exact for what does not move.
    apart = np.abs(nufft(still, config) - direct(still, config)).max()
    assert apart <= 10 * NUFFT_TOLERANCE * everything + tolerance


def exact_sum(echoes: Echoes, config: RadarConfig, m: int, n: int) -> complex:
    total = 0j
    with localcontext() as context:
        context.prec = DIGITS
        light = Decimal(SPEED_OF_LIGHT_MPS)
        carrier = 2 / Decimal(config.wavelength_m)
        slope = 2 * Decimal(config.slope_hz_per_s) / light
        t_m = (m - Decimal(config.chirps_per_frame - 1) / 2) * Decimal(config.chirp_repetition_s)
        t_n = (n - Decimal(config.samples_per_chirp) / 2) / Decimal(config.sample_rate_hz)
        for range_m, rate, amplitude in zip(
            echoes.range_m.tolist(),
            echoes.rate_mps.tolist(),
            echoes.amplitude.tolist(),
            strict=True,
        ):
            place = Decimal(range_m) + Decimal(rate) * t_m
            turns = carrier * (place + Decimal(rate) * t_n) + slope * place * t_n
            cosine, sine = exact_phasor(turns)
            total += amplitude * complex(float(cosine), float(sine))
    return total


def plate(
    range_m: float, speed_mps: float, side_m: float, offset_m: float = 0.0
) -> tuple[MeshSequence, VirtualSensor]:
    """A small square that comes straight at the sensor, in frames of 1/30 s."""
    times = np.arange(9) / 30.0
    corners = 0.5 * side_m * np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    faces = np.array([[0, 2, 1], [0, 3, 2]], np.int32)
    depth = range_m - speed_mps * (times - times[4])
    vertices = corners + depth[:, None, None] * np.array([0.0, 0.0, 1.0]) + offset_m
    mesh = MeshSequence(vertices, faces, Timebase(times), "plate.npz")
    return mesh, VirtualSensor((offset_m, offset_m, offset_m))


@pytest.mark.one_in(5)
@pytest.mark.parametrize("offset_m", [0.0, 1e6])
@pytest.mark.parametrize("speed_mps", [-300.0, -2.0, 1e-9, 0.1, 30.0, 300.0])
@pytest.mark.parametrize("wavelength_m", WAVELENGTHS_M)
def test_velocity_comes_back_wrapped_by_modular_arithmetic(
    wavelength_m: float, speed_mps: float, offset_m: float
) -> None:
    # Gates of 20 m, so that nothing runs out of its gate within a burst.
    half_hz = 0.25 * SPEED_OF_LIGHT_MPS / 20.0
    centre_hz = SPEED_OF_LIGHT_MPS / wavelength_m
    config = replace(
        radar(wavelength_m),
        start_frequency_hz=centre_hz - half_hz,
        end_frequency_hz=centre_hz + half_hz,
    )
    mesh, sensor = plate(100.0, speed_mps, 0.25 * wavelength_m, offset_m)
    capture = simulate_radar(mesh, config, sensor=sensor, options=SignalOptions(math.inf))
    made = doppler_map(capture, window="hann")
    assert np.isfinite(made.values).all()
    v_max = config.v_max_mps
    # Samples are real: a beat frequency, here that of 100 m and of the speed itself,
    # beyond half the sample rate comes back as its mirror image, and so does the velocity.
    samples = config.samples_per_chirp
    beat_hz = config.slope_hz_per_s * 100.0 - centre_hz * speed_mps
    gate = 2 * beat_hz / SPEED_OF_LIGHT_MPS / config.sample_rate_hz * samples % samples
    seen_mps = speed_mps if gate < samples / 2 else -speed_mps
    expected = (seen_mps + v_max) % (2 * v_max) - v_max
    found = float(made.peak_velocity_mps()[4])
    # The centre of the strongest bin, which is as wide as the radar's resolution.
    apart = (found - expected + v_max) % (2 * v_max) - v_max
    assert abs(apart) <= 0.5001 * config.velocity_resolution_mps


@pytest.mark.slow
@pytest.mark.parametrize(("chirps", "samples"), [(2, 1024), (16, 8), (1024, 8), (1024, 1024)])
def test_few_and_many_chirps_and_samples(chirps: int, samples: int) -> None:
    # The range is the middle gate's, the speed a quarter of what wraps.
    centre_hz = SPEED_OF_LIGHT_MPS / 5e-3
    config = replace(
        radar(5e-3, chirps, samples),
        start_frequency_hz=centre_hz - 2.5e8,
        end_frequency_hz=centre_hz + 2.5e8,
    )
    speed = 0.25 * config.v_max_mps
    mesh, sensor = plate(0.5 * config.range_max_m, speed, 1.25e-3)
    capture = simulate_radar(mesh, config, sensor=sensor, options=SignalOptions(math.inf))
    made = doppler_map(capture)
    assert np.isfinite(made.values).all()
    # Of the middle of the strongest bin, as wide as the radar resolves.
    apart = float(made.peak_velocity_mps()[4]) - speed
    assert abs(apart) <= 0.5001 * config.velocity_resolution_mps


@pytest.mark.parametrize("place", [0.0, 1e-3, 0.05, 1.0, 1e6])
@pytest.mark.parametrize("coherent", [True, False])
def test_no_place_of_the_sensor_gives_what_is_not_a_number(place: float, coherent: bool) -> None:
    from sd2core.fmcw.options import WaveOptions
    from sd2core.fmcw.wave import WaveScene

    mesh, _ = plate(place, 0.0, 1.0)
    vertices = np.asarray(mesh.vertices)[4]
    for sensor_m in [(0.0, 0.0, 0.0), tuple(vertices[0].tolist()), (0.2, 0.1, 2 * place)]:
        scene = WaveScene(
            mesh,
            radar(5e-3),
            VirtualSensor(sensor_m),  # type: ignore[arg-type]
            wave=WaveOptions(coherent=coherent, beam_width_deg=60.0),
        )
        assert np.isfinite(scene.frame(float(mesh.times_s[4]))).all()


def test_one_chirp_or_one_sample_is_refused_in_words() -> None:
    with pytest.raises(Sd2Error, match=r"chirps_per_frame is 1.*2 or more"):
        radar(5e-3, chirps=1)
    with pytest.raises(Sd2Error, match=r"samples_per_chirp is 1.*2 or more"):
        radar(5e-3, samples=1)
    mesh, sensor = plate(2.0, 0.0, 0.1)
    few = simulate_radar(mesh, radar(5e-3, 2, 2), sensor=sensor)
    with pytest.raises(Sd2Error, match="No range gate is left"):
        doppler_map(few)


def breathing_balls() -> MeshSequence:
    """A ball before a larger one, in double precision, 2.5 m from the origin."""
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=2, radius=0.3)
    both = np.concatenate([ball.vertices, 0.5 * ball.vertices + [0.05, 0.02, -0.7]])
    faces = np.concatenate([ball.faces, ball.faces + len(ball.vertices)]).astype(np.int32)
    growth = 1 + 0.05 * np.sin(np.arange(5))
    vertices = both * growth[:, None, None] + [0.1, 0.05, 2.5]
    return MeshSequence(vertices, faces, Timebase.regular(5, 30.0), "balls.npz")


@pytest.mark.parametrize("offset_m", [1e3, 1e6])
def test_the_world_may_lie_anywhere(offset_m: float) -> None:
    here = breathing_balls()
    there = replace(here, vertices=np.asarray(here.vertices) + offset_m)
    far = VirtualSensor((offset_m, offset_m, offset_m))
    config = radar(5e-3)
    seen = facet_visibility(here, VirtualSensor())
    seen_there = facet_visibility(there, far)
    assert 0.2 < seen.mean() < 0.5
    # A facet seen within some degrees of edge-on may hide its own centre, which is rounded
    # to single precision as well; what it echoes hardly counts.
    corners = np.asarray(here.vertices)[:, here.faces]
    across = np.cross(corners[:, :, 1] - corners[:, :, 0], corners[:, :, 2] - corners[:, :, 0])
    centres = corners.mean(axis=2)
    projected = np.maximum(-(across * centres).sum(axis=2), 0) / np.linalg.norm(centres, axis=2)
    cosine = projected / np.linalg.norm(across, axis=2)
    assert (cosine[seen != seen_there] < 0.05).all()
    assert projected[seen != seen_there].sum() <= 1e-3 * projected[seen].sum()
    quiet = SignalOptions(math.inf)
    one = simulate_radar(here, config, visibility=seen, options=quiet)
    two = simulate_radar(there, config, sensor=far, visibility=seen, options=quiet)
    # Positions in double end at 1e-10 m here, 3e-7 rad of phase: half a count of 4,096
    # falls to the other side now and then, and no more.
    apart = np.abs(one.samples.astype(int) - two.samples.astype(int))
    assert apart.max() <= 1
    assert (apart > 0).mean() < 0.01
