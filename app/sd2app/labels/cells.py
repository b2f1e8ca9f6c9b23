"""How cells of the table of spans are edited."""

from __future__ import annotations

from PySide6.QtCore import QModelIndex
from PySide6.QtWidgets import QStyleOptionViewItem, QWidget

from sd2app.labels.columns import COLUMNS
from sd2app.labels.model import LabelsModel
from sd2app.labels.table_model import SpanTableModel
from sd2app.widgets.icons import swatch_icon
from sd2app.widgets.table import Choosable, FramedCells


class SpanCells(FramedCells):
    """Labels and tracks from a list, everything else as text."""

    def __init__(self, table: SpanTableModel, labels: LabelsModel, parent: QWidget) -> None:
        super().__init__(parent)
        self._table, self._labels = table, labels

    def createEditor(
        self, parent: QWidget, option: QStyleOptionViewItem, index: QModelIndex
    ) -> QWidget:
        """A list, or a line."""
        column = COLUMNS[index.column()]
        if column.listed is None:
            line = super().createEditor(parent, option, index)
            line.setAccessibleName(column.heading)
            line.setToolTip(column.tip)
            return line
        coloured = column.id == "label"
        choices = [
            Choosable(one, one, swatch_icon(self._labels.colour_of(one)) if coloured else None)
            for one in self._table.choices(column)
        ]
        return self.listed(choices, column.heading, parent)
