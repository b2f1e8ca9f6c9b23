"""Which frames a figure shows."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sd2core.errors import Sd2Error
from sd2core.figures.strip_source import frames_around, parse_frames, spread_frames


@pytest.mark.parametrize(
    ("text", "frames"),
    [
        ("7", [7]),
        ("0, 15,30", [0, 15, 30]),
        ("0:60:20", [0, 20, 40]),
        ("::40", [0, 40, 80]),
        ("97:", [97, 98, 99]),
        (":3", [0, 1, 2]),
        ("90:500:5", [90, 95]),
        ("5,0:4:2,5", [5, 0, 2, 5]),
    ],
)
def test_lists_and_ranges(text, frames) -> None:
    assert parse_frames(text, 100) == frames


@pytest.mark.parametrize("text", ["", "a", "1,,2", "-1", "1.5", "0:10:0", "9:9", "100", "1-5", "²"])
def test_what_is_no_list_is_refused(text) -> None:
    with pytest.raises(Sd2Error):
        parse_frames(text, 100)


@given(st.integers(1, 50), st.integers(1, 2000))
def test_spread_evenly_from_first_to_last(count, total) -> None:
    frames = spread_frames(count, total)
    assert len(frames) == min(count, total)
    assert frames[0] == 0
    assert count == 1 or frames[-1] == total - 1
    steps = [b - a for a, b in pairwise(frames)]
    assert not steps or max(steps) - min(steps) <= 1


@given(st.integers(0, 99), st.integers(1, 20), st.integers(1, 30))
def test_around_a_frame(frame, count, step) -> None:
    frames = frames_around(frame, count, step, 100)
    assert frame in frames
    assert all(0 <= k < 100 and (k - frame) % step == 0 for k in frames)
    assert len(frames) <= count
    if step * count <= min(frame, 99 - frame):
        assert len(frames) == count
