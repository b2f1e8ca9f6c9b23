"""A table whose cells are edited by keyboard as well as by hand."""

from __future__ import annotations

from collections.abc import Collection

from PySide6.QtCore import QEvent, QModelIndex, Qt
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QAbstractItemView, QTableView, QWidget

from sd2app.widgets.own_keys import claims

ROW_PX = 22
_OWN_KEYS = (
    Qt.Key.Key_Home,
    Qt.Key.Key_End,
    Qt.Key.Key_PageUp,
    Qt.Key.Key_PageDown,
    Qt.Key.Key_Up,
    Qt.Key.Key_Down,
    Qt.Key.Key_Return,
    Qt.Key.Key_Enter,
    Qt.Key.Key_F2,
)
"""Those that move in a table, whatever they mean elsewhere. Left and Right stay with the frames."""

_Move = QAbstractItemView.CursorAction


class CellTable(QTableView):
    """Return or a double click edits a cell, Tab goes to the next one that can be edited.

    Escape gives the keyboard back to the window.
    """

    def __init__(
        self, name: str, own_keys: Collection[Qt.Key] = (), parent: QWidget | None = None
    ) -> None:
        super().__init__(parent)
        self._own_keys = {*_OWN_KEYS, *own_keys}
        self.setAccessibleName(name)
        self.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
        self.setEditTriggers(
            QAbstractItemView.EditTrigger.DoubleClicked
            | QAbstractItemView.EditTrigger.EditKeyPressed
        )
        self.setShowGrid(False)
        self.setWordWrap(False)
        self.setHorizontalScrollMode(QAbstractItemView.ScrollMode.ScrollPerPixel)
        self.verticalHeader().hide()
        self.verticalHeader().setDefaultSectionSize(ROW_PX)
        self.horizontalHeader().setHighlightSections(False)
        self.horizontalHeader().setStretchLastSection(True)

    def event(self, event: QEvent) -> bool:
        """Keys that move in a table do that here."""
        return claims(event, self._own_keys) or super().event(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Return edits, Escape leaves."""
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            # The one that ended editing comes by here too.
            if self.state() != QAbstractItemView.State.EditingState:
                self.edit(self.currentIndex())
        elif event.key() == Qt.Key.Key_Escape:
            self.clearFocus()
        else:
            super().keyPressEvent(event)

    def keyboardSearch(self, search: str) -> None:
        """Letters are keys of labels and actions, and go nowhere where they are none."""

    def moveCursor(self, action: _Move, modifiers: Qt.KeyboardModifier) -> QModelIndex:
        """Tab goes from one cell that can be edited to the next, row after row."""
        current, model = self.currentIndex(), self.model()
        steps = {_Move.MoveNext: 1, _Move.MovePrevious: -1}
        if action not in steps or not current.isValid():
            return super().moveCursor(action, modifiers)
        columns = model.columnCount()
        place = current.row() * columns + current.column() + steps[action]
        while 0 <= place < model.rowCount() * columns:
            index = model.index(*divmod(place, columns))
            if index.flags() & Qt.ItemFlag.ItemIsEditable and not self.isColumnHidden(
                index.column()
            ):
                return index
            place += steps[action]
        return current
