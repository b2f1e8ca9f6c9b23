"""Stretches of disagreement: exactly the frames that kappa counts as different."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from any_labels import any_labels
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sd2core.labels.agreement import disagreements, frame_agreement, kappa_words
from sd2core.labels.matching import iou_of, match_spans
from sd2core.labels.spans import Span
from sd2core.timebase import Timebase

FRAMES = Timebase.regular(100, 10.0)
edges_s = st.integers(0, 100).map(lambda frame: frame / 10)


def spans(*times: tuple[float, float, str]) -> list[Span]:
    return [Span(k, "Gestures", *one) for k, one in enumerate(times, start=1)]


def test_one_stretch_per_place_with_what_is_said_in_most_of_it() -> None:
    mine = spans((1.0, 2.0, "wave"), (4.0, 5.0, "push"))
    theirs = spans((1.1, 2.5, "swipe"), (4.0, 5.0, "push"), (9.9, 10.0, "wave"))
    found = disagreements(mine, theirs, FRAMES)
    assert [(one.start_s, one.end_s, one.frames, one.a, one.b) for one in found] == [
        (1.0, 2.5, 15, ("wave",), ("swipe",)),
        (pytest.approx(9.9), pytest.approx(10.0), 1, (), ("wave",)),
    ]
    assert disagreements(mine, mine, FRAMES) == ()
    assert disagreements([], [], FRAMES) == ()


@pytest.mark.slow
@settings(max_examples=60, suppress_health_check=[HealthCheck.too_slow])
@given(any_labels(edges_s), any_labels(edges_s))
def test_their_frames_are_those_that_differ(mine, theirs) -> None:
    found = disagreements(mine.spans, theirs.spans, FRAMES)
    overall = frame_agreement(mine.spans, theirs.spans, FRAMES).overall
    assert sum(one.frames for one in found) == round((1 - overall.observed) * overall.frames)
    assert all(one.end_s <= after.start_s for one, after in pairwise(found))


@pytest.mark.slow
@settings(max_examples=60, suppress_health_check=[HealthCheck.too_slow])
@given(any_labels(edges_s), any_labels(edges_s), st.sampled_from((0.1, 0.5, 1.0)))
def test_matching_in_groups_is_matching_at_once(mine, theirs, min_iou) -> None:
    from scipy.optimize import linear_sum_assignment

    found = match_spans(mine.spans, theirs.spans, FRAMES, min_iou=min_iou)
    iou = iou_of(mine.spans, theirs.spans)
    same = np.array([[x.label == y.label for y in theirs.spans] for x in mine.spans])
    same = same.reshape(iou.shape)
    allowed = iou >= min_iou - 1e-9
    above = min(iou.shape) + 1.0
    worth = np.where(allowed, above**2 + above * same + iou, 0.0)
    rows, columns = linear_sum_assignment(worth, maximize=True)
    reached = sum(above**2 + above * one.same_label + one.iou for one in found.matches)
    assert reached == pytest.approx(worth[rows, columns].sum())


@pytest.mark.slow
def test_ten_thousand_spans_of_each_are_matched() -> None:
    mine = spans(*((k, k + 0.5, "wave") for k in range(10_000)))
    theirs = spans(*((k + 0.1, k + 0.6, "wave") for k in range(10_000)))
    clock = Timebase.regular(10_001, 1.0)
    assert len(match_spans(mine, theirs, clock).matches) == 10_000


@pytest.mark.parametrize(
    ("kappa", "words"),
    [(-0.1, "less than by chance"), (0.0, "slight"), (0.55, "moderate"), (0.8, "almost perfect"),
     (1.0, "almost perfect")],
)  # fmt: skip
def test_what_a_kappa_is_called(kappa: float, words: str) -> None:
    assert kappa_words(kappa) == words
    assert "not defined" in kappa_words(None)
