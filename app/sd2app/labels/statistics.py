"""Statistics per label as the rows of a table."""

from __future__ import annotations

from typing import Any

from PySide6.QtCore import QAbstractTableModel, QModelIndex, QObject, QPersistentModelIndex, Qt

from sd2app.labels.model import LabelsModel
from sd2app.session.playback import PlaybackModel
from sd2app.widgets.icons import swatch_icon
from sd2core.labels.statistics import (
    HEADINGS,
    label_statistics,
    statistics_rows,
    statistics_text,
)

Index = QModelIndex | QPersistentModelIndex

_TIPS = (
    "Labels of the set, then any others that spans have",
    "How many spans",
    "Sum of their lengths; where spans overlap an instant counts in each",
    "Mean length",
    "Standard deviation of the lengths (n − 1)",
    "Half of the spans are shorter",
    "The shortest",
    "The longest",
    "Share of the recording that they hold, an instant counting once",
)
_RIGHT = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
_LEFT = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter
_NOWHERE = QModelIndex()


class StatisticsTableModel(QAbstractTableModel):
    """A row is a label; counted anew with every edit, while somebody watches."""

    def __init__(
        self, labels: LabelsModel, playback: PlaybackModel, parent: QObject | None = None
    ) -> None:
        super().__init__(parent)
        self._labels, self._playback = labels, playback
        self._rows: list[tuple[str, ...]] = []
        self._watched = False
        labels.changed.connect(self._follow)

    def set_watched(self, watched: bool) -> None:
        """Follow the labels, or leave that until somebody looks."""
        self._watched = watched
        self._follow()

    def text(self, separator: str) -> str:
        """All of it as CSV, or with a tab to paste into a sheet."""
        return statistics_text(self._rows, separator)

    def _follow(self) -> None:
        if not self._watched:
            return
        base = self._playback.timebase
        self.beginResetModel()
        found = label_statistics(self._labels.labels, (base.start_s, base.end_s))
        self._rows = statistics_rows(found)
        self.endResetModel()

    def rowCount(self, parent: Index = _NOWHERE) -> int:
        """Labels."""
        return 0 if parent.isValid() else len(self._rows)

    def columnCount(self, parent: Index = _NOWHERE) -> int:
        """Numbers of each, after its name."""
        return 0 if parent.isValid() else len(HEADINGS)

    def headerData(
        self, section: int, orientation: Qt.Orientation, role: int = Qt.ItemDataRole.DisplayRole
    ) -> Any:
        """Headings."""
        if orientation != Qt.Orientation.Horizontal:
            return None
        if role == Qt.ItemDataRole.TextAlignmentRole:
            return _RIGHT if section else _LEFT
        return (
            HEADINGS[section].capitalize().replace("Sd ", "SD ")
            if role == Qt.ItemDataRole.DisplayRole
            else None
        )

    def data(self, index: Index, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        """A cell."""
        if not index.isValid():
            return None
        if role == Qt.ItemDataRole.DisplayRole:
            return self._rows[index.row()][index.column()]
        if role == Qt.ItemDataRole.TextAlignmentRole:
            return _RIGHT if index.column() else _LEFT
        if role == Qt.ItemDataRole.DecorationRole and index.column() == 0:
            return swatch_icon(self._labels.colour_of(self._rows[index.row()][0]))
        return None
