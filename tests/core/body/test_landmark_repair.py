"""Mended motion against the motion that was spoilt."""

from __future__ import annotations

import tracemalloc
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from seen_people import somebody

from sd2core.body.landmark_repair import (
    bridge_gaps,
    find_jumps,
    find_spikes,
    repair_landmarks,
    replace_outliers,
    who_else,
)
from sd2core.body.raw_track import RawTrack, pixels_per_metre
from sd2core.body.roi import PLACES, Sightings
from sd2core.body.sides import swap_sides
from sd2core.body.track import LANDMARKS
from tools.motion_capture.catalogue import trials

PX_PER_M = 150.0
CENTRE_PX = np.array([320.0, 240.0])
WRIST = LANDMARKS.index("wrist.R")


def standing() -> NDArray[np.float64]:
    """A person who faces the camera, in metres from the hips; L is on the image's right."""
    heights = {"shoulder": -0.5, "elbow": -0.25, "hip": 0.0, "knee": 0.45, "ankle": 0.85}
    heights |= {"wrist": 0.0, "pinky": 0.07, "index": 0.08, "thumb": 0.05, "heel": 0.9}
    heights |= {"foot_index": 0.92}
    widths = {"shoulder": 0.18, "elbow": 0.25, "hip": 0.1, "knee": 0.12, "ankle": 0.12}
    widths |= {"wrist": 0.28, "pinky": 0.29, "index": 0.28, "thumb": 0.27, "heel": 0.12}
    widths |= {"foot_index": 0.14}
    points = np.zeros((33, 3))
    for number, name in enumerate(LANDMARKS):
        part, _, side = name.partition(".")
        sign = {"L": 1.0, "R": -1.0, "": 0.0}[side]
        points[number] = sign * widths.get(part, 0.05), heights.get(part, -0.7), 0.0
    return points


def minimum_jerk(phase: NDArray[np.float64]) -> NDArray[np.float64]:
    u = np.clip(phase, 0.0, 1.0)
    return u**3 * (10 - 15 * u + 6 * u**2)


def found_from(points_m: NDArray[np.float64], times_s: NDArray[np.float64]) -> RawTrack:
    """What a faultless model would find, (T, 33, 3)."""
    frames = len(times_s)
    return RawTrack(
        times_s=times_s,
        present=np.ones(frames, bool),
        bridged=np.zeros(frames, bool),
        image_px=(PX_PER_M * points_m[..., :2] + CENTRE_PX).astype(np.float32),
        depth_px=(PX_PER_M * points_m[..., 2]).astype(np.float32),
        world_m=points_m.astype(np.float32),
        visibility=np.ones((frames, 33), np.float32),
    )


def waving(times_s: NDArray[np.float64]) -> RawTrack:
    """The right arm swings by 0.3 m, 1.2 times a second; the whole person sways."""
    points = np.repeat(standing()[None], len(times_s), axis=0)
    swing = 0.3 * np.sin(2 * np.pi * 1.2 * times_s)
    for name, share in (("elbow.R", 0.5), ("wrist.R", 1.0), ("pinky.R", 1.1), ("index.R", 1.1)):
        points[:, LANDMARKS.index(name), 0] += share * swing
        points[:, LANDMARKS.index(name), 2] -= 0.5 * share * swing
    points[..., 0] += 0.05 * np.sin(2 * np.pi * 0.4 * times_s)[:, None]
    return found_from(points, times_s)


def repaired(found: RawTrack, max_gap_s: float) -> tuple[RawTrack, tuple[str, ...]]:
    """Everything mended, and the sentences about it."""
    return repair_landmarks(found, max_gap_s)


def same(one: RawTrack, two: RawTrack) -> bool:
    names = ("image_px", "depth_px", "world_m", "visibility", "present", "bridged")
    return all(np.array_equal(getattr(one, n), getattr(two, n), equal_nan=True) for n in names)


def at(frames: int, *numbers: int) -> NDArray[np.bool_]:
    chosen = np.zeros(frames, bool)
    chosen[list(numbers)] = True
    return chosen


class TestOutliers:
    @pytest.mark.parametrize("frames_per_s", [30.0, 60.0, 120.0])
    def test_a_fast_swipe_is_untouched(self, frames_per_s: float) -> None:
        """0.8 m in 0.25 s with minimum jerk, at every phase of the frames."""
        for shift in np.linspace(0.0, 1.0, 7) / frames_per_s:
            times = np.arange(round(1.5 * frames_per_s)) / frames_per_s
            path = np.zeros((len(times), 2))
            path[:, 0] = 0.8 * minimum_jerk((times - 0.5 - shift) / 0.25)
            path[:, 0] -= 0.8 * minimum_jerk((times - 0.9 - shift) / 0.25)
            assert not find_spikes(times, path).any()

    def test_a_fast_wave_is_untouched(self) -> None:
        """4 turns a second over 0.4 m: 126 m/s²."""
        times = np.arange(60) / 30.0
        path = np.stack([0.2 * np.sin(2 * np.pi * 4 * times), 0 * times], axis=1)
        assert not find_spikes(times, path).any()

    @pytest.mark.slow
    @settings(max_examples=8)
    @given(
        st.integers(2, 50),
        st.floats(0.3, 2.0),
        st.floats(0.0, 2 * np.pi),
        st.sampled_from([30.0, 60.0]),
    )
    def test_a_jump_of_one_frame_is_put_back(
        self, frame: int, size_m: float, direction: float, frames_per_s: float
    ) -> None:
        true = waving(np.arange(60) / frames_per_s)
        image = true.image_px.copy()
        jump = size_m * PX_PER_M * np.array([np.cos(direction), np.sin(direction)])
        image[frame, WRIST] += jump.astype(np.float32)
        spoilt = RawTrack(**{**vars(true), "image_px": image})
        mended, replaced = replace_outliers(spoilt)
        expected = np.zeros((60, 33), bool)
        expected[frame, WRIST] = True
        np.testing.assert_array_equal(replaced, expected)
        np.testing.assert_allclose(mended.image_px, true.image_px, atol=0.02 * PX_PER_M)

    @pytest.mark.parametrize("length", [2, 3])
    def test_a_jump_of_several_frames_is_put_back(self, length: int) -> None:
        times = np.arange(40) / 30.0
        path = np.stack([0.3 * times, 0.1 * times**2], axis=1)
        spoilt = path.copy()
        spoilt[20 : 20 + length] += [0.9, -0.7]
        np.testing.assert_array_equal(
            np.flatnonzero(find_spikes(times, spoilt)), range(20, 20 + length)
        )

    def test_two_jumps_with_a_good_frame_between(self) -> None:
        times = np.arange(40) / 30.0
        spoilt = np.stack([0.3 * times, 0.1 * times**2], axis=1)
        spoilt[[20, 22]] += [0.9, -0.7]
        np.testing.assert_array_equal(np.flatnonzero(find_spikes(times, spoilt)), [20, 22])

    def test_noise_is_no_outlier(self) -> None:
        noise = 0.03 * np.random.default_rng(1).standard_normal((600, 2))
        assert not find_spikes(np.arange(600) / 120.0, noise).any()

    def test_a_step_to_another_place_is_no_outlier(self) -> None:
        path = np.zeros((60, 2))
        path[30:, 0] = 0.9
        assert not find_spikes(np.arange(60) / 30.0, path).any()

    @pytest.mark.parametrize("frames", [1, 2, 3, 4])
    def test_few_frames(self, frames: int) -> None:
        true = somebody(1).part(0, frames)
        assert same(repaired(true, 0.5)[0], true)


class TestGaps:
    def lost(self, found: RawTrack, frames: NDArray[np.bool_]) -> RawTrack:
        arrays = {name: value.copy() for name, value in vars(found).items()}
        arrays["present"][frames] = False
        for name in ("image_px", "depth_px", "world_m"):
            arrays[name][frames] = np.nan
        arrays["visibility"][frames] = 0.0
        return RawTrack(**arrays)

    def test_a_steady_motion_is_continued_exactly(self) -> None:
        times = np.arange(60) / 30.0
        points = standing()[None] + 0.4 * times[:, None, None]
        true = found_from(points, times)
        mended = bridge_gaps(self.lost(true, at(60, *range(20, 30))), 0.5)
        np.testing.assert_allclose(mended.image_px, true.image_px, rtol=1e-5)
        np.testing.assert_allclose(mended.world_m, true.world_m, atol=1e-5)
        np.testing.assert_array_equal(np.flatnonzero(mended.bridged), range(20, 30))
        assert mended.present.all()
        assert (mended.visibility[20:30] < 0.5).all()

    @pytest.mark.parametrize(("frames_per_s", "longest"), [(10.0, 4), (30.0, 14), (120.0, 59)])
    def test_the_limit_is_a_time(self, frames_per_s: float, longest: int) -> None:
        true = waving(np.arange(400) / frames_per_s)
        for length, filled in ((longest, True), (longest + 1, False)):
            lost = self.lost(true, at(400, *range(100, 100 + length)))
            mended = bridge_gaps(lost, 0.5)
            assert mended.present.all() == filled
            if not filled:
                assert same(mended, lost)

    def test_other_gaps_change_nothing(self) -> None:
        """Of several gaps each is filled as if it were the only one."""
        true = waving(np.arange(120) / 30.0)
        gaps = [range(20, 25), range(28, 31), range(60, 90), range(100, 104)]
        together = bridge_gaps(self.lost(true, at(120, *(k for gap in gaps for k in gap))), 0.5)
        assert not together.present[60:90].any()
        alone = bridge_gaps(self.lost(true, at(120, *gaps[3])), 0.5)
        np.testing.assert_array_equal(together.image_px[100:104], alone.image_px[100:104])
        first = bridge_gaps(self.lost(true, at(120, *gaps[0], *gaps[1])), 0.5)
        np.testing.assert_array_equal(together.world_m[:60], first.world_m[:60])

    def test_both_ends_stay_empty(self) -> None:
        true = waving(np.arange(60) / 30.0)
        mended = bridge_gaps(self.lost(true, at(60, 0, 1, 58, 59)), 0.5)
        assert np.isnan(mended.image_px[[0, 1, 58, 59]]).all()
        assert not mended.present[[0, 1, 58, 59]].any()

    def test_nobody_at_all(self) -> None:
        empty = self.lost(waving(np.arange(20) / 30.0), np.ones(20, bool))
        mended, notes = repaired(empty, 0.5)
        assert same(mended, empty)
        assert notes == ("Left empty, without the person: 20 frames (0 to 19).",)


class TestJumps:
    @settings(max_examples=20, deadline=None)
    @given(
        rate_hz=st.sampled_from([10.0, 15.0, 25.0, 30.0, 60.0]),
        cut=st.integers(7, 22),
        aside_m=st.floats(0.3, 2.0),
    )
    def test_a_cut_is_left_empty_and_said(self, rate_hz: float, cut: int, aside_m: float) -> None:
        times = np.arange(30) / rate_hz
        found = waving(times)
        found.image_px[cut:, :, 0] += np.float32(PX_PER_M * aside_m)
        mended, notes = repaired(found, 0.5)
        assert np.flatnonzero(~mended.present).tolist() == [cut]
        assert not mended.bridged.any()
        assert f"the body jumps as after a cut in the video: 1 frame ({cut})." in notes[-1]

    @settings(max_examples=30, deadline=None)
    @given(
        rate_hz=st.sampled_from([10.0, 15.0, 30.0, 60.0]),
        far_m=st.floats(0.0, 3.0),
        duration_s=st.floats(0.3, 1.0),
        begin_s=st.floats(0.2, 1.0),
        noise_m=st.floats(0.0, 0.01),
    )
    def test_no_motion_of_a_body_is_one(
        self, rate_hz: float, far_m: float, duration_s: float, begin_s: float, noise_m: float
    ) -> None:
        times = np.arange(0.0, 2.5, 1.0 / rate_hz)
        points = np.repeat(standing()[None], len(times), axis=0)
        points[..., 0] += far_m * minimum_jerk((times - begin_s) / duration_s)[:, None]
        points += np.random.default_rng(1).normal(0.0, noise_m, points.shape)
        assert not find_jumps(found_from(points, times)).any()

    def test_nor_are_frames_that_stand_still_in_between(self) -> None:
        times = np.arange(0.0, 1.0, 1.0 / 120.0)
        found = waving(np.floor(15.0 * times) / 15.0)
        assert not find_jumps(replace(found, times_s=times)).any()

    def test_nor_is_a_limb_that_is_seen_elsewhere_at_once(self) -> None:
        found = waving(np.arange(30) / 30.0)
        arm = [LANDMARKS.index(f"{part}.R") for part in ("elbow", "wrist", "index", "pinky")]
        found.image_px[15:, arm] += np.float32(PX_PER_M * 0.4)
        assert not find_jumps(found).any()

    def test_of_long_clips_one_landmark_after_the_other_is_held(self) -> None:
        found = waving(np.arange(4000) / 30.0)
        tracemalloc.start()
        find_jumps(found)
        _, most = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        assert most < 5 * found.visibility.size * 8


def test_what_was_done_is_said() -> None:
    true = somebody(1)
    spoilt = swap_sides(true, "the arms", at(90, 40, 41))
    spoilt.image_px[60, WRIST] += 100.0
    spoilt = TestGaps().lost(spoilt, at(90, 70, 71, 72))
    mended, notes = repaired(spoilt, 0.5)
    assert notes == (
        "Left and right of the arms swapped back in 2 frames (40 to 41).",
        "Replaced from the frames around them: 1 outlying landmark in 1 frame.",
        "Interpolated, in gaps of up to 0.5 s without the person: 3 frames.",
    )
    np.testing.assert_allclose(mended.image_px, true.image_px, atol=5.0)


def test_who_else_was_seen_is_said() -> None:
    frames = np.arange(0, 80, 2)
    others = np.zeros((40, len(PLACES)), bool)
    others[:10, 0] = True
    others[20:23, 1] = True  # too short
    others[20:30, 3] = True

    def said(others: NDArray[np.bool_]) -> tuple[str, ...]:
        nowhere, nothing = np.full((40, 4), np.nan), np.zeros(40)
        seen = Sightings(frames, nowhere, nothing, np.zeros(40, bool), others)
        return who_else(seen, np.arange(80) / 20.0)

    assert said(others) == (
        "Others were seen: left of the person from 0.0 to 0.9 s; like the person from 2.0 to 2.9 s."
        " If it is the person, fit them too: --person-box X,Y,WIDTH,HEIGHT --person-frame 50",
    )
    assert said(np.zeros_like(others)) == ()


def test_pixels_of_a_metre() -> None:
    found = waving(np.arange(10) / 30.0)
    np.testing.assert_allclose(pixels_per_metre(found), PX_PER_M, rtol=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("step", [1, 2, 3])
def test_motion_capture_jumps_where_it_is_broken_alone(shared_data: Path, step: int) -> None:
    broken = set()
    for trial in trials(shared_data / "motion"):
        if trial.episode is not None:
            continue
        points_m, rate_hz = trial.points()
        points_m = points_m[::step, np.arange(33) % points_m.shape[1]]
        found = found_from(points_m, np.arange(len(points_m)) * step / rate_hz)
        if find_jumps(found).any():
            broken.add(trial.name)
    assert broken <= {"01_07", "03_02", "09_10"}
