"""Spans as the rows of a table: columns, order, filter, and the edits made by typing."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from PySide6.QtCore import QModelIndex, QObject, Qt, Signal
from PySide6.QtGui import QIcon

from sd2app.labels.edits import LabelEdits
from sd2app.widgets.icons import swatch_icon
from sd2app.widgets.record_table import Choosable, Heading, Index, RecordTableModel
from sd2app.widgets.text import counted
from sd2core.errors import Sd2Error
from sd2core.labels.edits import Change, Side
from sd2core.labels.field_edits import SpanField, change_spans
from sd2core.labels.spans import Span
from sd2core.labels.typed_times import typed_duration_end, typed_end, typed_start
from sd2core.timebase import Timebase

Typed = Callable[[str, Sequence[Span]], Change]
"""Makes the edit of a typed text, given the spans concerned, that of the cell first."""
When = Callable[[str, Span, Timebase], float]


@dataclass(frozen=True)
class Edge:
    """Edge of a span that a cell moves, and the time parsed from typed text."""

    side: Side
    when: When

    def of(self, span: Span) -> float:
        """Return the time of the edge."""
        return span.start_s if self.side == "start" else span.end_s

    def typed(self, text: str, spans: Sequence[Span]) -> Change:
        """Make the edit that moves the edge."""
        span_id = spans[0].id
        return lambda now: now.resize(
            span_id, self.side, self.when(text, now.labels.span(span_id), now.timebase)
        )


@dataclass(frozen=True)
class Column:
    """One column of the table of spans."""

    id: str
    heading: str
    tip: str
    text: Callable[[Span, Timebase], str]
    order: Callable[[Span], Any]  # sort key; ties stay in the order of time
    typed: Typed | None = None  # makes the edit of a typed text; None: not editable
    # Chosen from a list, for all selected spans.
    listed: Literal["label", "track", "person"] | None = None
    wide: str = "000.000"  # a text as wide as the column is at first
    number: bool = False
    hidden: bool = False  # at first
    edge: Edge | None = None  # edge that typing moves, in a column of times


_START = Edge("start", lambda text, _, base: typed_start(text, base))
_END = Edge("end", lambda text, _, base: typed_end(text, base))
_DURATION = Edge("end", lambda text, span, base: typed_duration_end(text, span.start_s, base))
NOBODY = "Not told"
_TIMES = "seconds (1.5 or 1:02.5) or a frame (f48)"


def _frames(span: Span, timebase: Timebase) -> str:
    frames = span.frames(timebase)
    return "" if frames is None else frames.words()


def _given(field: SpanField, value: Callable[[str], Any] = str.strip) -> Typed:
    """Typing that gives a field of spans a value, read from the text."""

    def typed(text: str, spans: Sequence[Span]) -> Change:
        ids = [span.id for span in spans]
        return lambda now: change_spans(now.labels, ids, **{field: value(text)})

    return typed


def _confidence(text: str) -> float | None:
    typed = text.strip().replace(",", ".")
    try:
        return float(typed) if typed else None
    except ValueError:
        raise Sd2Error(
            f"{text[:40]!r} was typed as a confidence", "a number from 0 to 1, or nothing"
        ) from None


COLUMNS: tuple[Column, ...] = (
    Column(
        "start", "Start s", f"Start. Type {_TIMES}: the first one of the span",
        lambda span, _: f"{span.start_s:.3f}", lambda span: span.start_s, _START.typed,
        number=True, edge=_START,
    ),
    Column(
        "end", "End s", f"End. Type {_TIMES}: the last one of the span",
        lambda span, _: f"{span.end_s:.3f}", lambda span: span.end_s, _END.typed,
        number=True, edge=_END,
    ),
    Column(
        "label", "Label", "Label of the set, given to all selected spans",
        lambda span, _: span.label, lambda span: span.label.casefold(),
        _given("label", str), "label",
        wide="■ right-to-left ",
    ),
    Column(
        "person", "Person", "Who of the scene does it, for all selected spans",
        lambda span, _: span.person, lambda span: span.person.casefold(),
        _given("person"), "person",
        wide="person 2",
    ),
    Column(
        "duration", "Length s", "Duration. Type seconds or frames (12 f): its end moves",
        lambda span, _: f"{span.duration_s:.3f}", lambda span: span.duration_s,
        _DURATION.typed, number=True, edge=_DURATION,
    ),
    Column(
        "frames", "Frames", "The first frame, the last one, and their number",
        _frames, lambda span: span.start_s, wide="000–000 (00)", number=True,
    ),
    Column(
        "track", "Track", "Track, for all selected spans",
        lambda span, _: span.track, lambda span: span.track.casefold(),
        _given("track", str), "track",
        wide="Gestures",
    ),
    Column(
        "note", "Note", "Any text",
        lambda span, _: span.note, lambda span: span.note.casefold(), _given("note"),
        wide="Note",
    ),
    Column(
        "author", "Author", "Person who marked it",
        lambda span, _: span.author, lambda span: span.author.casefold(),
        _given("author"),
        wide="some name", hidden=True,
    ),
    Column(
        "confidence", "Sure", "Confidence, 0 to 1",
        lambda span, _: "" if span.confidence is None else f"{span.confidence:g}",
        lambda span: -1.0 if span.confidence is None else span.confidence,
        _given("confidence", _confidence),
        wide="0.00", number=True, hidden=True,
    ),
    Column(
        "origin", "Origin", "A person, a suggestion, or an import",
        lambda span, _: span.origin, lambda span: span.origin, wide="suggestion", hidden=True,
    ),
)  # fmt: skip


@dataclass(frozen=True)
class SpanFilter:
    """Filter of spans by a text in label, note, track or person, and by label and track."""

    text: str = ""
    label: str = ""
    track: str = ""

    def keeps(self, spans: Iterable[Span]) -> list[Span]:
        """Return the spans that pass."""
        text = self.text.casefold().strip()
        return [
            span
            for span in spans
            if (not self.label or span.label == self.label)
            and (not self.track or span.track == self.track)
            and (
                not text
                or any(
                    text in one.casefold()
                    for one in (span.label, span.note, span.track, span.person)
                )
            )
        ]


class SpanTableModel(RecordTableModel[Span]):
    """A row per span."""

    noted = Signal(str)  # a typed time could not be reached

    def __init__(self, edits: LabelEdits, parent: QObject | None = None) -> None:
        headings = [
            Heading(one.heading, one.tip, one.number, one.typed is not None) for one in COLUMNS
        ]
        super().__init__(headings, parent)
        self._labels, self._playback, self._edits = edits.labels, edits.playback, edits
        self._row_of: dict[int, int] = {}
        self._filter = SpanFilter()
        self._by, self._falling = COLUMNS[0], False
        self._labels.changed.connect(self._follow)

    # --- what is shown --------------------------------------------------------------------

    @property
    def total(self) -> int:
        """Number of all spans."""
        return len(self._labels.labels.spans)

    @property
    def words(self) -> str:
        """Number of spans, and of those shown."""
        whole = counted(self.total, "span")
        return whole if len(self.rows) == self.total else f"{len(self.rows):,} of {whole}"

    def row_of(self, span_id: int) -> int | None:
        """Return the row of a span, or None."""
        return self._row_of.get(span_id)

    def choices(self, listed: str) -> list[str]:
        """Return the labels of the set and others in use, the tracks, or nobody and the persons.

        Where there is one person, who is not named, there is no choice of persons.
        """
        labels = self._labels.labels
        if listed == "track":
            return [track.name for track in labels.tracks]
        if listed == "person":
            known = [*self._edits.persons]
            known += sorted({span.person for span in labels.spans}.difference(["", *known]))
            return ["", *known] if known else []
        known = [label.name for label in labels.label_set.labels]
        return known + sorted({span.label for span in labels.spans}.difference(known))

    # --- choosing what is shown -----------------------------------------------------------

    def set_filter(self, wanted: SpanFilter) -> None:
        """Filter the rows; spans that are no longer shown are deselected."""
        if wanted == self._filter:
            return
        self._filter = wanted
        self._follow()
        shown = [span.id for span in self._labels.selected if self.row_of(span.id) is not None]
        self._labels.select(shown)

    def sort(self, column: int, order: Qt.SortOrder = Qt.SortOrder.AscendingOrder) -> None:
        """Sort by a column."""
        self._by, self._falling = COLUMNS[column], order == Qt.SortOrder.DescendingOrder
        self._follow()

    def _refresh(self) -> None:
        rows = self._filter.keeps(self._labels.labels.spans)
        if self._by.id != "start" or self._falling:
            rows.sort(key=self._by.order, reverse=self._falling)
        self._show(rows)

    def _show(self, rows: list[Span]) -> None:
        """Show spans; what points at one of them goes along."""
        if rows and [span.id for span in rows] == [*self._row_of]:  # in the same order
            self.show_rows(rows)
            return
        self.layoutAboutToBeChanged.emit()
        held = self.persistentIndexList()
        ids = [self.rows[index.row()].id for index in held]
        at = {span.id: row for row, span in enumerate(rows)}
        self.rows, self._row_of = rows, at
        moved = [
            QModelIndex() if (row := at.get(one)) is None else self.createIndex(row, index.column())
            for one, index in zip(ids, held, strict=True)
        ]
        self.changePersistentIndexList(held, moved)
        self.layoutChanged.emit()

    # --- cells ----------------------------------------------------------------------------

    def _text(self, record: Span, column: int) -> str:
        return COLUMNS[column].text(record, self._playback.timebase)

    def _icon(self, record: Span, column: int) -> QIcon | None:
        coloured = COLUMNS[column].id == "label"
        return (
            swatch_icon(self._labels.labels.label_set.colour_of(record.label)) if coloured else None
        )

    def choices_at(self, index: Index) -> Sequence[Choosable]:
        """Labels, persons or tracks to choose from."""
        listed = COLUMNS[index.column()].listed
        colour_of, coloured = self._labels.labels.label_set.colour_of, listed == "label"
        return [
            Choosable(one or NOBODY, one, swatch_icon(colour_of(one)) if coloured else None)
            for one in (self.choices(listed) if listed is not None else ())
        ]

    # --- typing ---------------------------------------------------------------------------

    def setData(self, index: Index, value: Any, role: int = Qt.ItemDataRole.EditRole) -> bool:
        """Make the edit typed; False, with the cell unchanged, where it was refused."""
        column, span, text = COLUMNS[index.column()], self.rows[index.row()], str(value)
        if column.typed is None or text == self.data(index):
            return False
        spans = [span]
        if column.listed is not None and span.id in self._labels.selected_ids:
            spans += [one for one in self._labels.selected if one.id != span.id]
        done = self._edits.apply(column.typed(text, spans))
        if done and column.edge is not None:
            self._say_where(span, column.edge, text)
        return done

    def _say_where(self, span: Span, edge: Edge, text: str) -> None:
        """Report a time that frames, neighbours or the other edge did not allow."""
        base = self._playback.timebase
        wanted_s = edge.when(text, span, base)
        there_s = edge.of(self._labels.labels.span(span.id))
        if abs(wanted_s - there_s) > base.frame_duration_s:
            self.noted.emit(
                f"The {edge.side} of the span is at {there_s:.3f} s, as near to {wanted_s:.3f} s as"
                " its other edge, its neighbours and the recording allow."
            )
