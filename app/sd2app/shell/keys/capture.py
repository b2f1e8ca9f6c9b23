"""A field that takes the next key pressed for what it is, instead of doing what it does."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QKeyCombination, Qt, Signal
from PySide6.QtGui import QKeyEvent, QKeySequence
from PySide6.QtWidgets import QLineEdit, QWidget

_MODIFIERS = (
    Qt.Key.Key_Shift,
    Qt.Key.Key_Control,
    Qt.Key.Key_Alt,
    Qt.Key.Key_AltGr,
    Qt.Key.Key_Meta,
    Qt.Key.Key_CapsLock,
)
_KEYPAD = Qt.KeyboardModifier.KeypadModifier


class KeyCapture(QLineEdit):
    """Escape leaves everything as it was.

    Signals
    -------
    captured : str
        The key that was pressed, as Qt writes it.
    given_up
        Escape.
    """

    captured = Signal(str)
    given_up = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
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
        if key in _MODIFIERS or key == Qt.Key.Key_unknown:
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
