"""Dialog of all keys: found, changed, reset."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from PySide6.QtCore import QEvent, QKeyCombination, Qt, Signal
from PySide6.QtGui import QKeyEvent, QKeySequence, QShortcut
from PySide6.QtWidgets import (
    QDialogButtonBox,
    QHeaderView,
    QLineEdit,
    QTreeWidgetItem,
    QWidget,
)

from sd2app.manual.help import help_button
from sd2app.shell.keys.model import KeyList, KeyRow
from sd2app.widgets.dialogs import Dialog, closing, take_room
from sd2app.widgets.inputs import SearchLine
from sd2app.widgets.layouts import STRETCH, column_of, row_of
from sd2app.widgets.panel import outlined, sentence
from sd2app.widgets.table import entry_list
from sd2core.errors import Sd2Error

_KEYS, _KEYS_PX = 2, 250
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

    def __init__(self, keys: KeyList, parent: QWidget) -> None:
        super().__init__("Keys", parent)
        self._keys = keys
        self._rows: list[KeyRow] = []
        self._waiting: int | None = None  # row that waits for a key
        self._search = SearchLine("Search actions and keys", self)
        self._search.textChanged.connect(self._fill)
        self._list = entry_list("Keys", ("Menu", "What it does", "Keys"), 1, self)
        self._list.header().setSectionResizeMode(_KEYS, QHeaderView.ResizeMode.Interactive)
        self._list.setColumnWidth(_KEYS, _KEYS_PX)
        self._list.itemActivated.connect(lambda: self._begin())
        QShortcut(QKeySequence(Qt.Key.Key_F2), self._list, lambda: self._begin())
        self._list.currentItemChanged.connect(self._refresh)
        self._warning = sentence("", "warning")
        add, tip = partial(self._begin, besides=True), "Wait for a key besides"
        self._change = outlined("Change", "Wait for another key", self._begin, self)
        self._add = outlined("Add", tip, add, self)
        clear, reset = partial(self._attempt, keys.clear), partial(self._attempt, keys.reset)
        self._clear = outlined("Remove", "Leave it without a key", clear, self)
        self._reset = outlined("Reset", "Give it its usual keys back", reset, self)
        tip = "Give everything its usual keys"
        every = outlined("Reset all", tip, keys.bindings.reset_all, self)
        close = closing(self)
        close.button(QDialogButtonBox.StandardButton.Close).setAutoDefault(False)
        changing = (self._change, self._add, self._clear, self._reset)
        buttons = row_of(*changing, STRETCH, every, close)
        head = row_of((self._search, 1), help_button("Keys", self))
        self.setLayout(column_of(head, (self._list, 1), self._warning, buttons))
        take_room(self, 760, 620)
        keys.bindings.changed.connect(self._fill)
        self._fill()

    @property
    def _row(self) -> KeyRow | None:
        place = self._list.currentIndex().row()
        return self._rows[place] if 0 <= place < len(self._rows) else None

    def _fill(self) -> None:
        """List what the search leaves; the row that was current stays so."""
        current, self._rows = self._row, self._keys.rows(self._search.text())
        scrolled, self._waiting = self._list.verticalScrollBar().value(), None
        self._list.clear()
        for row in self._rows:
            item = QTreeWidgetItem(self._list, [row.menu, row.text, self._keys.keys_text(row)])
            font = item.font(_KEYS)
            font.setBold(not self._keys.is_usual(row))
            item.setFont(_KEYS, font)
            for column in range(item.columnCount()):
                item.setToolTip(column, row.tip)
        at = self._rows.index(current) if current in self._rows else 0
        self._list.setCurrentIndex(self._list.model().index(at, 0))
        if current in self._rows:
            self._list.verticalScrollBar().setValue(scrolled)
        self._refresh()

    def _begin(self, besides: bool = False) -> None:
        """Wait for a key in the current row."""
        self._warning.clear()
        row = self._row
        if row is None or row.mouse:
            return
        self._end_waiting()
        field, self._waiting = KeyCapture(self), self._list.currentIndex().row()

        def take(key: str) -> None:
            self._end_waiting()
            self._attempt(lambda _: self._keys.change(row, key, besides=besides))

        field.given_up.connect(self._end_waiting)
        field.captured.connect(take)
        self._list.setIndexWidget(self._list.currentIndex().siblingAtColumn(_KEYS), field)
        field.setFocus()

    def _end_waiting(self) -> None:
        if self._waiting is not None:
            item, self._waiting = self._list.topLevelItem(self._waiting), None
            self._list.setFocus()
            if item is not None:
                self._list.removeItemWidget(item, _KEYS)

    def _attempt(self, change: Callable[[KeyRow], None]) -> None:
        """Change the current row, or say why that is refused."""
        self._warning.clear()
        try:
            if self._row is not None:
                change(self._row)
        except Sd2Error as error:
            self._warning.setText(str(error))

    def _refresh(self) -> None:
        if self._waiting != self._list.currentIndex().row():
            self._end_waiting()
        row = self._row
        can = row is not None and not row.mouse
        for button in (self._change, self._clear):
            button.setEnabled(can)
        self._add.setEnabled(row is not None and bool(row.action))
        self._reset.setEnabled(row is not None and not self._keys.is_usual(row))


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
