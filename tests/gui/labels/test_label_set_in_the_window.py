"""The label set is edited by real keys and a real mouse; what counts is the model."""

from __future__ import annotations

import pytest
from finding import named
from PySide6.QtCore import Qt
from PySide6.QtGui import QColor
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QApplication,
    QColorDialog,
    QFileDialog,
    QLabel,
    QLineEdit,
    QToolButton,
)
from window_models import models_of

from sd2app.labels.label_set_model import COLOUR, KEY, NAME
from sd2app.labels.panel import LabelSetPage
from sd2app.widgets.table import ListedEditor
from sd2core.labels.label_set import GESTURES

CONTROL, NONE, LEFT = (
    Qt.KeyboardModifier.ControlModifier,
    Qt.KeyboardModifier.NoModifier,
    Qt.MouseButton.LeftButton,
)


@pytest.fixture
def page(window, qtbot) -> LabelSetPage:
    window.activateWindow()
    qtbot.waitUntil(window.isActiveWindow, timeout=5000)
    qtbot.keyClick(window, Qt.Key.Key_L, CONTROL)
    return window.findChild(LabelSetPage)


def press(key, modifier=NONE) -> None:
    QTest.keyClick(QApplication.focusWidget(), key, modifier)
    QApplication.processEvents()


def button(page, text: str) -> QToolButton:
    return next(one for one in page.findChildren(QToolButton) if one.text() == text)


def names(window) -> list[str]:
    return [label.name for label in models_of(window).labels.labels.label_set.labels]


def go(page, row: int, column: int) -> None:
    page.table.setCurrentIndex(page.table.model().index(row, column))
    page.table.setFocus()


def test_a_label_is_added_named_and_used_at_once(window, page, qtbot) -> None:
    c = models_of(window)
    QTest.mouseClick(button(page, "Add"), LEFT)
    line = QApplication.focusWidget()
    assert isinstance(line, QLineEdit)
    QTest.keyClicks(line, "wave")
    press(Qt.Key.Key_Return)
    assert names(window)[-1] == "wave"
    stack = c.document.undo_stack
    assert [stack.text(step) for step in range(stack.count())] == ["Add label", "Rename label"]
    # Its key marks.
    press(Qt.Key.Key_Escape)
    c.playback.seek_frame(25)
    qtbot.keyClick(window, Qt.Key.Key_6)
    assert [mark.label for mark in c.labels.marks] == ["wave"]
    c.labels.set_marks(())
    stack.undo()
    stack.undo()
    assert c.labels.labels.label_set == GESTURES


@pytest.mark.slow
def test_a_label_is_removed_by_key_and_no_span_is(window, page) -> None:
    c = models_of(window)
    c.labels.select([span.id for span in c.labels.labels.spans])
    go(page, 1, NAME)
    press(Qt.Key.Key_Delete)
    assert "right-to-left" not in names(window)
    assert len(c.labels.labels.spans) == 2


@pytest.mark.slow
def test_spans_of_a_removed_label_keep_it_or_get_another(window, page) -> None:
    c = models_of(window)
    ids = [span.id for span in c.labels.labels.spans]
    c.labels.select(ids)
    c.label_edits.relabel("up-to-down")
    menu = page.menu_to_remove(2)
    keep = menu.actions()[0]
    assert keep.text() == "The 2 spans keep the label, shown in grey"
    keep.trigger()
    assert "up-to-down" not in names(window)
    assert {span.label for span in c.labels.labels.spans} == {"up-to-down"}
    assert c.document.undo_stack.undoText() == "Remove label, 2 spans keep it"
    c.document.undo_stack.undo()
    menu = page.menu_to_remove(2)
    other = menu.actions()[1].menu().actions()[-1]
    assert other.text() == "background"
    other.trigger()
    assert {span.label for span in c.labels.labels.spans} == {"background"}


def test_a_colour_is_chosen_from_a_list_and_likeness_is_said(window, page) -> None:
    go(page, 0, COLOUR)
    press(Qt.Key.Key_Return)
    editor = QApplication.focusWidget()
    assert isinstance(editor, ListedEditor)
    press(Qt.Key.Key_Down)
    press(Qt.Key.Key_Return)
    label = models_of(window).labels.labels.label_set.labels[0]
    assert label.colour == "#56b4e9"
    warning = page.findChild(QLabel, "warning")
    assert warning.text() == "left-to-right and right-to-left look alike."
    assert warning.isVisible()


def test_any_other_colour_is_asked_for(window, page, qtbot, monkeypatch) -> None:
    monkeypatch.setattr(QColorDialog, "getColor", lambda *_: QColor("#123456"))
    go(page, 0, COLOUR)
    press(Qt.Key.Key_Return)
    press(Qt.Key.Key_End)
    press(Qt.Key.Key_Return)
    labels = models_of(window).labels
    qtbot.waitUntil(lambda: labels.labels.label_set.labels[0].colour == "#123456", timeout=5000)


def test_a_key_of_an_action_is_refused_in_the_cell(window, page) -> None:
    go(page, 0, KEY)
    press(Qt.Key.Key_Return)
    QTest.keyClicks(QApplication.focusWidget(), "n")
    press(Qt.Key.Key_Return)
    assert "N belongs to “Next span” (Labels)" in window.messages.text
    assert models_of(window).labels.labels.label_set == GESTURES


def test_order_and_name_of_the_set(window, page) -> None:
    go(page, 0, NAME)
    QTest.mouseClick(button(page, "Down"), LEFT)
    QTest.mouseClick(button(page, "Down"), LEFT)
    assert names(window)[:3] == ["right-to-left", "up-to-down", "left-to-right"]
    assert page.table.currentIndex().row() == 2
    name = named(page, "Name of the label set")
    name.setFocus()
    press(Qt.Key.Key_A, CONTROL)
    QTest.keyClicks(name, " Mine ")
    press(Qt.Key.Key_Return)
    assert models_of(window).labels.labels.label_set.name == "Mine"


def test_a_set_is_shared_as_a_file(window, page, tmp_path, monkeypatch) -> None:
    c = models_of(window)
    path = tmp_path / "set.json"
    files = {one.text(): one for one in button(page, "File").menu().actions()}
    monkeypatch.setattr(QFileDialog, "getSaveFileName", lambda *_: (str(path), ""))
    monkeypatch.setattr(QFileDialog, "getOpenFileName", lambda *_: (str(path), ""))
    go(page, 0, NAME)
    QTest.mouseClick(button(page, "Remove"), LEFT)
    shared = c.labels.labels.label_set
    files["Export label set…"].trigger()
    files["Usual label set"].trigger()
    assert c.labels.labels.label_set == GESTURES
    files["Import label set…"].trigger()
    assert c.labels.labels.label_set == shared
    assert c.document.undo_stack.undoText() == "Change label set"
    path.write_text("no", "utf-8")
    files["Import label set…"].trigger()
    assert "set.json cannot be read" in window.messages.text
    assert c.labels.labels.label_set == shared
