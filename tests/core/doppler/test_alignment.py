"""Offsets of maps whose motion is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline

from sd2core.doppler.alignment import MIN_CONFIDENCE, align
from sd2core.errors import Sd2Error
from sd2core.maps import DopplerMap
from sd2core.sensor import VelocityAxis
from sd2core.timebase import Timebase

AXIS = VelocityAxis()
Motion = CubicSpline


def motion(seed: int) -> Motion:
    """Velocity in m/s at any time from −10 to 40 s, of nothing that repeats itself."""
    knots_s = np.arange(-10.0, 40.0, 0.4)
    return CubicSpline(knots_s, np.random.default_rng(seed).normal(0.0, 0.6, len(knots_s)))


def seen(velocity: Motion, times_s: np.ndarray, noise: float = 0.0, seed: int = 0) -> DopplerMap:
    """Ridge of a motion on a clock that begins at 0 s at the first of the times."""
    distance = AXIS.centres_mps[:, None] - velocity(times_s)[None].clip(-1.9, 1.9)
    values = np.exp(-((distance / 0.2) ** 2))
    values += noise * np.random.default_rng(seed).random(values.shape)
    return DopplerMap(values, AXIS, Timebase(times_s - times_s[0]), kind="real")


@settings(max_examples=25)
@given(
    st.integers(0, 1000),
    st.floats(-3.0, 3.0),
    st.sampled_from([10.0, 14.3, 30.0]),
    st.sampled_from([10.0, 30.0, 50.0]),
)
def test_a_known_offset_is_found(seed: int, offset_s: float, ours_hz: float, theirs_hz: float):
    velocity = motion(seed)
    video = seen(velocity, np.arange(0.0, 15.0, 1.0 / ours_hz))
    radar = seen(velocity, offset_s + np.arange(0.0, 15.0, 1.0 / theirs_hz), 0.1, seed)
    found = align(video, radar)
    assert found.problem == ""
    assert found.confidence >= MIN_CONFIDENCE
    # Well within a frame of the faster of the two.
    assert found.offset_s == pytest.approx(offset_s, abs=0.025)
    assert found.checked() is found
    # The curve has its peak there.
    assert abs(found.offsets_s[found.correlation.argmax()] - found.offset_s) < 1 / 30
    assert 0 < found.peak <= 1


@given(st.integers(0, 100), st.floats(-50.0, 50.0))
@settings(max_examples=10)
def test_clocks_that_both_move_change_nothing(seed: int, start_s: float):
    velocity, times_s = motion(seed), np.arange(0.0, 12.0, 0.05)
    ours, theirs = seen(velocity, times_s), seen(velocity, times_s + 0.7)
    found = align(ours.shifted(start_s), theirs.shifted(start_s))
    assert found.offset_s == pytest.approx(align(ours, theirs).offset_s, abs=2e-3)
    # Nor does it matter from where the search begins, as long as it is within reach.
    around = align(ours, theirs, around_s=2.0, within_s=4.0)
    assert around.offset_s == pytest.approx(0.7, abs=0.025)
    assert around.offsets_s[0] >= -2.0
    assert around.offsets_s[-1] <= 6.0


def test_a_radar_without_a_sign_is_aligned_by_how_fast_it_moves():
    velocity, times_s = motion(1), np.arange(0.0, 20.0, 0.05)
    radar = seen(velocity, times_s + 1.3)
    folded = radar.values + radar.values[::-1]
    folded[:16] = 0.0
    found = align(seen(velocity, times_s), replace(radar, values=folded))
    assert found.checked().offset_s == pytest.approx(1.3, abs=0.05)


def test_noise_between_movements_is_no_motion():
    times_s = np.arange(0.0, 20.0, 0.05)

    def gestures(times_s: np.ndarray) -> np.ndarray:
        return motion(5)(times_s) * (np.sin(1.3 * times_s) + np.sin(0.7 * times_s) > 0.6)

    ours, theirs = seen(gestures, times_s), seen(gestures, times_s - 0.8)
    # At rest the clutter filter leaves nothing of the body, and noise is in every bin.
    floor = np.random.default_rng(6).exponential(0.02, theirs.values.shape)
    still = np.abs(theirs.axis.centres_mps) < 0.15
    values = np.where(still[:, None], 0.0, theirs.values) + floor
    folded = values + values[::-1]
    folded[:16] = 0.0
    for received in (values, folded):
        found = align(ours, replace(theirs, values=received))
        assert found.checked().offset_s == pytest.approx(-0.8, abs=0.05)


def test_frames_without_an_echo_or_a_person_are_still():
    velocity, times_s = motion(2), np.arange(0.0, 20.0, 0.05)
    ours, theirs = seen(velocity, times_s), seen(velocity, times_s - 1.0)
    values = theirs.values.copy()
    values[:, ::7] = 0.0
    ours = replace(ours, present=times_s < 18.0)
    assert align(ours, replace(theirs, values=values)).checked().offset_s == pytest.approx(
        -1.0, abs=0.03
    )


def test_motion_that_repeats_itself_is_refused():
    times_s = np.arange(0.0, 20.0, 0.05)

    def swing(times_s: np.ndarray) -> np.ndarray:
        return np.sin(2 * np.pi * times_s / 1.6)

    found = align(seen(swing, times_s), seen(swing, times_s, noise=0.5))
    assert found.problem.startswith("No offset stands out")
    assert found.other_s is not None
    # A whole number of periods lies between the two.
    periods = (found.other_s - found.offset_s) / 1.6
    assert periods == pytest.approx(round(periods), abs=0.05)
    with pytest.raises(Sd2Error, match="one clear peak"):
        found.checked()


def test_short_maps_are_compared_at_offsets_that_are_too_far_to_be_chosen():
    times_s = np.arange(0.0, 4.0, 0.05)

    def swing(times_s: np.ndarray) -> np.ndarray:
        return np.sin(np.pi * times_s)

    # The true offset leaves an overlap of 1.9 s, and one of a period less looks as good.
    found = align(seen(swing, times_s), seen(swing, times_s + 2.1))
    assert "fit nearly alike" in found.problem
    right, taken = [], []
    for seed in range(20):
        ours = seen(motion(seed), times_s)
        own = align(ours, seen(motion(seed), times_s + 0.5, 0.1, seed))
        right.append(not own.problem and abs(own.offset_s - 0.5) < 0.1)
        taken.append(not align(ours, seen(motion(seed + 100), times_s)).problem)
    assert np.mean(right) >= 0.7
    assert np.mean(taken) <= 0.1


def test_maps_of_other_motions_are_mostly_refused():
    times_s = np.arange(0.0, 15.0, 0.05)
    refused = [
        bool(align(seen(motion(seed), times_s), seen(motion(seed + 100), times_s)).problem)
        for seed in range(20)
    ]
    assert np.mean(refused) >= 0.7


def test_an_offset_beyond_the_search_is_not_taken_for_one_within():
    velocity, times_s = motion(3), np.arange(0.0, 15.0, 0.05)
    # The peak is half a tenth of a second beyond what is searched.
    found = align(seen(velocity, times_s), seen(velocity, times_s + 2.05), within_s=2.0)
    assert found.end == "search"
    with pytest.raises(Sd2Error, match="Search farther"):
        found.checked()


def test_what_cannot_be_compared_is_explained():
    velocity, times_s = motion(4), np.arange(0.0, 15.0, 0.05)
    good = seen(velocity, times_s)
    still = replace(good, values=np.tile(good.values[:, :1], (1, len(times_s))))
    for radar, words in (
        (still, "Nothing moves in the radar's map"),
        (good.shifted(60.0), "do not overlap by 3 s"),
        (good.between(0, 30), r"do not overlap by 3 s.* Take longer recordings"),
        (good.between(0, 1), "Nothing moves in the radar's map"),
    ):
        with pytest.raises(Sd2Error, match=words):
            align(good, radar)
    with pytest.raises(Sd2Error, match="2 s or more"):
        align(good, good, within_s=1.9)
