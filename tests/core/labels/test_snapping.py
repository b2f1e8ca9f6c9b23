"""A dragged time jumps to the nearest edge of a span nearby, otherwise to a frame."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st
from labelled import imported, uneven

from sd2core.labels.free_time import LabelledFrames
from sd2core.labels.spans import Labels, LabelTrack, Span
from sd2core.timebase import Timebase

FRAMES = Timebase.regular(100, 10.0)
LABELS = Labels(
    (LabelTrack("Gestures"), LabelTrack("Suggested")),
    (
        Span(1, "Gestures", 1.0, 2.0, "up"),
        Span(2, "Suggested", 1.96, 3.0, "up", origin="suggestion"),
    ),
)


def test_spans_attract_within_the_distance() -> None:
    assert LabelledFrames(LABELS, FRAMES).snap(2.2, 0.25) == 2.0
    assert LabelledFrames(LABELS, FRAMES).snap(2.2, 0.1) == FRAMES.times_s[22]
    assert LabelledFrames(LABELS, FRAMES).snap(2.9, 0.25) == 3.0
    assert LabelledFrames(LABELS, FRAMES).snap(1.961, 0.25) == 1.96


def test_spans_in_the_hand_do_not_attract() -> None:
    assert LabelledFrames(LABELS, FRAMES).snap(2.2, 0.25, ignore={1}) == 1.96
    assert LabelledFrames(LABELS, FRAMES).snap(2.2, 0.25, ignore={1, 2}) == FRAMES.times_s[22]


def test_on_a_tie_a_span_goes_before_a_suggestion() -> None:
    labels = Labels(
        (LabelTrack("Gestures"), LabelTrack("Suggested")),
        (
            Span(1, "Suggested", 1.0, 2.0, "up", origin="suggestion"),
            Span(2, "Gestures", 2.5, 3.0, "up"),
        ),
    )
    assert LabelledFrames(labels, FRAMES).snap(2.25, 0.25) == 2.5
    assert LabelledFrames(labels, FRAMES).snap(2.25, 0.25, ignore={2}) == 2.0
    both = labels.with_spans([Span(1, "Gestures", 1.0, 2.0, "up")])
    assert LabelledFrames(both, FRAMES).snap(2.25, 0.25) == 2.0, "the earlier one"


@given(st.integers(0, 99), st.floats(-3, 12), st.floats(0, 1))
def test_nothing_that_may_attract_is_nearer(seed: int, time_s: float, within_s: float) -> None:
    timebase = uneven(seed)
    labels = imported(timebase, seed)
    found = LabelledFrames(labels, timebase).snap(time_s, within_s)
    edges = [edge for span in labels.spans for edge in (span.start_s, span.end_s)]
    near = [edge for edge in edges if abs(edge - time_s) <= within_s]
    if near:
        assert found in near
        assert abs(found - time_s) == min(abs(edge - time_s) for edge in near)
    else:
        frames = [*timebase.times_s.tolist(), timebase.end_s]
        assert found in frames
        assert abs(found - time_s) == min(abs(edge - time_s) for edge in frames)
