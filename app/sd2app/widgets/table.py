"""Tables whose cells are edited in place, by mouse and keyboard."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from PySide6.QtCore import QAbstractItemModel, QEvent, QModelIndex, QRect, Qt
from PySide6.QtGui import QHideEvent, QIcon, QKeyEvent, QPainter, QPalette, QShowEvent
from PySide6.QtWidgets import (
    QAbstractItemView,
    QComboBox,
    QHeaderView,
    QLineEdit,
    QStyle,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QTableView,
    QTreeWidget,
    QWidget,
)

from sd2app.widgets.inputs import claims
from sd2app.widgets.record_table import Choosable, RecordTableModel

ROW_PX = 22


def entry_list(name: str, headings: Sequence[str], wide: int, parent: QWidget) -> QTreeWidget:
    """A list of rows to choose from, whose ``wide`` column takes the room that is left over.

    Parameters
    ----------
    name : str
        For screen readers.
    headings : sequence of str
        Of the columns.
    wide : int
        Number of a column.
    parent : QWidget
    """
    made = QTreeWidget(parent)
    made.setAccessibleName(name)
    made.setHeaderLabels(list(headings))
    made.setRootIsDecorated(False)
    made.setUniformRowHeights(True)
    modes = QHeaderView.ResizeMode
    for column in range(len(headings)):
        mode = modes.Stretch if column == wide else modes.ResizeToContents
        made.header().setSectionResizeMode(column, mode)
    made.header().setStretchLastSection(False)
    return made


_OWN_KEYS = (
    Qt.Key.Key_PageUp,
    Qt.Key.Key_PageDown,
    Qt.Key.Key_Up,
    Qt.Key.Key_Down,
    Qt.Key.Key_Return,
    Qt.Key.Key_Enter,
    Qt.Key.Key_F2,
)
"""Keys that move in a table; Left, Right, Home and End belong to the frames of a recording."""
_Move = QAbstractItemView.CursorAction


class ListedEditor(QComboBox):
    """A list in a cell. Letters choose from it, and fire no action of the window."""

    def __init__(self, choices: Sequence[Choosable], name: str, parent: QWidget) -> None:
        super().__init__(parent)
        self.setAccessibleName(name)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        for one in choices:
            self.addItem(one.icon or QIcon(), one.text, one.value)

    def event(self, event: QEvent) -> bool:
        """Claim letters, which choose an entry."""
        return claims(event) or super().event(event)


class FramedCells(QStyledItemDelegate):
    """Frames the cell that has the keyboard, and knows lists besides lines of text."""

    def createEditor(
        self, parent: QWidget, option: QStyleOptionViewItem, index: QModelIndex
    ) -> QWidget:
        """Make a list, whose choice is taken at once, where the model has one, or a line."""
        model = index.model()
        assert isinstance(model, RecordTableModel)
        heading = model.headings[index.column()]
        if choices := model.choices_at(index):
            editor = ListedEditor(choices, heading.text, parent)
            editor.activated.connect(lambda _: self.take(editor))
            return editor
        line = super().createEditor(parent, option, index)
        line.setAccessibleName(heading.text)
        line.setToolTip(heading.tip)
        return line

    def take(self, editor: QWidget) -> None:
        """End editing with what was chosen."""
        self.commitData.emit(editor)
        self.closeEditor.emit(editor)

    def paint(self, painter: QPainter, option: QStyleOptionViewItem, index: QModelIndex) -> None:
        """Paint the cell, framed where the keyboard is."""
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
        """Give the editor the whole cell, and more where a list needs it."""
        place = QRect(option.rect)
        place.setWidth(max(place.width(), editor.minimumSizeHint().width()))
        editor.setGeometry(place)

    def setEditorData(self, editor: QWidget, index: QModelIndex) -> None:
        """Show the value of the cell, unless another one is being typed."""
        if isinstance(editor, ListedEditor):
            editor.setCurrentIndex(editor.findData(index.data(Qt.ItemDataRole.EditRole)))
        elif not (isinstance(editor, QLineEdit) and editor.isModified()):
            super().setEditorData(editor, index)

    def setModelData(self, editor: QWidget, model: QAbstractItemModel, index: QModelIndex) -> None:
        """Hand the chosen or typed value to the model."""
        if isinstance(editor, ListedEditor):
            model.setData(index, editor.currentData())
        else:
            super().setModelData(editor, model, index)


class RecordTable(QTableView):
    """Plain rows; those of a :class:`RecordTableModel` are kept up to date while shown."""

    def __init__(self, name: str, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setAccessibleName(name)
        self.setShowGrid(False)
        self.verticalHeader().hide()
        self.verticalHeader().setDefaultSectionSize(ROW_PX)
        self.horizontalHeader().setHighlightSections(False)

    def showEvent(self, event: QShowEvent) -> None:
        """Follow the records."""
        super().showEvent(event)
        self._watch(True)

    def hideEvent(self, event: QHideEvent) -> None:
        """Stop following the records."""
        super().hideEvent(event)
        self._watch(False)

    def _watch(self, watched: bool) -> None:
        model = self.model()
        if isinstance(model, RecordTableModel):
            model.set_watched(watched)


class CellTable(RecordTable):
    """Return or a double click edits a cell, Tab goes to the next one that can be edited.

    Escape gives the keyboard back to the window.
    """

    def __init__(
        self, name: str, own_keys: Collection[Qt.Key] = (), parent: QWidget | None = None
    ) -> None:
        super().__init__(name, parent)
        self._own_keys = {*_OWN_KEYS, *own_keys}
        self.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
        self.setEditTriggers(
            QAbstractItemView.EditTrigger.DoubleClicked
            | QAbstractItemView.EditTrigger.EditKeyPressed
        )
        self.setWordWrap(False)
        self.setHorizontalScrollMode(QAbstractItemView.ScrollMode.ScrollPerPixel)
        self.horizontalHeader().setStretchLastSection(True)

    def event(self, event: QEvent) -> bool:
        """Claim the keys that move in a table."""
        return claims(event, self._own_keys) or super().event(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Edit with Return, leave with Escape."""
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            # The one that ended editing comes by here too.
            if self.state() != QAbstractItemView.State.EditingState:
                self.edit(self.currentIndex())
        elif event.key() == Qt.Key.Key_Escape:
            self.clearFocus()
        else:
            super().keyPressEvent(event)

    def keyboardSearch(self, search: str) -> None:
        """Ignore letters, which are keys of labels and actions."""

    def moveCursor(self, action: _Move, modifiers: Qt.KeyboardModifier) -> QModelIndex:
        """Move with Tab from one editable cell to the next, row after row."""
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
