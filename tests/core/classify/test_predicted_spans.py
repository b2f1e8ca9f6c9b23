"""Spans of predicted gestures."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sd2core.classify.spans import predicted_spans
from sd2core.errors import Sd2Error
from sd2core.labels.field_edits import offer
from sd2core.labels.free_time import LabelledFrames
from sd2core.labels.spans import Labels
from sd2core.labels.suggest import TRACK
from sd2core.options.suggesting import PredictedSpans
from sd2core.timebase import Timebase

CLASSES = ("background", "horizontal", "vertical")
EXACT = PredictedSpans(min_duration_s=0.0, merge_gap_s=0.0)


def sure(labels: list[int], share: float = 0.8) -> np.ndarray:
    """The class of every frame with that probability."""
    values = np.full((len(labels), 3), (1 - share) / 2)
    values[np.arange(len(labels)), labels] = share
    return values


def found(labels: list[int], options: PredictedSpans | None = None, **more) -> list[tuple]:
    spans = predicted_spans(
        sure(labels), Timebase.regular(len(labels), 10.0), CLASSES, options, **more
    )
    return [(one.label, round(one.start_s, 6), round(one.end_s, 6)) for one in spans]


def test_runs_of_frames_are_spans_with_their_mean_probability() -> None:
    values = sure([0, 1, 1, 1, 0, 2, 2, 0])
    values[1:4, 1] = [0.5, 0.7, 0.9]
    spans = predicted_spans(values, Timebase.regular(8, 10.0), CLASSES, EXACT)
    assert [(one.id, one.label, one.start_s, one.end_s) for one in spans] == [
        (1, "horizontal", pytest.approx(0.1), pytest.approx(0.4)),
        (2, "vertical", pytest.approx(0.5), pytest.approx(0.7)),
    ]
    assert spans[0].confidence == pytest.approx(0.7)
    assert all(one.origin == "suggestion" and one.track == TRACK for one in spans)


def test_short_ones_are_left_out_and_short_gaps_do_not_part() -> None:
    labels = [0, 1, 0, 0, 0, 1, 1, 1, 0, 1, 1, 0, 0, 0, 2, 2, 2]
    assert found(labels) == [("horizontal", 0.5, 1.1), ("vertical", 1.4, 1.7)]
    assert len(found(labels, EXACT)) == 4


def test_a_blip_of_another_class_is_part_of_the_span() -> None:
    assert found([1, 1, 1, 2, 1, 1, 1]) == [("horizontal", 0.0, 0.7)]
    assert found([1, 1, 1, 2, 0, 1, 1, 1], PredictedSpans(min_duration_s=0.0, merge_gap_s=0.2)) == [
        ("horizontal", 0.0, 0.8)
    ]
    assert found([1, 1, 1, 2, 2, 1, 1]) == [
        ("horizontal", 0.0, 0.3),
        ("vertical", 0.3, 0.5),
        ("horizontal", 0.5, 0.7),
    ]


def test_no_span_reaches_across_absence_or_a_pause() -> None:
    present = np.ones(9, bool)
    present[4] = False
    assert found([1] * 9, present=present) == [("horizontal", 0.0, 0.4), ("horizontal", 0.5, 0.9)]
    times_s = np.array([0.0, 0.1, 0.2, 3.0, 3.1, 3.2])
    spans = predicted_spans(sure([1] * 6), Timebase(times_s), CLASSES)
    assert [one.end_s for one in spans] == [pytest.approx(0.3), pytest.approx(3.3)]


def test_unsure_spans_can_be_left_out() -> None:
    assert found([1] * 5, PredictedSpans(min_confidence=0.9)) == []
    assert len(found([1] * 5, PredictedSpans(min_confidence=0.8))) == 1


@given(
    labels=st.lists(st.integers(0, 2), min_size=1, max_size=60),
    gap_s=st.sampled_from([0.0, 0.1, 0.2, 0.5]),
    least_s=st.sampled_from([0.0, 0.1, 0.3]),
)
def test_spans_never_overlap_and_begin_and_end_with_their_class(
    labels: list[int], gap_s: float, least_s: float
) -> None:
    clock = Timebase.regular(len(labels), 10.0)
    spans = predicted_spans(
        sure(labels), clock, CLASSES, PredictedSpans(min_duration_s=least_s, merge_gap_s=gap_s)
    )
    for one, after in pairwise(spans):
        assert one.end_s <= after.start_s
    for one in spans:
        first, stop = clock.frames_between(one.start_s, one.end_s)
        assert CLASSES[labels[first]] == CLASSES[labels[stop - 1]] == one.label
        assert one.duration_s >= least_s - 1e-6
        assert 0.0 <= one.confidence <= 1.0


def test_they_are_offered_like_other_suggestions() -> None:
    clock = Timebase.regular(20, 10.0)
    spans = predicted_spans(sure([0] * 5 + [2] * 10 + [0] * 5), clock, CLASSES)
    edit = offer(LabelledFrames(Labels(), clock), spans)
    assert [one.label for one in edit.labels.of_track(TRACK)] == ["vertical"]


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: found([1], PredictedSpans(min_duration_s=-1.0)), "min_duration_s is -1"),
        (lambda: found([1], PredictedSpans(min_confidence=2.0)), "min_confidence is 2"),
        (
            lambda: predicted_spans(sure([0, 1]), Timebase.regular(3, 10.0), CLASSES),
            r"\(3 frames, 3 classes\)",
        ),
        (
            lambda: predicted_spans(np.full((2, 3), np.nan), Timebase.regular(2, 10.0), CLASSES),
            "negative or no numbers",
        ),
    ],
)
def test_what_makes_no_sense_is_refused(make, words: str) -> None:
    with pytest.raises(Sd2Error, match=words):
        make()
