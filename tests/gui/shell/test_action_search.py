"""Everything that can be done found by its words, and done by Return."""

from __future__ import annotations

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from PySide6.QtCore import Qt, QTimer
from PySide6.QtGui import QAction
from PySide6.QtWidgets import QApplication, QMainWindow
from window_models import models_of

from sd2app.shell.action_search import ActionSearch, entries_of, matching
from sd2app.shell.menus import menus_in
from sd2app.widgets.inputs import SearchLine


@pytest.fixture
def bare_window(qtbot):
    window = QMainWindow()
    qtbot.addWidget(window)
    return window


@pytest.fixture
def window_with_menus(bare_window):
    window = bare_window
    menus = window.menuBar()
    file, view = menus.addMenu("&File"), menus.addMenu("&View")
    for text, tip in (("&Open…", "Look at a recording"), ("Save &as…", "Write a copy")):
        action = QAction(text, window)
        action.setToolTip(tip)
        file.addAction(action)
    file.addSeparator()
    inner = view.addMenu("Colours")
    off = QAction("Open the palette", window)
    off.setToolTip("There is no mesh")
    off.setEnabled(False)
    inner.addAction(off)
    return window


def line_of(search):
    """Where one types."""
    return search.findChild(SearchLine)


def texts(entries):
    return [one.text for one in entries]


def test_all_entries_of_all_menus_are_there_by_their_plain_texts(window_with_menus):
    entries = entries_of(window_with_menus)
    assert texts(entries) == ["Open…", "Save as…", "Open the palette"]
    assert [one.menus for one in entries] == [("File",), ("File",), ("View", "Colours")]


def test_beginnings_go_before_what_is_within_and_that_before_tips(window_with_menus):
    entries = entries_of(window_with_menus)
    assert texts(matching(entries, "open")) == ["Open…", "Open the palette"]  # the rest is disabled
    assert texts(matching(entries, "AS")) == ["Save as…"]
    assert texts(matching(entries, "reco")) == ["Open…"]  # "recording", in its tip
    assert texts(matching(entries, "file copy")) == ["Save as…"]
    assert texts(matching(entries, "pale open")) == ["Open the palette"]
    assert matching(entries, "open zebra") == []


def test_escape_empties_the_line_then_closes_the_dialog(window_with_menus, qtbot):
    search = ActionSearch(window_with_menus)
    qtbot.addWidget(search)
    search.open()
    qtbot.keyClicks(line_of(search), "open")
    qtbot.keyClick(line_of(search), Qt.Key.Key_Escape)
    assert (search.isVisible(), line_of(search).text()) == (True, "")
    qtbot.keyClick(line_of(search), Qt.Key.Key_Escape)
    assert not search.isVisible()


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.lists(
        st.sampled_from(["open", "save", "as", "the", "file", "view", "mesh", "copy", "o", "p"]),
        max_size=3,
    )
)
def test_more_words_never_find_more(window_with_menus, words):
    entries = entries_of(window_with_menus)
    before = set(map(id, entries))
    for count in range(len(words) + 1):
        after = set(map(id, matching(entries, " ".join(words[:count]))))
        assert after <= before
        before = after


def test_typing_and_return_do_it(window_with_menus, qtbot):
    done = []
    window_with_menus.menuBar().actions()[0].menu().actions()[1].triggered.connect(
        lambda: done.append("save as")
    )
    search = ActionSearch(window_with_menus)
    qtbot.addWidget(search)
    search.show()
    qtbot.keyClicks(line_of(search), "write")
    assert search.current.text == "Save as…"
    qtbot.keyClick(line_of(search), Qt.Key.Key_Return)
    assert search.chosen.text() == "Save &as…"
    search.chosen.trigger()
    assert done == ["save as"]


def test_what_is_disabled_says_why_and_is_not_done(window_with_menus, qtbot):
    search = ActionSearch(window_with_menus)
    qtbot.addWidget(search)
    search.show()
    qtbot.keyClicks(line_of(search), "open")
    qtbot.keyClick(line_of(search), Qt.Key.Key_Down)
    assert search.current.tip == "There is no mesh"
    qtbot.keyClick(line_of(search), Qt.Key.Key_Return)
    assert search.chosen is None
    assert search.isVisible()


def test_the_key_opens_it_and_what_is_chosen_is_done(empty_window, qtbot):
    display = models_of(empty_window).display
    before = display.dark

    def type_it():
        search = QApplication.activeModalWidget()
        qtbot.keyClicks(line_of(search), "dark theme")
        qtbot.keyClick(line_of(search), Qt.Key.Key_Return)

    QTimer.singleShot(0, type_it)
    qtbot.keyClick(
        empty_window,
        Qt.Key.Key_P,
        Qt.KeyboardModifier.ControlModifier | Qt.KeyboardModifier.ShiftModifier,
    )
    assert display.dark != before


def test_every_action_of_the_window_can_be_found_by_its_own_text(empty_window):
    entries = entries_of(empty_window)
    listed = {one.action for one in entries}
    assert len(listed) == len(entries)
    for row in empty_window.keys.actions:
        assert empty_window.action(row.id) in listed, row.id
    for one in entries:
        assert one in matching(entries, one.text)


@pytest.mark.parametrize(
    ("key", "name"),
    [
        ((Qt.Key.Key_2, Qt.KeyboardModifier.AltModifier), "colour_range"),
        ((Qt.Key.Key_Period,), "faster"),
    ],
)
def test_keys_of_what_is_in_no_menu_of_the_bar_hold(labelled, qtbot, key, name):
    action = labelled.action(name)
    in_bar = {entry for menu in menus_in(labelled.menuBar()) for entry in menu.actions()}
    assert action not in in_bar
    with qtbot.waitSignal(action.triggered, timeout=5000):
        qtbot.keyClick(labelled, *key)
