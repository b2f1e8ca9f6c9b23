"""Page of statistics per label, with buttons to copy them."""

from __future__ import annotations

from PySide6.QtCore import QMimeData, Qt
from PySide6.QtGui import QGuiApplication, QHideEvent, QShowEvent
from PySide6.QtWidgets import (
    QAbstractItemView,
    QHBoxLayout,
    QTableView,
    QVBoxLayout,
    QWidget,
)

from sd2app.labels.statistics import StatisticsTableModel
from sd2app.widgets.panel import outlined
from sd2app.widgets.table import ROW_PX

_WIDE = "■ left-to-right  "
_PADDING_PX = 10


class StatisticsPage(QWidget):
    """A row per label; kept up to date while it is shown."""

    def __init__(self, model: StatisticsTableModel, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._model = model
        self._table = table = QTableView(self)
        table.setModel(model)
        table.setAccessibleName("Statistics per label")
        table.setSelectionMode(QAbstractItemView.SelectionMode.NoSelection)
        table.setShowGrid(False)
        table.setTabKeyNavigation(False)
        table.verticalHeader().hide()
        table.verticalHeader().setDefaultSectionSize(ROW_PX)
        table.horizontalHeader().setHighlightSections(False)
        self._fit_columns()
        copy_table = outlined(
            "Copy table", "To be pasted into a sheet", lambda: self._copy("\t"), self
        )
        copy_csv = outlined("Copy CSV", "Comma-separated values", lambda: self._copy(","), self)
        row = QHBoxLayout()
        row.setSpacing(6)
        row.addStretch(1)
        row.addWidget(copy_table)
        row.addWidget(copy_csv)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(6)
        layout.addWidget(table, 1)
        layout.addLayout(row)

    def showEvent(self, event: QShowEvent) -> None:
        """Follow the labels."""
        super().showEvent(event)
        self._model.set_watched(True)

    def hideEvent(self, event: QHideEvent) -> None:
        """Stop following the labels."""
        super().hideEvent(event)
        self._model.set_watched(False)

    def _fit_columns(self) -> None:
        metrics = self.fontMetrics()
        for column in range(self._model.columnCount()):
            heading = self._model.headerData(column, Qt.Orientation.Horizontal)
            wide = metrics.horizontalAdvance(heading if column else _WIDE) + _PADDING_PX
            self._table.setColumnWidth(column, max(wide, 52))

    def _copy(self, separator: str) -> None:
        text = self._model.text(separator)
        copied = QMimeData()
        copied.setText(text)
        if separator == ",":
            copied.setData("text/csv", text.encode())
        QGuiApplication.clipboard().setMimeData(copied)
