"""What a body, a clock and a place are judged to be."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sd2core.plausibility.clock import judge_clock, judge_rate, probable_unit
from sd2core.plausibility.mesh import BodyPoints, judge_motion, judge_place, judge_size

POSE = np.random.default_rng(0).uniform((-0.3, -0.9, -0.2), (0.3, 0.9, 0.2), (40, 3))


def seen(middle_m, rate=30.0, pose=POSE, there=None) -> BodyPoints:
    """A rigid body whose middle is at places (T, 3)."""
    points = np.asarray(middle_m)[:, None, :] + pose
    frames = np.arange(len(points))
    there = np.ones(len(points), bool) if there is None else there
    return BodyPoints(frames, points, frames / rate, there, np.ptp(points, axis=1))


def walk(frames=60, rate=30.0, speed_mps=1.4):
    return np.array([0, 0, 5.0]) - np.outer(np.arange(frames) / rate, (0, 0, speed_mps))


@given(st.floats(10, 240), st.floats(0, 10))
def test_whoever_runs_no_faster_than_people_is_left_alone(rate, speed_mps):
    beside = np.outer(np.arange(40) / rate, (speed_mps, 0, 0))
    body = seen(beside + np.array([0, 0, 4.0]), rate)
    assert judge_motion(body) == []
    assert judge_clock(body.times_s) == []
    assert judge_place(body) == []


@pytest.mark.parametrize("rate", [10.0, 30.0, 120.0])
def test_one_jump_is_named_with_its_frame_and_speed(rate):
    middle = walk(60, rate)
    middle[37:] += [3.0, 0, 0]
    (finding,) = judge_motion(seen(middle, rate))
    spacing = max(1, round(rate / 30)) / rate
    speed_mps = np.hypot(3.0 / spacing, 1.4)
    assert f"up to {speed_mps:,.0f} m/s" in finding.found
    assert "jumps: another person" in finding.remedy


def test_frames_of_another_person_between_are_told_from_a_wrong_rate():
    two = walk()
    two[1::2] += [1.5, 0, 0]
    (alternating,) = judge_motion(seen(two))
    assert "away and back: frames of another person" in alternating.remedy
    (fast,) = judge_motion(seen(walk(speed_mps=-14.0)))
    assert "--fps" in fast.remedy


def test_a_jump_below_any_running_speed_shows_as_a_change_of_velocity():
    middle = walk()
    middle[20:] += [0, 0.35, 0]
    (finding,) = judge_motion(seen(middle))
    assert "changes by 11 m/s within 0.0333 s (315 m/s²)" in finding.found


def test_a_jump_after_a_gap_is_named_with_its_own_frame():
    middle = walk()
    middle[45:] += [0, 0.35, 0]
    there = np.ones(60, bool)
    there[10:22] = False
    (finding,) = judge_motion(seen(middle, there=there))
    assert "at frame 44, and too fast 2 times in all" in finding.found


@pytest.mark.parametrize(("rate", "judged"), [(2.0, False), (8.0, True)])
def test_who_turns_between_two_frames_of_a_slow_clock_has_not_jumped(rate, judged):
    beside_m = 5.0 / rate * (np.arange(20) % 2)
    middle = np.array([0, 0, 5.0]) + beside_m[:, None] * [1.0, 0, 0]
    assert bool(judge_motion(seen(middle, rate))) is judged


def test_what_lies_between_stretches_is_no_jump():
    middle = walk()
    middle[30:] += [3.0, 0, 0]
    there = np.ones(60, bool)
    there[30] = False
    assert judge_motion(seen(middle, there=there)) == []


def test_vertices_in_another_order_are_parts_that_are_too_fast():
    body = seen(walk())
    body.points_m[30] = body.points_m[30][::-1]
    (finding,) = judge_motion(body)
    assert "The parts of the body" in finding.found
    assert "another order" in finding.remedy


@pytest.mark.parametrize(
    ("place", "pose", "value"),
    [
        ((0, 0, -3), POSE, "x180"),
        ((0, 0, 3), POSE[:, [0, 2, 1]], "x90"),
        ((0, 1.4, -0.2), (POSE - POSE.mean(axis=0))[:, [0, 2, 1]], "x90"),
        ((0, 0, 0.0), POSE - POSE.mean(axis=0) - [0, 0, 0.01], None),
    ],
)
def test_a_place_that_no_camera_sees_has_its_cure(place, pose, value):
    (finding,) = judge_place(seen(np.tile(place, (5, 1)).astype(float), pose=pose))
    assert (finding.cure and finding.cure.value) == value
    assert ("--distance-m" if value is None else f"--turn {value}") in str(finding)


def test_a_distance_by_a_guessed_focal_length_is_named():
    (finding,) = judge_place(seen(np.tile([0, 0, 37.0], (5, 1))))
    assert "37 m away" in finding.found
    assert "focal length" in finding.remedy


@given(st.floats(5, 200), st.sampled_from([1e-3, 1e-6, 1e-9]))
def test_the_unit_is_the_one_in_which_frames_have_a_usual_rate(rate, unit_s):
    named = {1e-3: "milliseconds", 1e-6: "microseconds", 1e-9: "nanoseconds"}
    step = 1 / rate / unit_s
    assert probable_unit(step) == (named[unit_s], unit_s)
    (finding,) = judge_rate(step, of_a_mesh=True)
    assert finding.cure.value == pytest.approx(rate, rel=1e-4)


def test_a_step_of_one_counts_frames_and_a_fraction_is_known():
    (counted,) = judge_rate(1.0, of_a_mesh=True)
    assert "count frames" in counted.remedy
    assert counted.cure is None
    (fraction,) = judge_rate(1 / 30_000, of_a_mesh=True)
    assert fraction.cure.value == pytest.approx(29.97)


def test_a_gap_is_named_unless_nobody_was_there():
    times_s = np.arange(40) / 20
    times_s[25:] += 1.5
    (finding,) = judge_clock(times_s)
    assert "1 gap in the times, the longest of 1.55 s after frame 24" in finding.found
    there = np.ones(40, bool)
    there[24] = False
    assert judge_clock(times_s, there) == []


def test_sizes_name_their_unit():
    assert judge_size(1.7) is None
    assert judge_size(1700.0).cure.value == 0.001
    assert judge_size(170.0).cure.value == 0.01
    for wrong_unit_m in (0.0017, 1.7 / 0.3048):  # feet
        assert "--scale" in judge_size(wrong_unit_m).remedy
