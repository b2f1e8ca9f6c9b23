"""Radars by name: their limits, and what a simulated radar of each shows of a known motion."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from moving_spheres import swinging_sphere

from sd2core.datasets.simulating import Simulation, simulated_map
from sd2core.errors import Sd2Error
from sd2core.fmcw import (
    LinkBudget,
    SignalOptions,
    WaveOptions,
    doppler_map,
    frame_spectra,
    limits,
    range_doppler,
    simulate_radar,
)
from sd2core.fmcw.chain import taper
from sd2core.fmcw.options import Motion
from sd2core.io.radar import load_capture, named_radar
from sd2core.io.radar.described import write_described
from sd2core.mesh.sequence import MeshSequence
from sd2core.options.records import option_named
from sd2core.options.shared import RadarChoice
from sd2core.radar_config import PAPER_RADAR, RadarConfig
from sd2core.radar_profiles import RADARS
from sd2core.sensor import VelocityAxis, VirtualSensor
from sd2core.timebase import Timebase

C_MPS = 299_792_458.0
SMOOTH = WaveOptions(motion="constant")
QUIET = SignalOptions(snr_db=float("inf"))


def plate(velocity_mps: float, range_m: float = 2.0, seconds: float = 0.7) -> MeshSequence:
    """A plate of 5 cm that faces the camera and approaches it."""
    times_s = np.arange(0.0, seconds, 1.0 / 60.0)
    corners = 0.025 * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float64)
    away_m = range_m - velocity_mps * (times_s - times_s.mean())
    vertices = corners + away_m[:, None, None] * np.array([0.0, 0.0, 1.0])
    faces = np.array([[0, 2, 1], [0, 3, 2]], np.int32)
    return MeshSequence(vertices.astype(np.float32), faces, Timebase(times_s))


def test_the_help_of_the_option_names_all() -> None:
    assert f"({', '.join(RADARS)}; " in option_named(RadarChoice, "radar").words


@pytest.mark.one_in(5)
@pytest.mark.parametrize("name", RADARS)
@pytest.mark.parametrize("velocity_mps", [0.9, -0.9])
def test_a_known_motion_is_shown_at_its_velocity(name: str, velocity_mps: float) -> None:
    config = RADARS[name]
    capture = simulate_radar(plate(velocity_mps), config, wave=SMOOTH, options=QUIET)
    doppler = doppler_map(capture)
    assert doppler.carrier_hz == pytest.approx(config.centre_frequency_hz)
    middle = capture.frame_count // 2
    off = abs(doppler.peak_velocity_mps()[middle] - velocity_mps)
    assert off <= 0.6 * config.velocity_resolution_mps
    if not config.is_continuous:
        found = range_doppler(capture, middle)
        at_m = found.range_m[found.range_profile.argmax()]
        assert abs(at_m - 2.0) <= config.range_resolution_m
    column = frame_spectra(
        plate(velocity_mps),
        config,
        [0.35],
        wave=SMOOTH,
        axis=VelocityAxis(config.chirps_per_frame, config.v_max_mps),
    )
    peak_mps = doppler.axis.centres_mps[column[:, 0].argmax()]
    assert abs(peak_mps - velocity_mps) <= 0.6 * config.velocity_resolution_mps


@pytest.mark.parametrize("name", RADARS)
def test_limits_follow_from_the_carrier_and_the_times(name: str) -> None:
    config = RADARS[name]
    carrier_hz = 0.5 * (config.start_frequency_hz + config.end_frequency_hz)
    told = limits(config)
    assert told["wavelength_m"] == pytest.approx(C_MPS / carrier_hz)
    assert told["v_max_mps"] == pytest.approx(C_MPS / carrier_hz / 4.0 / config.chirp_repetition_s)
    burst_s = config.chirps_per_frame * config.chirp_repetition_s
    assert told["velocity_resolution_mps"] == pytest.approx(C_MPS / carrier_hz / 2.0 / burst_s)
    assert ("range_max_m" in told) == (config.end_frequency_hz > config.start_frequency_hz)
    assert ("unverified" in config.name) == (name not in ("paper", "bgt60"))
    assert ("no range" in config.name) == config.is_continuous
    assert named_radar(name) == config


@pytest.mark.parametrize("name", ["bgt60", "k-band", "cw-5.8ghz"])
def test_data_sets_hold_maps_of_any_of_them(name: str) -> None:
    """A rough surface with gain and noise of a link budget, at the times of the mesh."""
    mesh = plate(0.9, range_m=1.0)
    axis = VelocityAxis(16, 3.0)
    doppler = simulated_map(mesh, VirtualSensor(), Simulation(RADARS[name]), axis)
    assert len(doppler.times_s) == len(mesh.times_s)
    middle = doppler.peak_velocity_mps()[len(mesh.times_s) // 2]
    width_mps = max(RADARS[name].velocity_resolution_mps, axis.bin_width_mps)
    assert abs(middle - 0.9) <= width_mps
    assert Simulation(RADARS[name]).as_json()["radar"]["name"] == RADARS[name].name


@pytest.mark.parametrize("name", ["k-band", "cw-5.8ghz", "wifi-2.4ghz"])
def test_what_speeds_up_within_a_frame_is_spread_over_its_velocities(name: str) -> None:
    """Variance of a windowed signal's frequency: that of its phase's slope, and the window's.

    L. Cohen, Time-Frequency Analysis, 1995, section 1.5.
    """
    config, rise_mps2 = RADARS[name], 8.0
    still = plate(0.0)
    away_m = -0.5 * rise_mps2 * (still.times_s - still.times_s.mean()) ** 2
    vertices = still.vertices[:] + away_m[:, None, None] * np.array([0.0, 0.0, 1.0])
    mesh = replace(still, vertices=vertices.astype(np.float32))
    axis = VelocityAxis(512, config.v_max_mps)
    column = frame_spectra(mesh, config, [still.times_s.mean()], wave=SMOOTH, axis=axis)[:, 0]
    share, velocity_mps = column / column.sum(), axis.centres_mps
    found = share @ velocity_mps**2 - (share @ velocity_mps) ** 2
    step_s = config.chirp_repetition_s
    window = taper("hann", config.chirps_per_frame).astype(np.float64)
    moment_s = (np.arange(len(window)) - 0.5 * (len(window) - 1)) * step_s
    spread = rise_mps2**2 * (window**2 @ moment_s**2) / (window**2).sum()
    slope = np.gradient(window, step_s) * config.wavelength_m / (4 * np.pi)
    assert found == pytest.approx(spread + (slope @ slope) / (window @ window), rel=0.15)


@pytest.mark.parametrize("name", RADARS)
def test_a_rough_ball_before_the_sensor_fits_into_the_converter(name: str) -> None:
    """With the link's one gain; what is clipped is distorted."""
    mesh, sensor = swinging_sphere(20), VirtualSensor((0.0, 0.0, 2.0))
    wave, link = WaveOptions(coherent=False), SignalOptions(link=LinkBudget())
    capture = simulate_radar(mesh, RADARS[name], sensor=sensor, wave=wave, options=link)
    assert capture.meta["simulation"]["clipped_share"] == 0.0
    assert np.abs(capture.read(0, 1)).max() > 0.01


@pytest.mark.parametrize("motion", ["constant", "interpolated"])
def test_frames_that_reach_beyond_a_mesh_go_straight_on(motion: Motion) -> None:
    """Their middles are within it: of a body that stood still there velocities would be torn."""
    whole, wave = plate(0.9), replace(SMOOTH, motion=motion)
    times_s = whole.times_s[[14, 26]]
    columns = [
        frame_spectra(mesh, RADARS["wifi-5ghz"], times_s, wave=wave)
        for mesh in (whole, whole.between(14, 27))
    ]
    np.testing.assert_allclose(columns[1], columns[0], rtol=0.01, atol=1e-3 * columns[0].max())


def test_a_name_that_is_none_is_refused_with_those_that_are() -> None:
    with pytest.raises(Sd2Error, match=r"There is no radar 'k-bend'.*k-band.*wifi-5ghz"):
        named_radar("k-bend")


def test_speckle_is_that_of_the_wavelength() -> None:
    """Two points whose echoes add up at one wavelength cancel at another."""
    wavelengths_m = [RADARS[name].wavelength_m for name in ("wifi-5ghz", "cw-5.8ghz")]
    apart_m = 0.25 * wavelengths_m[0]  # half a wavelength out and back: they cancel
    single = plate(0.0)
    far = single.vertices[:] + np.array([0.0, 0.0, apart_m], np.float32)
    both = MeshSequence(
        np.concatenate([single.vertices[:], far], axis=1),
        np.concatenate([single.faces, single.faces + 4]),
        single.timebase,
    )

    link = SignalOptions(link=LinkBudget(transmitted_dbm=90.0, full_scale=0.02))

    def amplitude(name: str, mesh: MeshSequence) -> float:
        capture = simulate_radar(mesh, RADARS[name], wave=SMOOTH, options=link)
        return float(np.abs(capture.read(0, 1)).mean())

    kept = [amplitude(n, both) / amplitude(n, single) for n in ("wifi-5ghz", "cw-5.8ghz")]
    expected = [
        abs(1.0 + (2.0 / (2.0 + apart_m)) ** 2 * np.exp(4j * np.pi * apart_m / one))
        for one in wavelengths_m
    ]
    assert kept == pytest.approx(expected, rel=0.05, abs=0.02)
    assert kept[0] < 0.1 < 0.25 < kept[1]


@pytest.mark.parametrize("snr_db", [0.0, 12.0])
def test_noise_of_complex_samples_is_that_of_both_parts(snr_db: float) -> None:
    config = replace(RADARS["cw-5.8ghz"], chirps_per_frame=512, chirp_repetition_s=1e-4)
    mesh = plate(0.9, seconds=2.0)
    options = SignalOptions(snr_db=snr_db, peak_share=0.1)
    clean = simulate_radar(mesh, config, options=replace(options, snr_db=float("inf")))
    noisy = simulate_radar(mesh, config, options=options)
    signal, both = clean.read(0, clean.frame_count), noisy.read(0, noisy.frame_count)
    noise = np.mean(np.abs(both - signal) ** 2)
    assert 10.0 * np.log10(np.mean(np.abs(signal) ** 2) / noise) == pytest.approx(snr_db, abs=0.2)


@pytest.mark.parametrize(
    "config", [RADARS["wifi-5ghz"], replace(PAPER_RADAR, sampling="complex with image band")]
)
def test_a_simulated_carrier_is_written_and_read_back(tmp_path: Path, config: RadarConfig) -> None:
    capture = simulate_radar(plate(0.9), config, options=QUIET)
    folder = write_described(
        tmp_path / "made",
        capture.samples[:],
        config,
        capture.timebase.times_s,
        simulated=True,
        meta=capture.meta,
    )
    again = load_capture(folder)
    assert again.simulated
    assert again.config == config
    as_stored = json.loads(json.dumps(capture.meta["simulation"]))
    assert again.meta["simulation"] == as_stored
    np.testing.assert_array_equal(again.read(0, 3), capture.read(0, 3))
    np.testing.assert_allclose(again.timebase.times_s, capture.timebase.times_s, atol=1e-9)


def test_what_is_not_simulated_is_refused() -> None:
    turns = replace(PAPER_RADAR, transmitters=2, chirps_per_frame=32)
    with pytest.raises(Sd2Error, match="has several transmitters, which is not simulated"):
        simulate_radar(plate(0.5), turns)


def test_a_plain_radar_is_described_as_before() -> None:
    """Campaigns and batches compare these entries with those of earlier versions."""
    assert set(PAPER_RADAR.as_dict()) == {
        "start_frequency_hz",
        "end_frequency_hz",
        "samples_per_chirp",
        "chirps_per_frame",
        "chirp_repetition_s",
        "frame_repetition_s",
        "sample_rate_hz",
        "receivers",
        "adc_bits",
        "name",
    }


@pytest.mark.parametrize(
    "changes",
    [
        {"sampling": "imaginary"},
        {"transmitters": 0},
        {"ranges_m": (1.0, 2.0)},
        {"sampling": "complex", "ranges_m": (1.0, 2.0)},
        {"end_frequency_hz": 59.875e9},
        {"end_frequency_hz": 59.875e9, "sampling": "complex"},
    ],
)
def test_a_radar_that_contradicts_itself_is_refused(changes: dict) -> None:
    with pytest.raises(Sd2Error):
        replace(PAPER_RADAR, **changes)
    assert isinstance(replace(PAPER_RADAR, sampling="complex"), RadarConfig)
