"""Confusion, recall and latency by hand."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sd2core.classify.confusion_figure import confusion_figure
from sd2core.classify.metrics import (
    Score,
    confusion_of,
    gesture_runs,
    mean_recall,
    recalls,
    score,
    shares,
)
from sd2core.errors import Sd2Error

CLASSES = ("background", "horizontal", "vertical")


def test_a_confusion_matrix_by_hand() -> None:
    truth = np.array([0, 0, 0, 0, 1, 1, 2, -1])
    found = np.array([0, 0, 0, 2, 1, 0, 1, 2])
    counts = confusion_of(truth, found, 3)
    np.testing.assert_array_equal(counts, [[3, 0, 1], [1, 1, 0], [0, 1, 0]])
    np.testing.assert_allclose(recalls(counts), [0.75, 0.5, 0.0])
    assert mean_recall(counts) == pytest.approx(1.25 / 3)
    np.testing.assert_allclose(shares(counts)[0], [0.75, 0.0, 0.25])


def test_shares_stand_out_from_their_cells() -> None:
    figure = confusion_figure([np.array([[0.9, 0.1], [np.nan, 0.0]])], ["left", "right"], [""], "")
    words = {one.get_text(): one.get_color() for one in figure.axes[0].texts}
    assert words == {"90 %": "white", "10 %": "black", "–": "black", "0 %": "black"}


def test_a_class_that_does_not_occur_is_left_out() -> None:
    counts = confusion_of(np.array([0, 1]), np.array([0, 0]), 3)
    np.testing.assert_array_equal(recalls(counts), [1.0, 0.0, np.nan])
    assert mean_recall(counts) == 0.5
    assert np.isnan(mean_recall(np.zeros((3, 3), np.int64)))


@given(labels=st.lists(st.tuples(st.integers(-1, 2), st.integers(0, 2)), max_size=40))
def test_every_known_frame_is_counted_once(labels: list[tuple[int, int]]) -> None:
    truth = np.array([one for one, _ in labels], int)
    found = np.array([other for _, other in labels], int)
    counts = confusion_of(truth, found, 3)
    assert counts.sum() == (truth >= 0).sum()
    for number in range(3):
        assert counts[number].sum() == (truth == number).sum()
        assert counts[number, number] == ((truth == number) & (found == number)).sum()


def test_gestures_and_how_soon_they_are_recognised() -> None:
    """At 10 frames/s: one after its third frame, one never, one at once but mostly missed."""
    truth = np.array([0, 0, 1, 1, 1, 1, 0, 2, 2, 2, 0, 1, 1, 1])
    found = np.array([0, 1, 0, 0, 1, 1, 0, 1, 1, 0, 0, 1, 2, 2])
    told = score([truth], [found], CLASSES, 10.0, 0)
    # Two frames each of background and horizontal: the first counts.
    np.testing.assert_array_equal(told.gestures, [[0, 0, 0], [1, 0, 1], [0, 1, 0]])
    np.testing.assert_allclose(told.latencies_s, [0.3, 0.1])
    assert told.latency_s == pytest.approx(0.2)
    assert told.missed == 1
    assert told.frames.sum() == 14


def test_gestures_end_at_unknown_frames_and_clips() -> None:
    assert gesture_runs(np.array([1, 1, -1, 1, 2, 0]), 0) == [(0, 2, 1), (3, 4, 1), (4, 5, 2)]
    assert gesture_runs(np.array([], int), 0) == []
    assert gesture_runs(np.array([0, 1]), None) == [(0, 1, 0), (1, 2, 1)]


def test_a_score_comes_back_from_a_file_and_adds_up() -> None:
    one = score([np.array([0, 1, 1])], [np.array([0, 1, 0])], CLASSES, 30.0, 0)
    back = Score.from_json(one.to_json())
    np.testing.assert_array_equal(back.frames, one.frames)
    both = one + back
    np.testing.assert_array_equal(both.frames, 2 * one.frames)
    np.testing.assert_array_equal(both.gestures, 2 * one.gestures)
    assert len(both.latencies_s) == 2
    assert both.summary()["mean_recall_frames"] == one.mean_recall
    with pytest.raises(Sd2Error, match="other classes"):
        one + score([np.array([0])], [np.array([0])], ("a", "b"), 30.0, None)


def test_as_many_answers_as_frames() -> None:
    with pytest.raises(Sd2Error, match="2 answers for 3 frames"):
        confusion_of(np.zeros(3, int), np.zeros(2, int), 3)
