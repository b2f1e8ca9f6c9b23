"""The label set as a table without a window."""

from __future__ import annotations

from dataclasses import replace

import pytest
from label_edits import label_edits, show_labels
from PySide6.QtTest import QAbstractItemModelTester

from sd2app.labels.label_set_model import (
    CLASS,
    COLOUR,
    KEY,
    NAME,
    SPANS,
    LabelSetModel,
)
from sd2app.settings import Settings
from sd2app.shell.keys.model import KeyBindings
from sd2core.labels.label_set import GESTURES
from sd2core.labels.spans import Labels, LabelTrack, Span
from sd2core.timebase import Timebase


class Named:
    id, menu, text, tip, keys = "next", "Labels", "Next span", "", ("N", "6")


class Edited:
    """A label set with two spans of "up-to-down"."""

    def __init__(self) -> None:
        edits = label_edits(Timebase.regular(100, 10.0))
        self.edits, self.labels, self.refused = edits, edits.labels, []
        edits.failed.connect(self.refused.append)
        keys = KeyBindings([Named()], self.labels, Settings.forgetful(), self.labels)
        self.model = LabelSetModel(edits, keys)
        show_labels(
            edits,
            Labels(
                (LabelTrack("Gestures"),),
                (
                    Span(1, "Gestures", 1.0, 2.0, "up-to-down"),
                    Span(2, "Gestures", 3.0, 4.0, "up-to-down"),
                ),
            ),
        )
        self.model.set_watched(True)

    def cell(self, row: int, column: int) -> str:
        return self.model.data(self.model.index(row, column))

    def type(self, row: int, column: int, text: str) -> bool:
        return self.model.setData(self.model.index(row, column), text)


@pytest.fixture
def edited() -> Edited:
    return Edited()


def test_what_the_rows_show(edited) -> None:
    row = [edited.cell(2, column) for column in (NAME, KEY, COLOUR, CLASS, SPANS)]
    assert row == ["up-to-down", "3", "vermilion", "vertical", "2"]
    assert edited.model.warnings == ""


def test_a_name_changes_with_the_spans_that_have_it(edited) -> None:
    assert edited.type(2, NAME, "  fall ")
    assert [span.label for span in edited.labels.labels.spans] == ["fall", "fall"]
    assert edited.cell(2, SPANS) == "2"
    assert not edited.type(2, NAME, "background")
    assert "share the name background" in edited.refused[0]
    assert edited.cell(2, NAME) == "fall"


@pytest.mark.parametrize(
    ("key", "words"),
    [
        ("n", "N belongs to “Next span” (Labels)"),
        ("1", "1 belongs to the label “left-to-right”"),
    ],
)
def test_a_key_that_somebody_has_is_refused_by_name(edited, key: str, words: str) -> None:
    assert not edited.type(2, KEY, key)
    assert words in edited.refused[0]
    assert edited.cell(2, KEY) == "3"


def test_keys_colours_and_classes_change(edited) -> None:
    assert edited.type(2, KEY, "Q")
    assert edited.type(2, COLOUR, "#332288")
    assert edited.type(2, CLASS, "")
    assert [edited.cell(2, column) for column in (KEY, COLOUR, CLASS)] == ["Q", "indigo", "–"]
    label = edited.labels.labels.label_set.find("up-to-down")
    assert (label.key, label.colour, label.gesture_class) == ("q", "#332288", "")
    assert edited.type(2, KEY, "")
    assert edited.cell(2, KEY) == ""


def test_colours_that_look_alike_are_said(edited) -> None:
    assert edited.type(1, COLOUR, "#0080c0")
    assert edited.cell(0, COLOUR) == "blue (alike)"
    assert edited.cell(1, COLOUR) == "#0080c0 (alike)"
    assert edited.model.warnings == "left-to-right and right-to-left look alike."
    offered = edited.model.choices_at(edited.model.index(0, COLOUR))
    assert "#0080c0" in [one.value for one in offered]


def test_a_new_label_takes_no_key_of_an_action(edited) -> None:
    assert edited.model.add()
    assert (edited.cell(5, NAME), edited.cell(5, KEY)) == ("label 1", "")  # 6 is an action's
    assert edited.model.warnings == ""


def test_labels_are_put_in_another_order_and_removed(edited) -> None:
    assert edited.model.move(2, -1)
    assert edited.cell(1, NAME) == "up-to-down"
    assert edited.model.remove(1)
    assert edited.labels.labels.spans[0].label == "up-to-down"
    show_labels(
        edited.edits, edited.labels.labels.with_spans([Span(3, "Gestures", 5, 6, "background")])
    )
    assert edited.model.remove(3, "down-to-up")
    assert edited.labels.labels.span(3).label == "down-to-up"


def test_the_set_has_a_name(edited) -> None:
    assert edited.model.use(replace(GESTURES, name="Mine"))
    assert edited.labels.labels.label_set.name == "Mine"
    assert edited.labels.labels.label_set.labels == GESTURES.labels


def test_under_qts_own_test_of_models(edited) -> None:
    mode = QAbstractItemModelTester.FailureReportingMode.Fatal
    tester = QAbstractItemModelTester(edited.model, mode)
    edited.model.add()
    edited.type(5, NAME, "wave")
    edited.model.move(5, -1)
    edited.model.remove(0)
    assert edited.model.rowCount() == 5
    tester.deleteLater()
