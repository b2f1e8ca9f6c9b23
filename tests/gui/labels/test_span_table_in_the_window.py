"""The table of spans by real keys and a real mouse; what counts is the model."""

from __future__ import annotations

from dataclasses import replace

import pytest
from finding import splitter_around
from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QGuiApplication
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QLabel, QLineEdit, QMessageBox, QTableView, QToolButton
from window_models import models_of

from sd2app.labels.panel import LabelSetTable, LabelsPanel, StatisticsPage
from sd2app.labels.table import SpanTable
from sd2app.labels.table_model import COLUMNS
from sd2app.labels.timeline import ROW_PX, LabelTimeline
from sd2app.widgets.table import ListedEditor
from sd2core.mesh.bodies import Body

NONE, LEFT = Qt.KeyboardModifier.NoModifier, Qt.MouseButton.LeftButton
CONTROL, SHIFT = Qt.KeyboardModifier.ControlModifier, Qt.KeyboardModifier.ShiftModifier
AT = {column.id: place for place, column in enumerate(COLUMNS)}


@pytest.fixture
def labelled(window, qtbot):
    """The window on the small recording: "there" 0.2 to 0.8 s, "back" 1 to 2 s, 60 frames."""
    window.activateWindow()
    qtbot.waitUntil(window.isActiveWindow, timeout=5000)
    press(window, "L", SHIFT)
    return window


def table(window) -> SpanTable:
    return window.findChild(SpanTable)


def press(window, name: str, modifier=NONE) -> None:
    """A key, to whatever has the keyboard."""
    QTest.keyClick(QApplication.focusWidget() or window, getattr(Qt.Key, f"Key_{name}"), modifier)
    QApplication.processEvents()  # what ends editing a cell comes a moment later


def spans(window) -> list[tuple[str, int, int]]:
    base = models_of(window).playback.timebase
    return [
        (span.label, *base.frames_between(span.start_s, span.end_s))
        for span in models_of(window).labels.labels.spans
    ]


def click(window, row: int, column: str, modifier=NONE) -> None:
    index = table(window).model().index(row, AT[column])
    at = table(window).visualRect(index).center()
    QTest.mouseClick(table(window).viewport(), LEFT, modifier, at)


def edit(window, row: int, column: str):
    """The editor of a cell, opened by a double click."""
    click(window, row, column)
    at = table(window).visualRect(table(window).model().index(row, AT[column])).center()
    QTest.mouseDClick(table(window).viewport(), LEFT, NONE, at)
    editor = QApplication.focusWidget()
    assert isinstance(editor, QLineEdit | ListedEditor)
    return editor


THERE, BACK = ("there", 6, 24), ("back", 30, 60)


def test_the_key_of_the_panel_puts_the_keyboard_into_the_table(labelled) -> None:
    assert labelled.side.shown == "Labels"
    assert QApplication.focusWidget() is table(labelled)
    assert table(labelled).currentIndex().row() == 0
    press(labelled, "Escape")
    assert QApplication.focusWidget() is not table(labelled)


def test_opening_the_page_leaves_the_playhead_where_it_is(window, qtbot) -> None:
    window.activateWindow()
    qtbot.waitUntil(window.isActiveWindow, timeout=5000)
    c = models_of(window)
    c.playback.seek_frame(47)
    QTest.mouseClick(window.side.button("Labels"), LEFT)
    assert window.side.shown == "Labels"
    press(window, "L", SHIFT)
    assert QApplication.focusWidget() is table(window)
    assert table(window).currentIndex().row() == 1, "the row nearest to the playhead"
    assert c.playback.frame == 47
    assert not c.labels.selected


def test_one_selection_in_table_and_timeline(labelled) -> None:
    c, timeline = models_of(labelled), labelled.findChild(LabelTimeline)
    click(labelled, 1, "start")
    assert [span.label for span in c.labels.selected] == ["back"]
    assert c.playback.frame == 30
    # In a column of ends it is the last frame of the span.
    click(labelled, 0, "end")
    assert c.playback.frame == 23
    click(labelled, 1, "label", CONTROL)
    assert len(c.labels.selected) == 2
    QTest.mouseClick(timeline, LEFT, NONE, QPoint(round(timeline.scale.x_of(1.5)), ROW_PX // 2))
    rows = [index.row() for index in table(labelled).selectionModel().selectedRows()]
    assert rows == [1]
    assert table(labelled).currentIndex().row() == 1
    press(labelled, "Delete")
    assert table(labelled).currentIndex().row() == 0, "the next one, or the last"
    assert spans(labelled) == [THERE]
    assert c.document.undo_stack.undoText() == "Delete span"


def test_what_was_selected_before_the_table_was_seen_is_selected_in_it(labelled) -> None:
    labelled.side.bring_up("Sensor")
    back = models_of(labelled).labels.labels.spans[1]
    models_of(labelled).labels.select([back.id])
    labelled.side.bring_up("Labels")
    rows = [index.row() for index in table(labelled).selectionModel().selectedRows()]
    assert rows == [1]


def test_up_and_down_go_from_span_to_span(labelled) -> None:
    c = models_of(labelled)
    press(labelled, "Down")
    assert [span.label for span in c.labels.selected] == ["back"]
    press(labelled, "Up")
    assert [span.label for span in c.labels.selected] == ["there"]
    press(labelled, "A", CONTROL)
    assert len(c.labels.selected) == 2


def test_the_column_of_persons_is_there_where_there_are_several(labelled, qtbot) -> None:
    c = models_of(labelled)
    assert table(labelled).isColumnHidden(AT["person"])
    mesh = c.document.recording.mesh
    c.session.edits.add_to_scene(Body(str(mesh), (1.0, 0, 0), person="anna"))
    qtbot.waitUntil(lambda: not table(labelled).isColumnHidden(AT["person"]), timeout=5000)
    editor = edit(labelled, 0, "person")
    assert [editor.itemText(k) for k in range(editor.count())] == ["Not told", "person 1", "anna"]
    QTest.keyClick(editor, Qt.Key.Key_A)
    press(labelled, "Return")
    assert [span.person for span in c.labels.labels.spans] == ["anna", ""]
    count, (anna,) = c.document.undo_stack.count(), c.document.recording.bodies
    c.limbs.show("anna")
    c.session.edits.change_in_scene(0, replace(anna, person="anne"))
    assert [span.person for span in c.labels.labels.spans] == ["anne", ""]
    assert c.limbs.parts == ()  # nobody is called anna any more
    c.session.edits.change_in_scene(0, replace(anna, person=""))
    assert [span.person for span in c.labels.labels.spans] == ["person 2", ""]
    assert c.document.undo_stack.count() == count + 2
    c.document.undo_stack.undo()
    c.document.undo_stack.undo()
    assert c.document.recording.bodies == (anna,)
    assert [span.person for span in c.labels.labels.spans] == ["anna", ""]
    c.document.undo_stack.undo()
    c.document.undo_stack.undo()
    assert table(labelled).isColumnHidden(AT["person"])


def test_a_note_that_is_being_typed_stays_where_something_else_is_labelled(labelled) -> None:
    c = models_of(labelled)
    QTest.keyClicks(edit(labelled, 0, "note"), "slow")
    c.label_edits.apply(lambda now: now.create("Gestures", 0.85, 0.95, "there"))
    QApplication.processEvents()
    assert c.labels.labels.spans[0].note == "slow"


def test_a_note_that_is_being_typed_is_not_of_another_recording(
    labelled, qtbot, recording_copy
) -> None:
    c = models_of(labelled)
    QTest.keyClicks(edit(labelled, 0, "note"), "slow")
    with qtbot.waitSignal(c.document.opened, timeout=20_000):
        labelled.open_paths([recording_copy])
    press(labelled, "Return")
    assert [span.note for span in c.labels.labels.spans] == ["", ""]
    assert c.document.undo_stack.count() == 0


def test_a_note_that_is_being_typed_is_asked_about_before_the_window_closes(
    labelled, monkeypatch
) -> None:
    cancel = QMessageBox.StandardButton.Cancel
    monkeypatch.setattr(QMessageBox, "question", lambda *_: cancel)
    QTest.keyClicks(edit(labelled, 0, "note"), "slow")
    labelled.close()
    assert labelled.isVisible()
    assert models_of(labelled).labels.labels.spans[0].note == "slow"


def test_keys_of_the_window_work_beside_the_table_and_not_in_its_cells(labelled) -> None:
    c = models_of(labelled)
    sensor = c.sensor.sensor
    click(labelled, 1, "label")
    press(labelled, "Right")
    assert c.playback.frame == 31
    press(labelled, "Home")
    assert c.playback.frame == 0
    assert c.document.undo_stack.count() == 0
    press(labelled, "3")  # a label's key
    assert spans(labelled)[1][0] == "up-to-down"
    editor = edit(labelled, 0, "note")
    QTest.keyClicks(editor, "1 s /[n")
    press(labelled, "Home")
    press(labelled, "Left")
    QTest.keyClicks(editor, "x")
    press(labelled, "Return")
    assert c.labels.labels.spans[0].note == "x1 s /[n"
    assert spans(labelled) == [THERE, ("up-to-down", 30, 60)]
    assert not c.playback.playing
    assert c.sensor.sensor == sensor


def test_times_are_typed_tab_goes_on_and_the_window_follows(labelled) -> None:
    c = models_of(labelled)
    QTest.keyClicks(edit(labelled, 0, "start"), "f3")
    press(labelled, "Tab")
    assert c.document.undo_stack.undoText() == "Move start of span"
    assert c.playback.frame == 23  # the end is the current cell now
    QTest.keyClicks(QApplication.focusWidget(), "0.5 s")
    press(labelled, "Return")
    assert spans(labelled) == [("there", 3, 15), BACK]
    assert c.document.undo_stack.count() == 2
    # From the last cell of a row to the first of the next.
    click(labelled, 0, "note")
    press(labelled, "Tab")
    assert table(labelled).currentIndex().row() == 1
    assert [span.label for span in c.labels.selected] == ["back"]
    assert c.playback.frame == 30
    press(labelled, "Backtab", SHIFT)
    here = table(labelled).currentIndex()
    assert (here.row(), here.column()) == (0, AT["note"])


def test_what_cannot_be_is_said_and_the_cell_stays(labelled) -> None:
    QTest.keyClicks(edit(labelled, 0, "start"), "soon")
    press(labelled, "Return")
    assert "'soon' was typed as a time" in labelled.messages.text
    assert spans(labelled) == [THERE, BACK]
    assert models_of(labelled).document.undo_stack.count() == 0
    editor = edit(labelled, 0, "end")
    QTest.keyClicks(editor, "7")
    press(labelled, "Escape")
    assert spans(labelled) == [THERE, BACK]


def test_a_label_is_chosen_from_a_list_for_all_selected_rows(labelled) -> None:
    click(labelled, 0, "label")
    click(labelled, 1, "label", CONTROL)
    press(labelled, "F2")
    editor = QApplication.focusWidget()
    assert isinstance(editor, ListedEditor)
    assert editor.itemText(0) == "left-to-right"
    # A letter that is a key of the window chooses from the list instead.
    press(labelled, "D")
    assert editor.currentText() == "down-to-up"
    assert not models_of(labelled).display.as_dots
    press(labelled, "Return")
    assert [label for label, *_ in spans(labelled)] == ["down-to-up", "down-to-up"]
    assert models_of(labelled).document.undo_stack.count() == 1


def test_letters_choose_in_an_open_list_too(labelled) -> None:
    editor = edit(labelled, 0, "label")
    press(labelled, "Down", Qt.KeyboardModifier.AltModifier)
    assert editor.view().isVisible()
    QTest.keyClick(editor.view(), Qt.Key.Key_D)
    assert not models_of(labelled).display.as_dots
    QTest.keyClick(editor.view(), Qt.Key.Key_Return)
    QApplication.processEvents()
    assert spans(labelled)[0][0] == "down-to-up"


def test_search_filters_and_escape_leaves(labelled) -> None:
    press(labelled, "F", CONTROL)
    search = QApplication.focusWidget()
    assert isinstance(search, QLineEdit)
    QTest.keyClicks(search, "bac")
    assert [span.label for span in table(labelled).model().rows] == ["back"]
    assert table(labelled).model().words == "1 of 2 spans"
    edits = models_of(labelled).label_edits
    edits.apply(lambda now: now.create("Gestures", 0.85, 0.95, "there"))
    shown = {one.text() for one in labelled.findChild(LabelsPanel).findChildren(QLabel)}
    assert "1 of 3 spans" in shown
    edits.undo_stack.undo()
    press(labelled, "Escape")
    assert len(table(labelled).model().rows) == 2
    press(labelled, "Escape")
    assert QApplication.focusWidget() is not search


def test_what_a_filter_hides_is_not_selected_in_the_table(labelled) -> None:
    press(labelled, "F", CONTROL)
    QTest.keyClicks(QApplication.focusWidget(), "bac")
    table(labelled).setFocus()
    press(labelled, "A", CONTROL)
    assert [span.label for span in models_of(labelled).labels.selected] == ["back"]
    press(labelled, "Delete")
    assert [label for label, *_ in spans(labelled)] == ["there"]


def test_statistics_are_counted_and_copied(labelled) -> None:
    buttons = {one.text(): one for one in labelled.findChild(LabelsPanel).findChildren(QToolButton)}
    QTest.mouseClick(buttons["Statistics"], LEFT)
    QTest.mouseClick(buttons["Copy CSV"], LEFT)
    copied = QGuiApplication.clipboard().mimeData()
    lines = copied.text().splitlines()
    assert lines[-1] == "there,1,0.600,0.600,,0.600,0.600,0.600,30.0"
    assert bytes(copied.data("text/csv").data()).decode() == copied.text()
    QTest.mouseClick(buttons["Copy table"], LEFT)
    assert QGuiApplication.clipboard().text().splitlines()[0].startswith("label\tspans\t")


@pytest.mark.one_in(3)
@pytest.mark.parametrize("size", [(1280, 720), (1600, 1000), (2560, 1440)])
def test_statistics_need_no_scrolling(labelled, size) -> None:
    labelled.resize(*size)
    labelled.side.bring_up("Labels")
    buttons = {one.text(): one for one in labelled.findChild(LabelsPanel).findChildren(QToolButton)}
    QTest.mouseClick(buttons["Statistics"], LEFT)
    QApplication.processEvents()
    found = labelled.findChild(StatisticsPage).findChild(QTableView)
    assert found.isVisible()
    assert found.horizontalScrollBar().maximum() == 0
    labelled.resize(1280, 800)


def test_the_panel_is_as_wide_as_its_table_needs_and_others_are_as_before(labelled) -> None:
    wide = labelled.side.width()
    labelled.side.bring_up("Sensor")
    narrow = labelled.side.width()
    assert wide > narrow + 100
    labelled.side.bring_up("Accuracy")
    assert labelled.side.width() == narrow
    labelled.side.bring_up("Labels")
    assert labelled.side.width() >= wide  # as far as the scene gives way
    across = Qt.Orientation.Horizontal
    across = splitter_around(splitter_around(labelled.maps, across), across)
    across.splitterMoved.emit(0, 0)  # a hand has chosen what is there
    chosen = labelled.side.width()
    labelled.side.bring_up("Sensor")
    labelled.side.bring_up("Labels")
    assert labelled.side.width() == chosen


@pytest.mark.one_in(3)
@pytest.mark.parametrize("size", [(1000, 640), (1280, 720), (1600, 1000), (2560, 1440)])
def test_the_usual_columns_need_no_scrolling(labelled, size) -> None:
    labelled.resize(*size)
    labelled.side.bring_up("Sensor")
    labelled.side.bring_up("Labels", "Spans")
    QApplication.processEvents()
    spans = table(labelled)
    assert spans.horizontalScrollBar().maximum() == 0
    header, metrics = spans.horizontalHeader(), spans.fontMetrics()
    for place in range(header.count()):
        text = spans.model().headerData(place, Qt.Orientation.Horizontal)
        if not header.isSectionHidden(place):
            assert header.sectionSize(place) >= metrics.horizontalAdvance(text) + 4
    labelled.resize(1280, 800)


def test_a_narrow_table_does_without_some_columns_and_says_which(labelled) -> None:
    menu = table(labelled).columns_menu
    frames = next(one for one in menu.actions() if one.text() == "Frames")
    labelled.resize(1000, 640)
    QApplication.processEvents()
    assert table(labelled).isColumnHidden(AT["frames"])
    assert frames.text() == "Frames (no room here)"
    menu.actions()[AT["note"]].trigger()
    menu.actions()[AT["duration"]].trigger()
    assert not table(labelled).isColumnHidden(AT["frames"])
    labelled.resize(1280, 800)


def test_columns_of_the_label_set_need_no_scrolling_either(labelled) -> None:
    labelled.resize(1000, 640)
    labelled.side.bring_up("Labels", "Label set")
    QApplication.processEvents()
    labels = labelled.findChild(LabelSetTable)
    assert labels.horizontalScrollBar().maximum() == 0
    assert labels.sizeHintForColumn(0) <= labels.columnWidth(0)
    assert labels.model().index(0, 2).data(Qt.ItemDataRole.ToolTipRole) == "blue"
    labelled.resize(1280, 800)


def test_columns_are_chosen_and_remembered(labelled) -> None:
    assert table(labelled).isColumnHidden(AT["author"])
    menu = table(labelled).columns_menu
    next(one for one in menu.actions() if one.text() == "Author").trigger()
    assert not table(labelled).isColumnHidden(AT["author"])
    assert "author" not in models_of(labelled).settings.stored("span_table/hidden", "")
