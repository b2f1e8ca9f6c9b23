"""When what a key marks was seen."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from labelled import uneven

from sd2core.labels.free_time import LabelledFrames
from sd2core.labels.spans import Labels, LabelTrack, Span
from sd2core.timebase import Timebase

FRAMES = Timebase.regular(100, 10.0)
TRACKS = (LabelTrack("One"), LabelTrack("Many", "free"))
LABELS = Labels(
    TRACKS, tuple(Span(k, name, 2.0, 3.0, "x") for k, name in ((1, "One"), (2, "Many")))
)


@pytest.mark.parametrize(
    ("track", "now_s", "reaction_s", "seen_s"),
    [
        ("One", 5.0, 0.0, 5.0),
        ("One", 5.0, 0.25, 4.7),
        ("One", 0.1, 0.9, 0.0),
        ("One", 3.2, 0.5, 3.0),
        ("One", 3.0, 0.5, 3.0),
        ("Many", 3.2, 0.5, 2.7),
        ("One", 2.5, 0.2, 2.3),  # over a span: it is refused when it is made
    ],
)
def test_the_frame_that_was_on_screen(track, now_s, reaction_s, seen_s) -> None:
    assert LabelledFrames(LABELS, FRAMES).seen_at(track, now_s, reaction_s) == pytest.approx(seen_s)


@given(seed=st.integers(0, 99), frame=st.integers(0, 119), reaction_s=st.floats(0, 1))
def test_it_is_always_a_frame_that_was_on_screen_by_then(seed, frame, reaction_s) -> None:
    base = uneven(seed)
    end_s = (base.time_of(40) + base.time_of(41)) / 2
    labels = Labels(TRACKS, (Span(1, "One", base.start_s, end_s, "x"),))
    now_s = base.time_of(frame)
    seen_s = LabelledFrames(labels, base).seen_at("One", now_s, reaction_s)
    assert seen_s in base.times_s
    assert seen_s <= now_s
    if now_s >= end_s:
        assert seen_s >= end_s
        assert seen_s == base.time_of(max(base.frame_at(now_s - reaction_s), 41))
