"""Suggestions found, decided on and found again; no window, real edits and history."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from label_edits import label_edits, show_labels

from sd2app.labels.dragging import LabelDragging
from sd2app.session.maps import MapModel
from sd2app.suggestions.model import MotionFinder, SearchResult, SuggestionsModel, Threshold
from sd2core.labels.spans import Labels, LabelTrack, Span
from sd2core.maps import DopplerMap
from sd2core.sensor import VelocityAxis
from sd2core.timebase import Timebase

RATE = 20.0


def moving(*loud: tuple[int, int, float]) -> DopplerMap:
    """Thirty seconds; from one frame to another so much over the quiet level."""
    values = np.ones((16, 600), np.float32)
    for start, stop, factor in loud:
        # In all bins but the two at zero velocity.
        values[np.delete(np.arange(16), (7, 8)), start:stop] = factor
    return DopplerMap(values, VelocityAxis(16, 2.0), Timebase.regular(600, RATE), "real")


class KnownSpans:
    """Finds two gestures and says which, as a classifier does."""

    title, threshold = "classifier", Threshold(0.0, 100.0, 50.0, 5.0, 0, " %", "")
    why_not, ready, signals = "", True, ()

    def __init__(self, source) -> None:
        self.sources, self.source = (source,), source

    def set_source(self, source) -> None:
        pass

    def wake(self) -> None:
        pass

    def look(self, threshold):
        spans = (
            Span(1, "Suggestions", 5.0, 6.0, "horizontal", confidence=0.9, origin="suggestion"),
            Span(2, "Suggestions", 8.0, 9.0, "up-to-down", confidence=0.6, origin="suggestion"),
        )
        named = tuple(span for span in spans if span.confidence >= threshold / 100)
        return SearchResult(named, "" if named else "Nothing that sure")


@pytest.fixture
def set_up(qtbot):
    edits = label_edits(Timebase.regular(600, RATE))
    labels, playback = edits.labels, edits.playback
    show_labels(
        edits, Labels((LabelTrack("Gestures"),), (Span(1, "Gestures", 20.0, 21.0, "up-to-down"),))
    )
    real = MapModel("Real")
    real.set_map(moving((100, 130, 100.0), (200, 230, 20.0), (300, 330, 100.0), (400, 420, 100.0)))
    finders = MotionFinder((MapModel("Synthetic"), real)), KnownSpans(real)
    model = SuggestionsModel(edits, finders, edits)

    def look(threshold_db: float | None = None) -> None:
        model.start() if threshold_db is None else model.set_threshold(threshold_db)

    return SimpleNamespace(
        model=model, labels=labels, playback=playback, real=real, edits=edits,
        stack=edits.undo_stack, look=look,
    )  # fmt: skip


def starts(spans) -> list[int]:
    return [round(span.start_s) for span in spans]


def test_what_moves_is_offered_but_for_what_is_marked(set_up) -> None:
    set_up.look()
    # The one at 20 s is marked already.
    assert starts(set_up.model.pending) == [5, 10, 15]
    assert set_up.model.text == "3 suggestions to decide on"
    assert starts(set_up.labels.selected) == [5]
    assert set_up.stack.undoText() == "Suggest 3 spans"
    set_up.stack.undo()
    assert not set_up.model.pending


def test_trying_thresholds_is_one_step(set_up) -> None:
    set_up.look()
    set_up.look(16.0)
    assert starts(set_up.model.pending) == [5, 15]
    assert set_up.stack.count() == 1
    set_up.look(35.0)
    assert set_up.model.text == "Nothing: the loudest frame has 19.4 dB"
    assert set_up.stack.index() == 0
    set_up.look(8.0)
    assert len(set_up.model.pending) == 3
    # Once something was decided, it is a step of its own.
    set_up.model.accept()
    set_up.look(16.0)
    assert [set_up.stack.text(k) for k in range(set_up.stack.count())] == [
        "Suggest 3 spans",
        "Accept suggestion",
        "Suggest 1 span",
    ]


def test_one_after_the_other(set_up) -> None:
    model, labels = set_up.model, set_up.labels
    labels.set_label("down-to-up")
    set_up.look()
    model.accept()
    assert starts(labels.selected) == [10]
    assert set_up.playback.time_s == pytest.approx(labels.selected[0].start_s)
    model.reject()
    model.accept("background")
    assert [(round(span.start_s), span.label, span.track) for span in labels.labels.spans] == [
        (5, "down-to-up", "Gestures"),
        (15, "background", "Gestures"),
        (20, "up-to-down", "Gestures"),
    ]
    assert [track.name for track in labels.labels.tracks] == ["Gestures"]
    for _ in range(3):
        set_up.stack.undo()
    assert starts(model.pending) == [5, 10, 15]


def test_what_was_rejected_does_not_come_again(set_up) -> None:
    model = set_up.model
    set_up.look()
    model.reject()
    set_up.look()
    assert starts(model.pending) == [10, 15]
    # Taking the rejection back is no rejection.
    model.reject()
    set_up.stack.undo()
    assert starts(model.pending) == [10, 15]
    set_up.look(7.0)
    assert starts(model.pending) == [10, 15]
    model.open(same=True)  # with other files
    set_up.look()
    assert starts(model.pending) == [10, 15]
    model.open()
    set_up.look()
    assert starts(model.pending) == [5, 10, 15]


def test_all_at_once(set_up) -> None:
    set_up.look()
    set_up.model.accept(whole=True)
    assert not set_up.model.pending
    assert len(set_up.labels.labels.of_track("Gestures")) == 4
    assert set_up.stack.undoText() == "Accept 3 suggestions"
    set_up.stack.undo()
    set_up.model.reject(whole=True)
    assert len(set_up.labels.labels.spans) == 1
    set_up.look()
    assert not set_up.model.pending
    assert set_up.model.text == "No suggestions left to decide on"


def test_a_map_that_is_being_computed_is_waited_for(set_up) -> None:
    model, real = set_up.model, set_up.real
    whole = real.map
    real.set_map(whole, np.arange(600) < 300)
    model.start()
    assert model.waiting
    assert model.text == "Waiting for the map: real"
    real.set_map(whole)
    assert len(model.pending) == 3


def test_what_a_hand_holds_is_a_step_before(set_up) -> None:
    hand = LabelDragging(set_up.edits)
    hand.begin_drag()
    hand.drag_new("Gestures", 1.0, 2.0, 0.0)
    set_up.look()
    texts = [set_up.stack.text(k) for k in range(set_up.stack.count())]
    assert texts == ["Create span", "Suggest 3 spans"]


def test_without_a_map_there_is_nothing_to_look_in(set_up) -> None:
    set_up.real.set_map(None)
    set_up.model.start()
    assert not set_up.model.active
    assert set_up.model.text == "There is no map to look in"


def test_nothing_says_that_there_is_no_map_once_there_is_one(set_up) -> None:
    model, real = set_up.model, set_up.real
    there = real.map
    real.set_map(None)
    offered = Span(5, "Gestures", 3.0, 4.0, "background", confidence=0.5, origin="suggestion")
    show_labels(set_up.edits, Labels((LabelTrack("Gestures"),), (offered,)))
    model.open()
    assert model.text == "1 suggestion to decide on"
    model.reject()
    assert (model.active, model.text) == (True, "There is no map to look in")
    told = []
    model.changed.connect(lambda: told.append(model.text))
    real.set_map(there)
    assert told == ["No suggestions left to decide on"]


def test_suggestions_of_a_file_are_to_be_decided_on_without_looking(set_up) -> None:
    offered = Span(5, "Gestures", 3.0, 4.0, "background", confidence=0.5, origin="suggestion")
    show_labels(set_up.edits, Labels((LabelTrack("Gestures"),), (offered,)))
    seen = []
    set_up.model.changed.connect(lambda: seen.append(set_up.model.active))
    set_up.model.open()
    assert seen[-1] is True
    assert set_up.model.text == "1 suggestion to decide on"
    set_up.model.accept()
    (taken,) = set_up.labels.labels.spans
    assert (taken.origin, taken.label) == ("person", "background")


def test_what_says_which_gesture_it_is_keeps_that_and_how_sure_it_is(set_up) -> None:
    model, labels = set_up.model, set_up.labels
    labels.set_label("down-to-up")
    model.start(model.finders[1])
    assert [(span.label, span.confidence) for span in model.pending] == [
        ("horizontal", 0.9),
        ("up-to-down", 0.6),
    ]
    assert model.accepted_as == ""  # nothing is left to say of them
    model.accept()
    # Corrected: a label's key takes it as that.
    model.accept("left-to-right")
    taken = [span for span in labels.labels.spans if span.confidence is not None]
    assert [(span.label, span.origin, span.confidence, span.track) for span in taken] == [
        ("horizontal", "person", 0.9, "Gestures"),
        ("left-to-right", "person", 0.6, "Gestures"),
    ]
    set_up.stack.undo()
    assert [span.label for span in model.pending] == ["up-to-down"]


def test_each_way_of_finding_has_its_own_threshold(set_up) -> None:
    model = set_up.model
    set_up.look()
    assert model.accepted_as == labels_in_use(set_up)
    model.set_finder(model.finders[1])
    assert starts(model.pending) == [5, 8]
    model.set_threshold(95.0)
    assert not model.pending
    assert model.text == "Nothing that sure"
    model.set_finder(model.finders[0])
    assert model.threshold == 7.0
    assert starts(model.pending) == [5, 10, 15]
    # Trying ways is one step, as trying thresholds is.
    assert set_up.stack.index() == 1


def labels_in_use(set_up) -> str:
    return set_up.labels.label
