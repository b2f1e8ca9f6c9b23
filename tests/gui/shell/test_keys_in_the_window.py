"""Keys are changed in the dialog, and menus, tooltips and the keyboard follow at once."""

from __future__ import annotations

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QLabel, QLineEdit, QToolButton, QTreeWidget
from window_models import models_of

from sd2app.shell.keys.dialog import KeyCapture, KeysDialog
from sd2app.shell.keys.model import KeyList
from sd2app.shell.program import MOUSE
from sd2app.widgets.inputs import NumberBox

CONTROL, SHIFT = Qt.KeyboardModifier.ControlModifier, Qt.KeyboardModifier.ShiftModifier
NONE, LEFT = Qt.KeyboardModifier.NoModifier, Qt.MouseButton.LeftButton


@pytest.fixture
def dialog(window, qtbot):
    c = models_of(window)
    shown = KeysDialog(KeyList(c.keys, c.labels, MOUSE, c.label_edits.apply), window)
    qtbot.addWidget(shown)
    shown.show()
    shown.activateWindow()
    qtbot.waitUntil(shown.isActiveWindow, timeout=5000)
    return shown


def search(dialog, text: str) -> None:
    line = dialog.findChild(QLineEdit)
    line.clear()
    QTest.keyClicks(line, text)


def press(key, modifier=NONE) -> None:
    QTest.keyClick(QApplication.focusWidget(), key, modifier)
    QApplication.processEvents()


def click(dialog, text: str) -> None:
    button = next(one for one in dialog.findChildren(QToolButton) if one.text() == text)
    assert button.isEnabled()
    QTest.mouseClick(button, LEFT)


def button(dialog, text: str) -> QToolButton:
    return next(one for one in dialog.findChildren(QToolButton) if one.text() == text)


def said(dialog) -> str:
    return next(one.text() for one in dialog.findChildren(QLabel) if one.objectName() == "warning")


def capture(dialog) -> None:
    """Return in the list waits for a key."""
    dialog.findChild(QTreeWidget).setFocus()
    press(Qt.Key.Key_Return)
    assert isinstance(QApplication.focusWidget(), KeyCapture)


def test_another_key_does_it_at_once_and_the_usual_one_nothing(window, dialog, qtbot) -> None:
    c = models_of(window)
    search(dialog, "next span")
    capture(dialog)
    press(Qt.Key.Key_H)
    assert c.keys.keys_of("next_span") == ("H",)
    action = window.action("next_span")
    assert [one.toString() for one in action.shortcuts()] == ["H"]
    assert action.toolTip().endswith("(H)")
    dialog.close()
    window.activateWindow()
    qtbot.waitUntil(window.isActiveWindow, timeout=5000)
    qtbot.keyClick(window, Qt.Key.Key_N)
    assert not c.labels.selected
    qtbot.keyClick(window, Qt.Key.Key_H)
    assert [span.label for span in c.labels.selected] == ["there"]


def test_buttons_beside_a_timeline_say_the_new_key(window, dialog) -> None:
    search(dialog, "next frame")
    capture(dialog)
    press(Qt.Key.Key_Right, CONTROL | SHIFT)
    tips = [one.toolTip() for one in window.findChildren(QToolButton)]
    assert "One frame on (Ctrl+Shift+Right)" in tips


def test_a_key_that_is_taken_is_refused_by_name(window, dialog) -> None:
    search(dialog, "next span")
    for key, modifier, words in (
        (Qt.Key.Key_P, NONE, "P belongs to “Previous span” (Labels)"),
        (Qt.Key.Key_1, NONE, "1 belongs to the label “left-to-right”"),
        (Qt.Key.Key_Tab, NONE, "Tab goes from field to field"),
        (Qt.Key.Key_Return, NONE, "Return ends typing"),
    ):
        capture(dialog)
        press(key, modifier)
        assert words in said(dialog)
        assert models_of(window).keys.keys_of("next_span") == ("N",)
    capture(dialog)
    press(Qt.Key.Key_Escape)
    assert dialog.isVisible()
    assert models_of(window).keys.keys_of("next_span") == ("N",)


def test_a_shifted_sign_is_the_sign(window, dialog) -> None:
    search(dialog, "next span")
    capture(dialog)
    QTest.keyClick(QApplication.focusWidget(), Qt.Key.Key_Exclam, SHIFT)
    assert models_of(window).keys.keys_of("next_span") == ("!",)
    capture(dialog)
    press(Qt.Key.Key_H, SHIFT)
    assert models_of(window).keys.keys_of("next_span") == ("Shift+H",)


def test_keys_are_added_taken_away_and_given_back(window, dialog) -> None:
    keys = models_of(window).keys
    search(dialog, "split span")
    assert not button(dialog, "Reset").isEnabled()
    click(dialog, "Add")
    press(Qt.Key.Key_H)
    assert keys.keys_of("split_span") == ("/", "H")
    click(dialog, "Remove")
    assert keys.keys_of("split_span") == ()
    click(dialog, "Reset")
    assert keys.keys_of("split_span") == ("/",)
    click(dialog, "Remove")
    click(dialog, "Reset all")
    assert keys.keys_of("split_span") == ("/",)


def test_a_labels_key_is_changed_as_one_step(window, dialog) -> None:
    search(dialog, "left-to-right")
    capture(dialog)
    press(Qt.Key.Key_H)
    labels = models_of(window).labels
    assert labels.labels.label_set.find("left-to-right").key == "h"
    assert models_of(window).document.undo_stack.undoText() == "Change key of label"
    models_of(window).document.undo_stack.undo()
    assert labels.labels.label_set.find("left-to-right").key == "1"
    assert models_of(window).keys.owner("H") == ""


def test_what_the_mouse_does_is_listed_and_not_changed(dialog) -> None:
    search(dialog, MOUSE[0][1])
    assert dialog.findChild(QTreeWidget).topLevelItem(0).text(2) == MOUSE[0][0]
    assert not button(dialog, "Change").isEnabled()


def test_typing_in_a_number_box_fires_no_action(window, qtbot) -> None:
    """Whatever keys are chosen: letters, signs and arrows belong to the field."""
    c = models_of(window)
    c.keys.bind("dots", ["Up"])
    c.keys.bind("last_frame", [])
    c.keys.bind("show_trade", ["End"])
    window.activateWindow()
    qtbot.waitUntil(window.isActiveWindow, timeout=5000)
    window.side.bring_up("Sensor")
    box = next(one for one in window.findChildren(NumberBox) if one.isVisible())
    box.setFocus()
    before = c.playback.frame, c.labels.labels, c.playback.playing, c.display.as_dots
    for key in (Qt.Key.Key_1, Qt.Key.Key_D, Qt.Key.Key_Slash, Qt.Key.Key_Right, Qt.Key.Key_Space):
        QTest.keyClick(box, key)
    QTest.keyClick(box, Qt.Key.Key_Up)
    QTest.keyClick(box, Qt.Key.Key_End)
    assert (c.playback.frame, c.labels.labels, c.playback.playing, c.display.as_dots) == before
    assert window.side.shown == "Sensor"
    # Escape takes back what was typed, and what is being marked goes on.
    QTest.keyClick(window, Qt.Key.Key_1)
    assert c.labels.marks
    QTest.keyClick(box, Qt.Key.Key_Escape)
    assert c.labels.marks
    QTest.keyClick(window, Qt.Key.Key_Escape)
    assert not c.labels.marks


def test_what_is_waited_for_in_vain_leaves_nothing_behind(window, dialog, qtbot) -> None:
    """Neither on the row nor in the list, which would end the program with it."""
    rows = dialog.findChild(QTreeWidget)
    capture(dialog)
    press(Qt.Key.Key_Escape)
    assert QApplication.focusWidget() is rows
    capture(dialog)
    rows.setCurrentItem(rows.topLevelItem(3))
    qtbot.waitUntil(lambda: not dialog.findChildren(KeyCapture))
    search(dialog, "next span")
    capture(dialog)
    press(Qt.Key.Key_F9)
    assert "Side panel" in said(dialog)
    dialog.close()
    qtbot.waitUntil(lambda: not dialog.findChildren(KeyCapture))
