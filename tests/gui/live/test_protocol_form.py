"""The form of a protocol, by real keys and clicks; asserted on the draft and on the file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from answering import answer, once_asked
from finding import words_in
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QApplication,
    QDialogButtonBox,
    QFileDialog,
    QLineEdit,
    QPlainTextEdit,
    QToolButton,
    QWidget,
)

from sd2app.live.dialog import ListenDialog
from sd2app.live.process import ListenSetup
from sd2app.live.protocol_dialog import ProtocolDialog, ProtocolDraft
from sd2app.settings import Settings
from sd2app.widgets.inputs import Choice, NumberBox, TypedLine
from sd2app.widgets.table import CellTable
from sd2core.live.protocol import PAPER, Gesture, read_protocol

LEFT = Qt.MouseButton.LeftButton


@pytest.fixture
def dialog(parent) -> ProtocolDialog:
    made = ProtocolDialog(ProtocolDraft(PAPER, parent), parent)
    made.show()
    return made


def _click(dialog: QWidget, text: str) -> None:
    own = [*dialog.findChildren(QToolButton), *dialog.findChild(QDialogButtonBox).buttons()]
    (button,) = (one for one in own if one.text() == text and one.isVisible())
    QTest.mouseClick(button, LEFT)


def _type(widget: QWidget, text: str) -> None:
    """Type in place of what is there."""
    widget.setFocus()
    QTest.keyClick(widget, Qt.Key.Key_A, Qt.KeyboardModifier.ControlModifier)
    QTest.keyClicks(widget, text)


def _write(table: CellTable, text: str) -> None:
    """Type into the cell that is edited, and take it."""
    (editor,) = (one for one in table.findChildren(QLineEdit) if one.isVisible())
    _type(editor, text)
    QTest.keyClick(editor, Qt.Key.Key_Return)
    QApplication.processEvents()  # it is taken a moment later


def _closing_on_failure(dialog: ProtocolDialog, work: Callable[[ProtocolDialog], None]) -> None:
    try:
        work(dialog)
    except BaseException:
        dialog.done(0)
        raise


def _named(dialog: ProtocolDialog, kind: type[QWidget], words: str) -> QWidget:
    (found,) = (one for one in dialog.findChildren(kind) if words in one.accessibleName())
    return found


def test_a_protocol_is_made_out_of_the_papers(parent, qtbot, monkeypatch, tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    monkeypatch.setattr(QFileDialog, "getSaveFileName", lambda *_: (str(tmp_path / "mine"), ""))
    setup = ListenSetup(Settings.forgetful(), parent)
    record = ListenDialog(setup, parent)
    record.show()

    def fill(dialog: ProtocolDialog) -> None:
        _type(_named(dialog, TypedLine, "Title"), "Waves")
        _type(_named(dialog, TypedLine, "People"), "anna, ben,")
        table = dialog.findChild(CellTable)
        for _ in range(4):
            table.setCurrentIndex(table.model().index(0, 0))
            _click(dialog, "Remove")
        for name, instruction in (("wave", "Wave with one hand"), ("clap", "Clap")):
            _click(dialog, "Add")
            _write(table, name)  # its name is edited at once
            place = table.visualRect(table.model().index(table.currentIndex().row(), 1)).center()
            for click in (QTest.mouseClick, QTest.mouseDClick):
                click(table.viewport(), LEFT, pos=place)
            _write(table, instruction)
        _click(dialog, "Up")
        for words, number in (("Rounds", "2"), ("made for", "4"), ("between two", "1.5")):
            box = _named(dialog, NumberBox, words)
            _type(box.lineEdit(), number)
            QTest.keyClick(box, Qt.Key.Key_Return)
        choice = _named(dialog, Choice, "Of the gestures in a round")
        choice.setFocus()
        QTest.keyClick(choice, Qt.Key.Key_Up)
        assert not _named(dialog, NumberBox, "random order").isEnabled()
        _type(dialog.findChild(QPlainTextEdit), "You are filmed.")
        assert words_in(dialog, "warning") == []
        assert any(one.startswith("8 takes, about 1 minute ") for one in words_in(dialog, "muted"))
        _click(dialog, "Save…")

    once_asked(ProtocolDialog, lambda dialog: _closing_on_failure(dialog, fill))
    _click(record, "Edit…")
    assert setup.chosen.protocol == str(file)
    made = read_protocol(file)
    assert (made.title, made.people, made.consent) == ("Waves", ("anna", "ben"), "You are filmed.")
    assert (made.repetitions, made.take_s, made.pause_s, made.order) == (2, 4.0, 1.5, "fixed")
    assert made.gestures == (
        Gesture(name="clap", instruction="Clap"),
        Gesture(name="wave", instruction="Wave with one hand"),
    )
    assert made.countdown_s == read_protocol(PAPER).countdown_s  # was not touched


@pytest.mark.parametrize(
    ("line", "typed", "words"),
    [
        ("People", "anna, a/b", "Person 2 is 'a/b' (up to 40 letters, digits, - and _)."),
        ("People", "", "People is []"),
        ("People", "anna Anna", "wo recordings would be called anna-"),
        ("Title", " ", "Title is ''"),
    ],
)
def test_what_cannot_be_saved_is_said(dialog, line: str, typed: str, words: str) -> None:
    (save,) = (one for one in dialog.findChild(QDialogButtonBox).buttons() if one.text() == "Save…")
    assert save.isEnabled()
    field = _named(dialog, TypedLine, line)
    _type(field, typed)
    if not typed:
        QTest.keyClick(field, Qt.Key.Key_Delete)
    assert words in words_in(dialog, "warning")[0]
    assert not save.isEnabled()


def test_a_gesture_without_an_instruction_is_named_by_its_row(dialog) -> None:
    _click(dialog, "Add")
    _write(dialog.findChild(CellTable), "wave")
    problem = "Gesture 5: instruction is '' (a text that is not blank)."
    assert words_in(dialog, "warning") == [problem]
    _click(dialog, "Remove")
    assert words_in(dialog, "warning") == []


def test_changes_are_not_lost_without_a_question(dialog, qtbot, tmp_path: Path) -> None:
    asked: list[str] = []
    _type(_named(dialog, TypedLine, "Title"), "Waves")
    answer(qtbot, "Cancel", asked)
    QTest.keyClick(dialog.findChild(QPlainTextEdit), Qt.Key.Key_Escape)
    assert asked
    assert dialog.isVisible()
    answer(qtbot, "Discard", asked)
    _click(dialog, "The paper's")
    assert _named(dialog, TypedLine, "Title").text() == read_protocol(PAPER).title
    _click(dialog, "Cancel")
    assert len(asked) == 2  # nothing to lose
    assert not dialog.isVisible()
