"""How cells of the table of spans are edited."""

from __future__ import annotations

from PySide6.QtCore import QAbstractItemModel, QModelIndex, QRect, Qt
from PySide6.QtGui import QPainter, QPalette
from PySide6.QtWidgets import QStyle, QStyledItemDelegate, QStyleOptionViewItem, QWidget

from sd2app.icons import swatch_icon
from sd2app.models.labels import LabelsModel
from sd2app.models.span_columns import COLUMNS
from sd2app.models.span_table import SpanTableModel
from sd2app.views.listed_editor import ListedEditor


class SpanCells(QStyledItemDelegate):
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
        choices = self._table.choices(column)
        icons = [
            swatch_icon(self._labels.colour_of(one)) if column.id == "label" else None
            for one in choices
        ]
        editor = ListedEditor([*zip(icons, choices, strict=True)], column.heading, parent)
        editor.activated.connect(lambda _: self._take(editor))
        return editor

    def updateEditorGeometry(
        self, editor: QWidget, option: QStyleOptionViewItem, index: QModelIndex
    ) -> None:
        """The whole cell, and more where a list needs it."""
        place = QRect(option.rect)
        place.setWidth(max(place.width(), editor.minimumSizeHint().width()))
        editor.setGeometry(place)

    def paint(self, painter: QPainter, option: QStyleOptionViewItem, index: QModelIndex) -> None:
        """The cell, framed where the keyboard is."""
        super().paint(painter, option, index)
        if option.state & QStyle.StateFlag.State_HasFocus:
            selected = bool(option.state & QStyle.StateFlag.State_Selected)
            role = QPalette.ColorRole.HighlightedText if selected else QPalette.ColorRole.Highlight
            painter.save()
            painter.setPen(option.palette.color(role))
            painter.drawRect(option.rect.adjusted(1, 1, -2, -2))
            painter.restore()

    def setEditorData(self, editor: QWidget, index: QModelIndex) -> None:
        """What the cell says."""
        if isinstance(editor, ListedEditor):
            editor.setCurrentText(index.data(Qt.ItemDataRole.EditRole))
        else:
            super().setEditorData(editor, index)

    def setModelData(self, editor: QWidget, model: QAbstractItemModel, index: QModelIndex) -> None:
        """What was chosen or typed."""
        if isinstance(editor, ListedEditor):
            model.setData(index, editor.currentText())
        else:
            super().setModelData(editor, model, index)

    def _take(self, editor: ListedEditor) -> None:
        self.commitData.emit(editor)
        self.closeEditor.emit(editor)
