"""The table of spans without a window: rows follow the labels, cells edit them."""

from __future__ import annotations

import random
from dataclasses import replace
from types import SimpleNamespace

import pytest
from label_edits import label_edits, show_labels
from labelled import even, imported, many_spans, random_edit
from PySide6.QtCore import QItemSelectionModel, QPersistentModelIndex, Qt
from PySide6.QtTest import QAbstractItemModelTester

from sd2app.labels.table_model import COLUMNS, SpanFilter, SpanTableModel
from sd2core.labels.spans import Labels, LabelTrack, Span

AT = {column.id: place for place, column in enumerate(COLUMNS)}
FALLING = Qt.SortOrder.DescendingOrder


class Table:
    """A table on labels, with what was said about edits."""

    def __init__(self) -> None:
        self.edits = label_edits(even(300))
        self.labels, self.playback = self.edits.labels, self.edits.playback
        self.model = SpanTableModel(self.edits)
        self.model.set_watched(True)
        self.refused: list[str] = []
        self.noted: list[str] = []
        self.edits.failed.connect(self.refused.append)
        self.model.noted.connect(self.noted.append)

    def column(self, name: str) -> list[str]:
        return [self.cell(row, name) for row in range(self.model.rowCount())]

    def cell(self, row: int, name: str) -> str:
        return self.model.data(self.model.index(row, AT[name]))

    def type(self, row: int, name: str, text: str) -> bool:
        return self.model.setData(self.model.index(row, AT[name]), text)


@pytest.fixture
def table():
    made = Table()
    show_labels(
        made.edits,
        Labels(
            (LabelTrack("Gestures"), LabelTrack("Free", "free")),
            (
                Span(1, "Gestures", 1.0, 2.0, "left-to-right", note="quick"),
                Span(2, "Gestures", 3.0, 5.0, "up-to-down", author="Anna"),
                Span(3, "Free", 2.0, 2.5, "clap", note="Both hands", confidence=0.5),
            ),
        ),
    )
    return made


def test_what_the_cells_show(table) -> None:
    assert [table.cell(0, column.id) for column in COLUMNS] == [
        "1.000", "2.000", "left-to-right", "", "1.000", "30–59 (30)", "Gestures", "quick",
        "", "", "person",
    ]  # fmt: skip
    assert table.cell(1, "confidence") == "0.5"
    assert table.column("label") == ["left-to-right", "clap", "up-to-down"]
    header = table.model.headerData(AT["duration"], Qt.Orientation.Horizontal)
    assert header == "Length s"


@pytest.mark.parametrize(
    ("column", "ids"),
    [
        ("start", [1, 3, 2]),
        ("end", [1, 3, 2]),
        ("duration", [3, 1, 2]),
        ("label", [3, 1, 2]),
        ("track", [3, 1, 2]),
        ("note", [2, 3, 1]),
        ("confidence", [1, 2, 3]),
    ],
)
def test_sorted_by_any_column_both_ways(table, column: str, ids: list[int]) -> None:
    table.model.sort(AT[column])
    assert [span.id for span in table.model.rows] == ids
    table.model.sort(AT[column], FALLING)
    order = COLUMNS[AT[column]].order
    falling = [order(span) for span in table.model.rows]
    assert falling == sorted(falling, reverse=True)
    assert falling[0] == order(table.labels.labels.span(ids[-1]))


def test_filtered_by_text_label_and_track(table) -> None:
    def shown(**wanted: str) -> list[int]:
        table.model.set_filter(SpanFilter(**wanted))
        return [span.id for span in table.model.rows]

    assert shown(text="HANDS") == [3]
    assert shown(text="gest") == [1, 2]
    assert shown(text=" right ") == [1]
    assert shown(label="up-to-down") == [2]
    assert shown(track="Free") == [3]
    assert shown(track="Free", label="up-to-down") == []
    assert shown() == [1, 3, 2]
    assert table.model.total == 3


def test_persons_are_offered_where_there_are_several(table) -> None:
    assert table.model.choices("person") == []
    scene = SimpleNamespace(others=["anna"], persons=("anna", "person 2"))
    document = table.edits._document
    document.content = replace(document.content, mesh=scene)
    assert table.model.choices("person") == ["", "anna", "person 2"]
    table.labels.select([1, 2])
    assert table.type(0, "person", "anna")
    assert [span.person for span in table.labels.labels.spans] == ["anna", "", "anna"]
    table.model.set_filter(SpanFilter("ANNA"))
    assert [span.id for span in table.model.rows] == [1, 2]
    # Whom the scene does not have any more is still somebody.
    document.content = replace(document.content, mesh=None)
    assert table.model.choices("person") == ["", "anna"]
    table.edits.undo_stack.undo()
    assert table.model.choices("person") == []


def test_what_is_not_shown_any_more_is_not_selected_any_more(table) -> None:
    table.labels.select([1, 3])
    table.model.set_filter(SpanFilter(track="Free"))
    assert [span.id for span in table.labels.selected] == [3]


def test_times_are_typed_in_seconds_or_frames(table) -> None:
    assert table.type(0, "start", "0.5")
    assert table.type(0, "end", "f44")
    span = table.labels.labels.span(1)
    assert (span.start_s, span.end_s) == (0.5, pytest.approx(1.5))
    assert table.type(0, "duration", "12 f")
    assert table.labels.labels.span(1).duration_s == pytest.approx(0.4)
    assert not table.noted
    assert not table.refused


def test_what_has_no_room_stops_there_and_it_is_said(table) -> None:
    assert table.type(0, "end", "4.5")
    assert table.cell(0, "end") == "3.000"
    assert "The end of the span is at 3.000 s, as near to 4.500 s" in table.noted[0]


@pytest.mark.parametrize(
    ("column", "text", "words"),
    [
        ("start", "soon", "'soon' was typed as a time"),
        ("end", "f300", "a frame from 0 to 299"),
        ("confidence", "very", "a number from 0 to 1"),
        ("confidence", "1.5", "0 to 1"),
        ("label", " ", "one line of 1 to 200 characters"),
        ("track", "Nowhere", "No track is called"),
    ],
)
def test_what_cannot_be_is_refused_and_the_cell_is_as_it_was(table, column, text, words) -> None:
    before = table.labels.labels
    assert not table.type(0, column, text)
    assert table.labels.labels is before
    assert words in table.refused[0]


def test_a_span_goes_to_another_track_unless_it_overlaps_there(table) -> None:
    table.labels.set_labels(table.labels.labels.with_spans([Span(4, "Free", 1.5, 1.8, "clap")]))
    assert table.column("track") == ["Gestures", "Free", "Free", "Gestures"]
    assert not table.type(1, "track", "Gestures")
    assert "overlap on 'Gestures'" in table.refused[0]
    assert table.type(2, "track", "Gestures")
    assert table.labels.labels.span(3).track == "Gestures"


def test_a_label_goes_to_all_that_are_selected_and_a_note_does_not(table) -> None:
    table.labels.select([1, 2])
    assert table.type(0, "label", "background")
    assert table.column("label") == ["background", "clap", "background"]
    table.labels.select([1, 2])
    assert table.type(0, "note", " slow ")
    assert table.column("note") == ["slow", "Both hands", ""]
    # A row that is not among the selected ones is about itself.
    table.labels.select([1, 2])
    assert table.type(1, "label", "wave")
    assert table.column("label") == ["background", "wave", "background"]


def test_choices_are_the_labels_of_the_set_then_others_and_the_tracks(table) -> None:
    labels = table.model.choices("label")
    assert labels[0] == "left-to-right"
    assert labels[-1] == "clap"
    assert table.model.choices("track") == ["Gestures", "Free"]


def test_nothing_is_made_while_nobody_looks(table) -> None:
    table.model.set_watched(False)
    show_labels(table.edits, many_spans(10))
    assert table.model.rowCount() == 3
    table.model.set_watched(True)
    assert table.model.rowCount() == 10


@pytest.mark.one_in(3)
@pytest.mark.parametrize("column", ["start", "label", "duration"])
def test_rows_and_what_points_at_them_follow_any_edits(table, column: str) -> None:
    """Also under Qt's own test of models, which watches every signal."""
    model, timebase = table.model, even(300)
    tester = QAbstractItemModelTester(model, QAbstractItemModelTester.FailureReportingMode.Fatal)
    model.sort(AT[column], FALLING)
    rng = random.Random(7)
    show_labels(table.edits, imported(timebase, 7, 20))
    for _ in range(50):
        held = [(span.id, QPersistentModelIndex(model.index(row, 2)))
                for row, span in enumerate(model.rows)]  # fmt: skip
        edit = random_edit(table.labels.labels, timebase, rng)
        same = {span.id for span in edit.labels.spans} == {one for one, _ in held}
        table.labels.set_labels(edit.labels)
        expected = sorted(edit.labels.spans, key=COLUMNS[AT[column]].order, reverse=True)
        assert model.rows == expected
        if same:
            assert all(model.rows[index.row()].id == one for one, index in held)
        else:
            for one, index in held:
                assert not index.isValid() or model.rows[index.row()].id == one
    tester.deleteLater()


def test_what_is_current_in_a_view_stays_with_its_span(table) -> None:
    chosen = QItemSelectionModel(table.model)
    chosen.setCurrentIndex(table.model.index(0, AT["start"]), chosen.SelectionFlag.SelectCurrent)
    assert table.type(1, "start", "0.1")  # "clap" is the first now
    assert table.column("label")[:2] == ["clap", "left-to-right"]
    assert chosen.currentIndex().row() == 1
    assert [index.row() for index in chosen.selectedIndexes()] == [1]
