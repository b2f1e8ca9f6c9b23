"""Frames without a person in the simulated radar signal."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from facet_signal import simulate_capture
from facet_visibility import facet_visibility
from test_wave import SILENT, sheet

from sd2core.errors import Sd2Error
from sd2core.fmcw.options import SignalOptions, WaveOptions
from sd2core.fmcw.processing import doppler_map
from sd2core.fmcw.reference import converged_frame
from sd2core.fmcw.scene import MeshScene
from sd2core.fmcw.simulation import simulate_radar
from sd2core.fmcw.spectra import frame_spectra
from sd2core.fmcw.wave import WaveScene
from sd2core.io.radar import load_capture
from sd2core.io.radar.infineon import write_capture
from sd2core.mesh.sequence import MeshSequence
from sd2core.radar_config import PAPER_RADAR
from sd2core.sensor import VirtualSensor
from sd2core.timebase import Timebase

FRAMES = 15
THERE = np.ones(FRAMES, bool)
THERE[5:9] = False
CONFIG = replace(PAPER_RADAR, frame_repetition_s=1.0 / 30.0)


@pytest.fixture(scope="module")
def whole() -> MeshSequence:
    times = np.arange(FRAMES) / 30.0
    z = 2.0 - 0.15 * np.sin(2 * np.pi * 2.0 * times)
    return sheet(0.05, np.stack([0 * z, 0 * z, z], axis=1), cells=2)


@pytest.fixture(scope="module")
def holed(whole: MeshSequence) -> MeshSequence:
    held = np.maximum.accumulate(np.where(THERE, np.arange(FRAMES), 0))
    return replace(whole, vertices=np.asarray(whole.vertices)[held], present=THERE)


@pytest.mark.one_in(2)
@pytest.mark.parametrize("motion", ["constant", "interpolated"])
def test_nobody_sends_nothing_back_and_the_others_what_they_did(
    whole: MeshSequence, holed: MeshSequence, motion: str
) -> None:
    wave = WaveOptions(motion=motion)  # type: ignore[arg-type]
    times = whole.times_s
    found = frame_spectra(holed, CONFIG, times, wave=wave)
    before = frame_spectra(whole, CONFIG, times, wave=wave)
    assert not found[:, ~THERE].any()
    inside = np.r_[1:3, 11:14]  # not at the borders, whose velocities are one-sided now
    assert before[:, inside].any()
    np.testing.assert_allclose(
        found[:, inside] / found[:, inside].max(),
        before[:, inside] / before[:, inside].max(),
        rtol=1e-4,
        atol=1e-9,
    )


def test_in_a_gap_of_the_times_there_is_nobody(whole: MeshSequence) -> None:
    later_s = whole.times_s + 1.0 * (np.arange(FRAMES) >= 8)
    scene = MeshScene(replace(whole, timebase=Timebase(later_s)), CONFIG, VirtualSensor())
    assert all(scene.is_present(time_s) for time_s in later_s.tolist())
    between_s = 0.5 * (later_s[7] + later_s[8])
    assert not scene.is_present(between_s)
    assert not frame_spectra(scene.mesh, CONFIG, np.array([between_s])).any()


@pytest.mark.parametrize("motion", ["constant", "interpolated"])
def test_at_the_border_of_a_gap_the_velocity_is_one_sided(holed: MeshSequence, motion: str) -> None:
    scene = MeshScene(holed, CONFIG, VirtualSensor())
    for frame, other in ((4, 3), (9, 10)):
        step = holed.frame(frame) - holed.frame(other)
        expected = step / (holed.times_s[frame] - holed.times_s[other])
        time_s = float(holed.times_s[frame])
        if motion == "constant":
            _, velocity = scene.moving(time_s)
        else:
            _, velocity = next(scene.between(np.array([time_s])))
        np.testing.assert_allclose(velocity, expected, atol=1e-9)


def test_between_a_frame_with_and_one_without_there_is_nobody(holed: MeshSequence) -> None:
    scene = WaveScene(holed, CONFIG, VirtualSensor())
    between = 0.5 * (holed.times_s[4] + holed.times_s[5])
    assert not scene.scene.is_present(float(between))
    assert not scene.frame(float(between)).any()
    assert scene.scene.is_present(float(between) - 1.0 / 30.0)
    assert not converged_frame(scene, float(between), most_cuts=1).signal.any()


def test_a_simulated_capture_says_where_nobody_was(holed: MeshSequence, tmp_path: Path) -> None:
    capture = simulate_radar(holed, CONFIG, options=SignalOptions(snr_db=20.0, seed=3))
    np.testing.assert_array_equal(capture.present, THERE)
    folder = write_capture(
        tmp_path / "capture",
        capture.samples,
        CONFIG,
        capture.timebase.times_s,
        simulated=True,
        meta=capture.meta,
    )
    read = load_capture(folder)
    doppler = doppler_map(read)
    np.testing.assert_array_equal(doppler.present, THERE)
    power = doppler.values.sum(axis=0)
    assert power[~THERE].max() < 0.2 * power[THERE].mean()  # noise is all there is
    assert "Without a person: 4 of 15 frames (0.13 s)" in doppler.meta["notes"][0]


def test_the_signal_to_noise_ratio_is_that_of_frames_with_a_person(
    whole: MeshSequence, holed: MeshSequence
) -> None:
    options = SignalOptions(snr_db=20.0, seed=3)
    noise = [
        simulate_radar(mesh, CONFIG, options=options).meta["simulation"]["noise_rms_counts"]
        for mesh in (whole, holed)
    ]
    assert noise[1] == pytest.approx(noise[0], rel=0.05)


def test_both_simulations_agree(holed: MeshSequence) -> None:
    plain = simulate_capture(holed, CONFIG, options=SILENT)
    np.testing.assert_array_equal(plain.present, THERE)
    middle = 2 ** (CONFIG.adc_bits - 1)
    assert (np.asarray(plain.samples[~THERE]) == middle).all()
    assert math.isfinite(plain.meta["simulation"]["counts_per_unit"])


def test_nobody_is_seen_by_facets(holed: MeshSequence) -> None:
    seen = facet_visibility(holed, VirtualSensor())
    assert seen[THERE].any(axis=1).all()
    assert not seen[~THERE].any()


@pytest.mark.parametrize("gaps", [[[3]], [[3, 99]], ["3-4"], [[4, 2]]])
def test_a_damaged_description_of_gaps_is_explained(
    holed: MeshSequence, gaps: list[object]
) -> None:
    capture = simulate_radar(holed, CONFIG)
    capture.meta["simulation"]["without_person"] = gaps
    with pytest.raises(Sd2Error, match="without_person"):
        doppler_map(capture)
