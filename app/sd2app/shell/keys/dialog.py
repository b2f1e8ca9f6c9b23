"""Dialog of all keys: found, changed, reset."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from PySide6.QtCore import QEvent, QKeyCombination, Qt, Signal
from PySide6.QtGui import QKeyEvent, QKeySequence
from PySide6.QtWidgets import (
    QAbstractItemView,
    QDialogButtonBox,
    QHeaderView,
    QLineEdit,
    QWidget,
)

from sd2app.manual.help import help_button
from sd2app.shell.keys.bindings import KeyBindings
from sd2app.shell.keys.model import KEYS, KeyListModel
from sd2app.widgets.dialogs import Dialog, closing, take_room
from sd2app.widgets.inputs import SearchLine
from sd2app.widgets.layouts import STRETCH, column_of, row_of
from sd2app.widgets.panel import outlined, sentence
from sd2app.widgets.table import CellTable
from sd2core.errors import Sd2Error

_KEYS_PX = 250
_MODIFIERS = (
    Qt.Key.Key_Shift,
    Qt.Key.Key_Control,
    Qt.Key.Key_Alt,
    Qt.Key.Key_AltGr,
    Qt.Key.Key_Meta,
    Qt.Key.Key_CapsLock,
)
_KEYPAD = Qt.KeyboardModifier.KeypadModifier


class KeysDialog(Dialog):
    """A list of what keys and mouse do; Return or a double click waits for another key."""

    def __init__(self, model: KeyListModel, bindings: KeyBindings, parent: QWidget) -> None:
        super().__init__("Keys", parent)
        self._model = model
        model.setParent(self)
        self._search = SearchLine("Search actions and keys", self)
        self._search.textChanged.connect(self._find)
        self._table = KeyTable(model, self)
        self._table.activated.connect(lambda: self._begin())
        self._table.selectionModel().currentRowChanged.connect(self._refresh)
        bindings.changed.connect(self._refresh)
        model.modelReset.connect(self._refresh)
        self._warning = sentence("", "warning")
        add, tip = partial(self._begin, besides=True), "Wait for a key besides"
        self._change = outlined("Change", "Wait for another key", self._begin, self)
        self._add = outlined("Add", tip, add, self)
        clear, reset = partial(self._attempt, model.clear), partial(self._attempt, model.reset)
        self._clear = outlined("Remove", "Leave it without a key", clear, self)
        self._reset = outlined("Reset", "Give it its usual keys back", reset, self)
        tip = "Give everything its usual keys"
        every = outlined("Reset all", tip, bindings.reset_all, self)
        close = closing(self)
        close.button(QDialogButtonBox.StandardButton.Close).setAutoDefault(False)
        changing = (self._change, self._add, self._clear, self._reset)
        buttons = row_of(*changing, STRETCH, every, close)
        head = row_of((self._search, 1), help_button("Keys", self))
        self.setLayout(column_of(head, (self._table, 1), self._warning, buttons))
        take_room(self, 760, 620)
        self._find()

    def _find(self) -> None:
        self._model.set_search(self._search.text())
        if self._model.rowCount():
            self._table.setCurrentIndex(self._model.index(0, KEYS))
        self._refresh()

    def _begin(self, besides: bool = False) -> None:
        """Wait for a key in the current row."""
        self._warning.clear()
        if not self._change.isEnabled():
            return
        table, cell, field = self._table, self._model.index(self._row, KEYS), KeyCapture(self)

        def end() -> None:
            table.setFocus()
            field.hide()
            field.deleteLater()

        def take(key: str) -> None:
            end()
            self._attempt(lambda _: self._model.change(cell.row(), key, besides=besides))

        field.given_up.connect(end)
        field.captured.connect(take)
        table.setIndexWidget(cell, field)
        field.setFocus()

    def _attempt(self, change: Callable[[int], None]) -> None:
        """Change the current row, or say why that is refused."""
        self._warning.clear()
        try:
            change(self._row)
        except Sd2Error as error:
            self._warning.setText(str(error))

    @property
    def _row(self) -> int:
        return self._table.currentIndex().row()

    def _refresh(self) -> None:
        is_row = 0 <= self._row < self._model.rowCount()
        can = is_row and self._model.can_change(self._row)
        for button in (self._change, self._clear):
            button.setEnabled(can)
        self._add.setEnabled(can and bool(self._model.rows[self._row].action))
        self._reset.setEnabled(can and not self._model.is_usual(self._row))


class KeyTable(CellTable):
    """The list; Tab leaves it, Escape closes the dialog."""

    def __init__(self, model: KeyListModel, parent: QWidget) -> None:
        super().__init__("Keys", parent=parent)
        self.setModel(model)
        self.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self.setSelectionMode(QAbstractItemView.SelectionMode.SingleSelection)
        self.setTabKeyNavigation(False)
        header = self.horizontalHeader()
        header.setStretchLastSection(False)
        header.setSectionResizeMode(0, QHeaderView.ResizeMode.ResizeToContents)
        header.setSectionResizeMode(1, QHeaderView.ResizeMode.Stretch)
        self.setColumnWidth(KEYS, _KEYS_PX)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Return waits for another key."""
        if event.key() == Qt.Key.Key_Escape:
            event.ignore()
            return
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter, Qt.Key.Key_F2):
            self.activated.emit(self.currentIndex())
        else:
            super().keyPressEvent(event)


class KeyCapture(QLineEdit):
    """A field that takes the next key for what it is, instead of doing what it does.

    Escape leaves everything as it was.
    """

    captured = Signal(str)  # the key that was pressed, as Qt writes it
    given_up = Signal()  # Escape

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self.setReadOnly(True)
        self.setContextMenuPolicy(Qt.ContextMenuPolicy.NoContextMenu)
        self.setPlaceholderText("Press a key; Esc: leave it")
        self.setAccessibleName("Press the new key, or Escape to leave it as it is")

    def event(self, event: QEvent) -> bool:
        """Claim every key before it is taken for that of an action, Tab too."""
        if event.type() == QEvent.Type.ShortcutOverride:
            event.accept()
            return True
        if event.type() == QEvent.Type.KeyPress and isinstance(event, QKeyEvent):
            self.keyPressEvent(event)
            return True
        return super().event(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Take it."""
        key = Qt.Key(event.key())
        if key in _MODIFIERS or key == Qt.Key.Key_unknown or key.name.startswith("Key_Dead_"):
            return
        if key == Qt.Key.Key_Escape and not event.modifiers():
            self.given_up.emit()
            return
        self.captured.emit(_written(event))


def _written(event: QKeyEvent) -> str:
    modifiers = event.modifiers() & ~_KEYPAD
    text = event.text()
    # Shift that only reaches a sign, as for "?", is not part of the key.
    if text and text.isprintable() and not text.isalnum() and not text.isspace():
        modifiers &= ~Qt.KeyboardModifier.ShiftModifier
    combination = QKeyCombination(modifiers, Qt.Key(event.key()))
    return QKeySequence(combination).toString(QKeySequence.SequenceFormat.PortableText)
