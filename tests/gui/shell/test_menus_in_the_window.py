"""All menus of the window: short, and every entry with a letter of its own."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtGui import QKeySequence
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication
from window_models import models_of

from sd2app.shell.menus import menus_in

ALT, LEFT = Qt.KeyboardModifier.AltModifier, Qt.MouseButton.LeftButton
LETTERS = 26


def entries_of(menu) -> list[str]:
    menu.aboutToShow.emit()
    return [entry.text() for entry in menu.actions() if not entry.isSeparator()]


def letter_of(text: str) -> str:
    return QKeySequence.mnemonic(text).toString()[-1:]


def test_every_entry_has_a_letter_and_shares_it_only_where_letters_run_out(window) -> None:
    bar = window.menuBar()
    menus = list(menus_in(bar))
    titles = [menu.title() for menu in menus]
    assert {"&Labels", "&Help"} < set(titles)
    assert len(titles) > len(bar.actions()), "menus within menus are walked too"
    for texts in ([entry.text() for entry in bar.actions()], *map(entries_of, menus)):
        letters = [letter_of(text) for text in texts]
        assert all(letters), texts
        if len(letters) < LETTERS // 2:
            assert len(set(letters)) == len(letters), texts


def test_letters_stay_when_the_menu_follows_the_window(labelled) -> None:
    key_of_play = labelled.action("play").text()
    QTest.keyClick(labelled, Qt.Key.Key_Space)
    assert letter_of(labelled.action("play").text()) == letter_of(key_of_play) == "P"
    QTest.keyClick(labelled, Qt.Key.Key_Space)
    QTest.keyClick(labelled, Qt.Key.Key_N)
    QTest.keyClick(labelled, Qt.Key.Key_Backspace)
    assert labelled.action("undo").text() == "&Undo delete span"


def test_the_menu_of_labels_is_short(window) -> None:
    (labels,) = (menu for menu in menus_in(window.menuBar()) if menu.title() == "&Labels")
    assert len(entries_of(labels)) <= 14
    assert labels.sizeHint().height() < 480
    for menu in menus_in(labels):
        assert len(entries_of(menu)) <= 16, menu.title()


def test_letters_lead_to_an_entry_two_menus_down(labelled, qtbot) -> None:
    labelled.activateWindow()
    qtbot.waitUntil(labelled.isActiveWindow, timeout=5000)
    (labels,) = (menu for menu in menus_in(labelled.menuBar()) if menu.title() == "&Labels")
    go_to = next(menu for menu in menus_in(labels) if "Go to" in menu.title().replace("&", ""))
    bar = labelled.menuBar()
    QTest.mouseClick(bar, LEFT, pos=bar.actionGeometry(labels.menuAction()).center())
    qtbot.waitUntil(labels.isVisible, timeout=5000)
    for menu, text in (
        (labels, go_to.title()),
        (go_to, labelled.action("next_span").text()),
    ):
        qtbot.waitUntil(lambda menu=menu: QApplication.activePopupWidget() is menu, timeout=5000)
        QTest.keyClick(menu, letter_of(text).lower())
    qtbot.waitUntil(lambda: bool(models_of(labelled).labels.selected), timeout=5000)
    assert QApplication.activePopupWidget() is None
