"""Spans as the rows of a table: sorted, filtered, and edited cell by cell."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

from PySide6.QtCore import (
    QAbstractTableModel,
    QModelIndex,
    QObject,
    QPersistentModelIndex,
    Qt,
    Signal,
)

from sd2app.labels.columns import COLUMNS, Change, Column, Edge
from sd2app.labels.model import LabelsModel
from sd2app.session.playback import PlaybackModel
from sd2app.widgets.icons import swatch_icon
from sd2core.labels.spans import Span

Index = QModelIndex | QPersistentModelIndex

_RIGHT = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
_LEFT = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter
_READ = Qt.ItemFlag.ItemIsSelectable | Qt.ItemFlag.ItemIsEnabled
_TYPED = _READ | Qt.ItemFlag.ItemIsEditable
_NOWHERE = QModelIndex()


@dataclass(frozen=True)
class SpanFilter:
    """Which spans are shown.

    Parameters
    ----------
    text : str
        Anywhere in label, note or track, in upper or lower case.
    label, track : str
        This one only; empty: any.
    """

    text: str = ""
    label: str = ""
    track: str = ""

    def keeps(self, spans: Iterable[Span]) -> list[Span]:
        """Those that are shown."""
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


class SpanTableModel(QAbstractTableModel):
    """A row is a span; a cell is made when it is looked at.

    Rows follow the labels while somebody watches, moved rather than made anew, so that what is
    current in a view stays with its span.

    Signals
    -------
    noted : str
        What became of something typed that the labels had no room for.
    """

    noted = Signal(str)

    def __init__(
        self,
        labels: LabelsModel,
        playback: PlaybackModel,
        apply: Callable[[Change], bool],
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self._labels, self._playback, self._apply = labels, playback, apply
        self._rows: list[Span] = []
        self._row_of: dict[int, int] | None = None
        self._filter = SpanFilter()
        self._by, self._falling = COLUMNS[0], False
        self._watched = self._following = False
        labels.changed.connect(self._follow)

    # --- what is shown --------------------------------------------------------------------

    @property
    def following(self) -> bool:
        """Whether rows are being changed because the labels have: nobody chose anything."""
        return self._following

    @property
    def filter(self) -> SpanFilter:
        """Which spans are shown."""
        return self._filter

    @property
    def total(self) -> int:
        """How many spans there are."""
        return len(self._labels.labels.spans)

    @property
    def spans(self) -> list[Span]:
        """The spans that are shown, from top to bottom."""
        return self._rows

    @property
    def words(self) -> str:
        """How many spans there are, and how many of them are shown."""
        whole = f"{self.total:,} span{'s' * (self.total != 1)}"
        return whole if len(self._rows) == self.total else f"{len(self._rows):,} of {whole}"

    def row_of(self, span_id: int) -> int | None:
        """Where a span is shown, if it is."""
        if self._row_of is None:
            self._row_of = {span.id: row for row, span in enumerate(self._rows)}
        return self._row_of.get(span_id)

    def choices(self, column: Column) -> list[str]:
        """What the cells of a column can be: labels of the set and others in use, or tracks."""
        labels = self._labels.labels
        if column.listed == "track":
            return [track.name for track in labels.tracks]
        known = [label.name for label in labels.label_set.labels]
        return known + sorted({span.label for span in labels.spans}.difference(known))

    # --- choosing what is shown -----------------------------------------------------------

    def set_watched(self, watched: bool) -> None:
        """Follow the labels, or leave that until somebody looks."""
        self._watched = watched
        self._follow()

    def set_filter(self, wanted: SpanFilter) -> None:
        """Show some of the spans; what is no longer shown is no longer selected."""
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

    def _follow(self) -> None:
        if not self._watched:
            return
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
            self.beginRemoveRows(_NOWHERE, head, stop - 1)
            self._assign(before[:head] + before[stop:])
            self.endRemoveRows()
        if (stop := len(rows) - tail) > head:
            self.beginInsertRows(_NOWHERE, head, stop - 1)
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
        """Other spans in the same rows: say which rows look different."""
        changed = [row for row, span in enumerate(rows) if span is not self._rows[row]]
        self._assign(rows)
        if not changed:
            # Perhaps the colours of the label set, which are in the cells too.
            changed = [0, len(rows) - 1]
        if rows:
            last = self.index(changed[-1], len(COLUMNS) - 1)
            self.dataChanged.emit(self.index(changed[0], 0), last)

    def _assign(self, rows: list[Span]) -> None:
        self._rows, self._row_of = rows, None

    # --- Qt's questions -------------------------------------------------------------------

    def rowCount(self, parent: Index = _NOWHERE) -> int:
        """Spans that are shown."""
        return 0 if parent.isValid() else len(self._rows)

    def columnCount(self, parent: Index = _NOWHERE) -> int:
        """Columns, hidden ones too."""
        return 0 if parent.isValid() else len(COLUMNS)

    def headerData(
        self, section: int, orientation: Qt.Orientation, role: int = Qt.ItemDataRole.DisplayRole
    ) -> Any:
        """Headings."""
        if orientation != Qt.Orientation.Horizontal:
            return None
        column = COLUMNS[section]
        if role == Qt.ItemDataRole.TextAlignmentRole:
            return _RIGHT if column.number else _LEFT
        roles = {
            Qt.ItemDataRole.DisplayRole: column.heading,
            Qt.ItemDataRole.ToolTipRole: column.tip,
        }
        return roles.get(Qt.ItemDataRole(role))

    def flags(self, index: Index) -> Qt.ItemFlag:
        """What can be typed into."""
        if not index.isValid():
            return Qt.ItemFlag.NoItemFlags
        return _READ if COLUMNS[index.column()].typed is None else _TYPED

    def data(self, index: Index, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        """A cell, as it is looked at."""
        if not index.isValid():
            return None
        column = COLUMNS[index.column()]
        if role in (Qt.ItemDataRole.DisplayRole, Qt.ItemDataRole.EditRole):
            return column.text(self._rows[index.row()], self._playback.timebase)
        if role == Qt.ItemDataRole.TextAlignmentRole:
            return _RIGHT if column.number else _LEFT
        if role == Qt.ItemDataRole.DecorationRole and column.id == "label":
            return swatch_icon(self._labels.colour_of(self._rows[index.row()].label))
        if role == Qt.ItemDataRole.ToolTipRole and column.id in ("label", "track", "note"):
            return column.text(self._rows[index.row()], self._playback.timebase)
        return None

    # --- typing ---------------------------------------------------------------------------

    def setData(self, index: Index, value: Any, role: int = Qt.ItemDataRole.EditRole) -> bool:
        """Make the edit that was typed; False, with the cell as it was, where it was refused."""
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
        """Frames, neighbours and the other edge may have stopped it before what was typed."""
        base = self._playback.timebase
        wanted_s = edge.when(text, span, base)
        there_s = edge.of(self._labels.labels.span(span.id))
        if abs(wanted_s - there_s) > base.frame_duration_s:
            self.noted.emit(
                f"The {edge.side} of the span is at {there_s:.3f} s, as near to {wanted_s:.3f} s as"
                " its other edge, its neighbours and the recording allow."
            )


def _alike(rows: list[Span], before: list[Span], places: range) -> int:
    """How many rows hold the same span, place by place, until one does not."""
    for count, place in enumerate(places):
        if rows[place].id != before[place].id:
            return count
    return len(places)
