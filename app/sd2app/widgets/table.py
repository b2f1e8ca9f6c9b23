"""Cells of tables that are edited in place; what is typed there is nobody else's."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from PySide6.QtCore import QAbstractItemModel, QEvent, QModelIndex, QRect, Qt
from PySide6.QtGui import QIcon, QPainter, QPalette
from PySide6.QtWidgets import (
    QComboBox,
    QStyle,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QWidget,
)

from sd2app.widgets.own_keys import claims


class Choosable(NamedTuple):
    """One entry of a list in a cell.

    Parameters
    ----------
    text : str
        What it says.
    value : str
        What the model is given.
    icon : QIcon, optional
    """

    text: str
    value: str
    icon: QIcon | None = None


class ListedEditor(QComboBox):
    """A list in a cell. Letters choose from it, and fire no action of the window."""

    def __init__(self, choices: Sequence[Choosable], name: str, parent: QWidget) -> None:
        super().__init__(parent)
        self.setAccessibleName(name)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        for one in choices:
            self.addItem(one.icon or QIcon(), one.text, one.value)

    def event(self, event: QEvent) -> bool:
        """Letters choose here."""
        return claims(event) or super().event(event)


class FramedCells(QStyledItemDelegate):
    """Frames the cell that has the keyboard, and knows lists besides lines of text."""

    def listed(self, choices: Sequence[Choosable], name: str, parent: QWidget) -> ListedEditor:
        """A list; what is chosen is taken at once."""
        editor = ListedEditor(choices, name, parent)
        editor.activated.connect(lambda _: self.take(editor))
        return editor

    def take(self, editor: QWidget) -> None:
        """End editing with what was chosen."""
        self.commitData.emit(editor)
        self.closeEditor.emit(editor)

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

    def updateEditorGeometry(
        self, editor: QWidget, option: QStyleOptionViewItem, index: QModelIndex
    ) -> None:
        """The whole cell, and more where a list needs it."""
        place = QRect(option.rect)
        place.setWidth(max(place.width(), editor.minimumSizeHint().width()))
        editor.setGeometry(place)

    def setEditorData(self, editor: QWidget, index: QModelIndex) -> None:
        """What the cell says."""
        if isinstance(editor, ListedEditor):
            editor.setCurrentIndex(editor.findData(index.data(Qt.ItemDataRole.EditRole)))
        else:
            super().setEditorData(editor, index)

    def setModelData(self, editor: QWidget, model: QAbstractItemModel, index: QModelIndex) -> None:
        """What was chosen or typed."""
        if isinstance(editor, ListedEditor):
            model.setData(index, editor.currentData())
        else:
            super().setModelData(editor, model, index)
