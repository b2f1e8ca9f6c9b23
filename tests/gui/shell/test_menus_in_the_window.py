"""All menus of the window: short, and every entry with a letter of its own."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import Qt, QTimer
from PySide6.QtGui import QKeySequence
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication
from window_models import all_actions, menu_of, models_of

from sd2app.labels.edits import reaction_ms
from sd2app.settings import MAX_RECENT
from sd2app.shell.menus import ELSEWHERE, LAYOUT, menus_in
from sd2app.widgets.inputs import Choice, NumberBox

ALT, LEFT = Qt.KeyboardModifier.AltModifier, Qt.MouseButton.LeftButton
LETTERS = 26


def entries_of(menu) -> list[str]:
    menu.aboutToShow.emit()
    return [entry.text() for entry in menu.actions() if not entry.isSeparator()]


def letter_of(text: str) -> str:
    return QKeySequence.mnemonic(text).toString()[-1:]


def test_every_action_stands_once_and_in_the_menu_that_it_names(qapp) -> None:
    named = {one.id: one.menu for one in all_actions()}
    places = [
        (menu, entry)
        for menu, entries in (*LAYOUT.items(), *ELSEWHERE.items())
        for entry in entries
        if entry[0] not in "-@"
    ]
    assert sorted(entry for _, entry in places) == sorted(named)
    assert all(named[entry] == menu for menu, entry in places if menu in LAYOUT)


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


def test_menus_have_at_most_80_entries_and_none_is_long(labelled) -> None:
    for number in range(MAX_RECENT):
        labelled.session.settings.add_recent(Path(f"/recording-{number}.sd2"))
    menus = list(menus_in(labelled.menuBar()))
    inner = {menu.menuAction() for menu in menus}
    leaves = 0
    for menu in menus:
        entries = entries_of(menu)
        assert len(entries) <= 20, menu.title()
        leaves += len(entries) - len(inner.intersection(menu.actions()))
    assert leaves <= 80
    labelled.start.refresh()
    assert len(labelled.start.recent) == MAX_RECENT
    assert not any(one.isHidden() for one in labelled.start.recent)


def test_the_context_menu_of_the_labels_has_what_is_done_with_spans(labelled) -> None:
    menu = menu_of(labelled, "Spans")
    texts = [text.replace("&", "") for text in entries_of(menu)]
    assert {"Split span here", "Merge selected spans", "Delete selected spans"} <= set(texts)
    assert menu.menuAction() not in labelled.menuBar().actions()


def test_preferences_hold_at_once_and_stay(labelled, qtbot) -> None:
    display, settings = labelled.session.display, labelled.session.settings
    before = display.dark

    def choose() -> None:
        dialog = QApplication.activeModalWidget()
        theme = dialog.findChild(Choice)
        theme.setCurrentIndex(theme.findData(not before))
        dialog.findChild(NumberBox).setValue(200)
        dialog.reject()

    QTimer.singleShot(0, choose)
    QTest.keyClick(labelled, Qt.Key.Key_Comma, Qt.KeyboardModifier.ControlModifier)
    assert (display.dark, settings.dark) == (not before, not before)
    assert reaction_ms(settings) == 200
    labelled.features.program.set_dark(None)
    assert settings.dark is None


def test_letters_lead_to_an_entry(labelled, qtbot) -> None:
    labelled.activateWindow()
    qtbot.waitUntil(labelled.isActiveWindow, timeout=5000)
    (labels,) = (menu for menu in menus_in(labelled.menuBar()) if menu.title() == "&Labels")
    bar = labelled.menuBar()
    QTest.mouseClick(bar, LEFT, pos=bar.actionGeometry(labels.menuAction()).center())
    qtbot.waitUntil(labels.isVisible, timeout=5000)
    QTest.keyClick(labels, letter_of(labelled.action("next_span").text()).lower())
    qtbot.waitUntil(lambda: bool(models_of(labelled).labels.selected), timeout=5000)
    assert QApplication.activePopupWidget() is None
