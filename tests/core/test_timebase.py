from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sd2core.errors import Sd2Error
from sd2core.timebase import Timebase, common_clock

steps = st.lists(st.floats(1e-3, 10.0), min_size=1, max_size=60)
starts = st.floats(-1e4, 1e4)


def timebase_of(start_s: float, steps_s: list[float]) -> Timebase:
    return Timebase(start_s + np.concatenate([[0.0], np.cumsum(steps_s)]))


@given(starts, steps)
def test_every_frame_is_on_screen_at_its_own_time(start_s, steps_s):
    timebase = timebase_of(start_s, steps_s)
    for frame in range(len(timebase)):
        time_s = timebase.time_of(frame)
        assert timebase.frame_at(time_s) == frame
        assert timebase.nearest_frame(time_s) == frame
        assert timebase.covers(time_s)


@given(starts, steps, st.floats(0.01, 0.99))
def test_a_frame_stays_until_the_next(start_s, steps_s, share):
    timebase = timebase_of(start_s, steps_s)
    for frame, step_s in enumerate(steps_s):
        between = timebase.time_of(frame) + share * step_s
        assert timebase.frame_at(between) == frame


@given(starts, steps)
def test_times_outside_hold_the_ends(start_s, steps_s):
    timebase = timebase_of(start_s, steps_s)
    assert timebase.frame_at(timebase.start_s - 5) == 0
    assert timebase.frame_at(timebase.end_s + 5) == len(timebase) - 1
    assert not timebase.covers(timebase.start_s - 0.5)
    assert not timebase.covers(timebase.end_s + 0.5)


@given(starts, steps, st.data())
def test_frames_between_are_those_on_screen(start_s, steps_s, data):
    timebase = timebase_of(start_s, steps_s)
    low, high = sorted(
        data.draw(st.floats(timebase.start_s - 1, timebase.end_s + 1)) for _ in range(2)
    )
    first, last = timebase.frames_between(low, high)
    ends = np.append(timebase.times_s[1:], timebase.end_s)
    clear = 1e-5
    for frame in range(len(timebase)):
        overlap = min(ends[frame], high) - max(timebase.times_s[frame], low)
        if overlap > clear:
            assert first <= frame < last
        elif overlap < -clear:
            assert not first <= frame < last


@given(starts, steps, st.floats(-100, 100))
def test_a_shift_moves_frames_with_time(start_s, steps_s, offset_s):
    timebase = timebase_of(start_s, steps_s)
    shifted = timebase.shifted(offset_s)
    for frame in range(len(timebase)):
        assert shifted.frame_at(timebase.time_of(frame) + offset_s) == frame


def test_a_regular_timebase_has_its_rate():
    timebase = Timebase.regular(450, 30.0)
    assert timebase.frames_per_s == pytest.approx(30.0)
    assert timebase.duration_s == pytest.approx(15.0)
    assert timebase.frame_at(124 / 30) == 124


@pytest.mark.parametrize("tick_s", [0.0156, 0.001])
def test_a_coarse_clock_keeps_the_rate(tick_s):
    true_s = np.arange(100) * (0.1 if tick_s > 0.01 else 1 / 285.7)
    times_s = np.round(true_s / tick_s) * tick_s
    times_s[60:] += 50 * tick_s  # a pause
    assert Timebase(times_s).frame_duration_s == pytest.approx(true_s[1], rel=0.01)


@pytest.mark.parametrize("jitter_s", [0.002, 0.005, 0.008])
def test_jitter_of_times_keeps_the_rate(jitter_s):
    """As of a radar or a camera whose frames are timed when the computer takes them."""
    off_s = np.random.default_rng(0).normal(0.0, jitter_s, 3000)
    times_s = np.sort(np.arange(3000) / 30 + off_s)
    assert Timebase(times_s).frames_per_s == pytest.approx(30.0, rel=0.01)


@given(starts, steps)
def test_every_frame_goes_from_edge_to_edge(start_s, steps_s):
    timebase = timebase_of(start_s, steps_s)
    ends_s = [*timebase.times_s[1:], timebase.end_s]
    assert timebase.edges_s[:-1].tolist() == timebase.times_s.tolist()
    assert timebase.edges_s[1:].tolist() == ends_s


def test_one_frame_has_a_duration():
    timebase = Timebase([2.0])
    assert timebase.duration_s == pytest.approx(1 / 30)
    assert timebase.frames_between(0, 10) == (0, 1)


@pytest.mark.parametrize(
    ("times", "words"),
    [
        ([], "shape (0,)"),
        ([0.0, np.nan], "frame 1 is nan"),
        ([0.0, 0.1, 0.1], "Frame 2 is at 0.100000 s, frame 1 at 0.100000 s"),
        ([[0.0, 1.0]], "shape (1, 2)"),
    ],
)
def test_impossible_times_are_explained(times, words):
    with pytest.raises(Sd2Error, match=r"Frame|frame") as caught:
        Timebase(times)
    assert words in str(caught.value)


def test_times_cannot_be_changed_behind_its_back():
    times = np.array([0.0, 1.0])
    timebase = Timebase(times)
    times[1] = -5
    assert timebase.times_s[1] == 1.0
    with pytest.raises(ValueError, match="read-only"):
        timebase.times_s[0] = 3


def test_a_time_a_rounding_early_is_that_of_its_frame() -> None:
    times = Timebase.regular(90, 30.0)
    early_s = times.times_s - 1e-10
    assert [times.frame_at(float(time_s)) for time_s in early_s] == list(range(90))


def clock(start_s, frames, rate=30.0):
    return Timebase.regular(frames, rate, start_s)


def test_parts_of_equal_length_keep_the_first_clock():
    first = clock(0.0, 90)
    np.testing.assert_array_equal(
        common_clock([first, clock(0.001, 90), clock(0.0, 30, 10.0)]).times_s, first.times_s
    )


def test_what_reaches_beyond_is_added():
    both = common_clock([clock(0.0, 30), clock(-0.5, 60)])
    assert both.start_s == -0.5
    assert abs(both.end_s - 1.5) < 0.02
    assert np.isin(clock(0.0, 30).times_s, both.times_s).all()


def test_a_part_far_away_is_left_out():
    assert common_clock([clock(0.0, 30), clock(-99_999.0, 30)]).duration_s < 1.1


@given(
    st.lists(
        st.tuples(st.floats(-2, 2), st.integers(1, 60), st.sampled_from([10.0, 25.0, 30.0])),
        min_size=1,
        max_size=4,
    )
)
def test_it_is_a_clock_and_holds_the_first(parts):
    clocks = [clock(*part) for part in parts]
    joined = common_clock(clocks)
    assert np.isin(clocks[0].times_s, joined.times_s).all()
    assert joined.start_s <= clocks[0].start_s
    assert joined.end_s >= clocks[0].end_s - clocks[0].frame_duration_s
    kept = [joined.frame_at(time_s) + joined.first_number for time_s in clocks[0].times_s]
    assert kept == list(range(len(clocks[0])))
