"""Spans as the rows of a table: sorted, filtered, and edited cell by cell."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from PySide6.QtCore import QObject, Qt, Signal
from PySide6.QtGui import QIcon

from sd2app.labels.columns import COLUMNS, Change, Column, Edge
from sd2app.labels.model import LabelsModel
from sd2app.session.playback import PlaybackModel
from sd2app.widgets.icons import swatch_icon
from sd2app.widgets.record_table import NO_PARENT, Heading, Index, RecordTableModel
from sd2core.labels.spans import Span


@dataclass(frozen=True)
class SpanFilter:
    """Filter of spans by a text in label, note or track, and by label and track."""

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
                or text in span.label.casefold()
                or text in span.note.casefold()
                or text in span.track.casefold()
            )
        ]


class SpanTableModel(RecordTableModel[Span]):
    """A row per span. Rows are moved rather than rebuilt, so that a view keeps its current span."""

    noted = Signal(str)  # a typed time could not be reached

    def __init__(
        self,
        labels: LabelsModel,
        playback: PlaybackModel,
        apply: Callable[[Change], bool],
        parent: QObject | None = None,
    ) -> None:
        headings = [
            Heading(one.heading, one.tip, one.number, one.typed is not None) for one in COLUMNS
        ]
        super().__init__(headings, parent)
        self._labels, self._playback, self._apply = labels, playback, apply
        self._row_of: dict[int, int] | None = None
        self._filter = SpanFilter()
        self._by, self._falling = COLUMNS[0], False
        self._following = False
        labels.changed.connect(self._follow)

    # --- what is shown --------------------------------------------------------------------

    @property
    def following(self) -> bool:
        """True while rows change because the labels have, not by the user's choice."""
        return self._following

    @property
    def filter(self) -> SpanFilter:
        """Filter of the rows."""
        return self._filter

    @property
    def total(self) -> int:
        """Number of all spans."""
        return len(self._labels.labels.spans)

    @property
    def spans(self) -> Sequence[Span]:
        """Spans shown, from top to bottom."""
        return self._rows

    @property
    def words(self) -> str:
        """Number of spans, and of those shown."""
        whole = f"{self.total:,} span{'s' * (self.total != 1)}"
        return whole if len(self._rows) == self.total else f"{len(self._rows):,} of {whole}"

    def row_of(self, span_id: int) -> int | None:
        """Return the row of a span, or None."""
        if self._row_of is None:
            self._row_of = {span.id: row for row, span in enumerate(self._rows)}
        return self._row_of.get(span_id)

    def choices(self, column: Column) -> list[str]:
        """Return the values a column offers: labels of the set and others in use, or tracks."""
        labels = self._labels.labels
        if column.listed == "track":
            return [track.name for track in labels.tracks]
        known = [label.name for label in labels.label_set.labels]
        return known + sorted({span.label for span in labels.spans}.difference(known))

    # --- choosing what is shown -----------------------------------------------------------

    def set_filter(self, wanted: SpanFilter) -> None:
        """Filter the rows; spans that are no longer shown are deselected."""
        if wanted == self._filter:
            return
        self._filter = wanted
        self._follow()
        there = [span.id for span in self._labels.selected if self.row_of(span.id) is not None]
        self._labels.select(there)

    def sort(self, column: int, order: Qt.SortOrder = Qt.SortOrder.AscendingOrder) -> None:
        """Sort by a column."""
        self._by, self._falling = COLUMNS[column], order == Qt.SortOrder.DescendingOrder
        self._follow()

    def _refresh(self) -> None:
        rows = self._filter.keeps(self._labels.labels.spans)
        if self._by.id != "start" or self._falling:
            rows.sort(key=self._by.order, reverse=self._falling)
        self._following = True
        try:
            self._show(rows)
        finally:
            self._following = False

    def _show(self, rows: list[Span]) -> None:
        there = {span.id: span for span in rows}
        self._replace([there.get(span.id, span) for span in self._rows])
        before = self._rows
        if len(rows) == len(before) and all(span.id in there for span in before):
            if _alike(rows, before, range(len(rows))) < len(rows):
                self._reorder(rows)
            return
        shorter = min(len(rows), len(before))
        head = _alike(rows, before, range(shorter))
        tail = _alike(rows, before, range(-1, -1 - (shorter - head), -1))
        if (stop := len(before) - tail) > head:
            self.beginRemoveRows(NO_PARENT, head, stop - 1)
            self._assign([*before[:head], *before[stop:]])
            self.endRemoveRows()
        if (stop := len(rows) - tail) > head:
            self.beginInsertRows(NO_PARENT, head, stop - 1)
            self._assign(rows)
            self.endInsertRows()

    def _reorder(self, rows: list[Span]) -> None:
        self.layoutAboutToBeChanged.emit()
        held = self.persistentIndexList()
        ids = [self._rows[index.row()].id for index in held]
        self._assign(rows)
        moved = [
            self.index(self.row_of(one) or 0, index.column())
            for one, index in zip(ids, held, strict=True)
        ]
        self.changePersistentIndexList(held, moved)
        self.layoutChanged.emit()

    def _replace(self, rows: list[Span]) -> None:
        """Other spans in the same rows: report the rows that look different."""
        changed = [row for row, span in enumerate(rows) if span is not self._rows[row]]
        self._assign(rows)
        if not changed:
            # Perhaps the colours of the label set, which are in the cells too.
            changed = [0, len(rows) - 1]
        if rows:
            last = self.index(changed[-1], len(COLUMNS) - 1)
            self.dataChanged.emit(self.index(changed[0], 0), last)

    def _assign(self, rows: Sequence[Span]) -> None:
        self._rows, self._row_of = rows, None

    # --- cells ----------------------------------------------------------------------------

    def _text(self, record: Span, column: int) -> str:
        return COLUMNS[column].text(record, self._playback.timebase)

    def _icon(self, record: Span, column: int) -> QIcon | None:
        coloured = COLUMNS[column].id == "label"
        return swatch_icon(self._labels.colour_of(record.label)) if coloured else None

    def _tip(self, record: Span, column: int) -> str | None:
        wide = COLUMNS[column].id in ("label", "track", "note")
        return self._text(record, column) if wide else None

    # --- typing ---------------------------------------------------------------------------

    def setData(self, index: Index, value: Any, role: int = Qt.ItemDataRole.EditRole) -> bool:
        """Make the edit typed; False, with the cell unchanged, where it was refused."""
        column, span, text = COLUMNS[index.column()], self._rows[index.row()], str(value)
        if column.typed is None or text == self.data(index):
            return False
        spans = [span]
        if column.listed is not None and self._labels.is_selected(span.id):
            spans += [one for one in self._labels.selected if one.id != span.id]
        done = self._apply(column.typed(text, spans))
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


def _alike(rows: Sequence[Span], before: Sequence[Span], places: range) -> int:
    """Number of leading rows that hold the same span."""
    for count, place in enumerate(places):
        if rows[place].id != before[place].id:
            return count
    return len(places)
