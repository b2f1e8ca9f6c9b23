"""Table model for a list of records: one row each, cells made when they are looked at."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Generic, NamedTuple, TypeVar

from PySide6.QtCore import QAbstractTableModel, QModelIndex, QObject, QPersistentModelIndex, Qt
from PySide6.QtGui import QIcon

Record = TypeVar("Record")
Index = QModelIndex | QPersistentModelIndex

NO_PARENT = QModelIndex()
_RIGHT = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
_LEFT = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter


class Heading(NamedTuple):
    """Heading of a column; numbers are aligned to the right."""

    text: str
    tip: str = ""
    number: bool = False
    editable: bool = False


class Choosable(NamedTuple):
    """One entry of a list in a cell."""

    text: str  # shown to the user
    value: str  # passed to the model
    icon: QIcon | None = None


class RecordTableModel(QAbstractTableModel, Generic[Record]):
    """Rows of records, kept up to date only while a view shows them.

    A subclass assigns ``rows``, usually in :meth:`_refresh`, and gives the cells' texts.
    """

    def __init__(self, headings: Sequence[Heading], parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.headings = tuple(headings)
        self.rows: Sequence[Record] = ()
        self._watched = False

    def set_watched(self, watched: bool) -> None:
        """Follow the records, or wait until a view shows them."""
        self._watched = watched
        self._follow()

    def _follow(self) -> None:
        if self._watched:
            self._refresh()

    def _refresh(self) -> None:
        """Assign the rows; without this they are assigned when there are others."""

    def show_rows(self, rows: Sequence[Record]) -> None:
        """Assign the rows; of as many as before only the cells are others."""
        if rows and len(rows) == len(self.rows):
            self.rows = rows
            last = self.index(len(rows) - 1, len(self.headings) - 1)
            self.dataChanged.emit(self.index(0, 0), last)
            return
        self.beginResetModel()
        self.rows = rows
        self.endResetModel()

    def choices_at(self, index: Index) -> Sequence[Choosable]:
        """Entries of the list that edits a cell; none where a line does."""
        return ()

    def _text(self, record: Record, column: int) -> str:
        raise NotImplementedError

    def _edited_text(self, record: Record, column: int) -> str:
        return self._text(record, column)

    def _icon(self, record: Record, column: int) -> QIcon | None:
        return None

    def _tip(self, record: Record, column: int) -> str | None:
        # A narrow column cuts words; numbers have their room.
        return None if self.headings[column].number else self._text(record, column)

    def rowCount(self, parent: Index = NO_PARENT) -> int:
        """Return the number of records."""
        return 0 if parent.isValid() else len(self.rows)

    def columnCount(self, parent: Index = NO_PARENT) -> int:
        """Return the number of columns, hidden ones included."""
        return 0 if parent.isValid() else len(self.headings)

    def headerData(
        self, section: int, orientation: Qt.Orientation, role: int = Qt.ItemDataRole.DisplayRole
    ) -> Any:
        """Return text, tip or alignment of a heading."""
        if orientation != Qt.Orientation.Horizontal:
            return None
        heading = self.headings[section]
        if role == Qt.ItemDataRole.DisplayRole:
            return heading.text
        if role == Qt.ItemDataRole.TextAlignmentRole:
            return _RIGHT if heading.number else _LEFT
        return (heading.tip or None) if role == Qt.ItemDataRole.ToolTipRole else None

    def flags(self, index: Index) -> Qt.ItemFlag:
        """Return which cells can be edited."""
        if not index.isValid():
            return Qt.ItemFlag.NoItemFlags
        read = Qt.ItemFlag.ItemIsSelectable | Qt.ItemFlag.ItemIsEnabled
        editable = self.headings[index.column()].editable
        return read | Qt.ItemFlag.ItemIsEditable if editable else read

    def data(self, index: Index, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        """Return text, icon, tip or alignment of a cell."""
        if not index.isValid():
            return None
        record, column = self.rows[index.row()], index.column()
        if role == Qt.ItemDataRole.DisplayRole:
            return self._text(record, column)
        if role == Qt.ItemDataRole.EditRole:
            return self._edited_text(record, column)
        if role == Qt.ItemDataRole.TextAlignmentRole:
            return _RIGHT if self.headings[column].number else _LEFT
        if role == Qt.ItemDataRole.DecorationRole:
            return self._icon(record, column)
        return self._tip(record, column) if role == Qt.ItemDataRole.ToolTipRole else None
