"""Table of differences per joint: position, velocity and jitter."""

from __future__ import annotations

import math

from PySide6.QtCore import QSignalBlocker, Qt
from PySide6.QtGui import QBrush, QColor
from PySide6.QtWidgets import (
    QAbstractItemView,
    QHeaderView,
    QTableWidget,
    QTableWidgetItem,
    QWidget,
)

from sd2app.mesh_comparison.curves import joint_words
from sd2app.mesh_comparison.model import ComparisonModel, JointRow
from sd2app.mesh_comparison.pictures import colour_of
from sd2app.session.display import DisplayModel

_HEADS = (
    ("Joint", "Click to see its velocity over time"),
    ("Distance\ncm", "Mean distance between the two"),
    ("Velocity\nm/s", "RMS difference of the velocities towards the sensor"),
    ("Correl.\nr", "Correlation of those velocities"),
    ("Jitter\nm/s³", "RMS third difference: how much the joint trembles in the first mesh"),
    ("Jitter\nm/s³", "The same in the second mesh"),
)


class JointTable(QTableWidget):
    """A row per joint; the current one is drawn."""

    def __init__(
        self, comparison: ComparisonModel, display: DisplayModel, parent: QWidget | None = None
    ) -> None:
        super().__init__(0, len(_HEADS), parent)
        self._comparison = comparison
        self._display = display
        self.setHorizontalHeaderLabels([text for text, _ in _HEADS])
        for column, (_, tip) in enumerate(_HEADS):
            head = self.horizontalHeaderItem(column)
            assert head is not None
            head.setToolTip(tip)
        self.verticalHeader().hide()
        self.verticalHeader().setDefaultSectionSize(22)
        self.setShowGrid(False)
        self.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
        self.setSelectionMode(QAbstractItemView.SelectionMode.SingleSelection)
        self.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self.setFrameShape(QTableWidget.Shape.NoFrame)
        header = self.horizontalHeader()
        header.setHighlightSections(False)
        header.setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        header.setSectionResizeMode(0, QHeaderView.ResizeMode.Stretch)
        self.currentCellChanged.connect(self._choose)
        comparison.changed.connect(self._refresh)
        display.theme_changed.connect(self._refresh)
        self._refresh()

    def _refresh(self) -> None:
        rows = self._comparison.rows
        with QSignalBlocker(self):
            self.setRowCount(len(rows))
            for number, row in enumerate(rows):
                for column, text in enumerate(_cells(row)):
                    self.setItem(number, column, self._item(column, text))
                if row.name == self._comparison.joint:
                    self.setCurrentCell(number, 0)

    def _item(self, column: int, text: str) -> QTableWidgetItem:
        item = QTableWidgetItem(text)
        if column:
            item.setTextAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        if column >= len(_HEADS) - 2:
            number = column - (len(_HEADS) - 2)
            item.setForeground(QBrush(QColor(colour_of(self._display, number))))
        return item

    def _choose(self, row: int) -> None:
        rows = self._comparison.rows
        if 0 <= row < len(rows):
            self._comparison.set_joint(rows[row].name)


def _cells(row: JointRow) -> tuple[str, ...]:
    same = "–" if math.isnan(row.correlation) else f"{row.correlation:.2f}".replace("-", "−")
    return (
        joint_words(row.name),
        f"{100 * row.distance_m:.1f}",
        f"{row.velocity_rms_mps:.2f}",
        same,
        *(f"{value:.0f}" for value in row.jitter_mps3),
    )
