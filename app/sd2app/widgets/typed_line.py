"""A field that is typed into."""

from __future__ import annotations

from PySide6.QtCore import QEvent, Qt, Signal
from PySide6.QtGui import QFocusEvent, QKeyEvent
from PySide6.QtWidgets import QLineEdit, QWidget

from sd2app.widgets.own_keys import claims

_OWN_KEYS = (Qt.Key.Key_Escape, Qt.Key.Key_Return, Qt.Key.Key_Enter)


class TypedLine(QLineEdit):
    """Says what is typed while it is typed; Escape takes it back.

    Return and Escape give the keyboard back to the window.

    Signals
    -------
    typed : str
        What it holds now.
    ended
        The keyboard is elsewhere again.
    """

    typed = Signal(str)
    ended = Signal()

    def __init__(self, name: str, tip: str, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setAccessibleName(name)
        self.setToolTip(tip)
        self._before = ""
        self.textEdited.connect(self.typed)

    def show_text(self, text: str) -> None:
        """Follow a model."""
        if text != self.text():
            self.setText(text)

    def event(self, event: QEvent) -> bool:
        """Escape and Return are its own."""
        return claims(event, _OWN_KEYS) or super().event(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Return and Escape end the typing."""
        if event.key() == Qt.Key.Key_Escape:
            if self.text() != self._before:
                self.setText(self._before)
                self.typed.emit(self._before)
            self.clearFocus()
        elif event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            self.clearFocus()
        else:
            super().keyPressEvent(event)

    def focusInEvent(self, event: QFocusEvent) -> None:
        """Typing may begin."""
        self._before = self.text()
        super().focusInEvent(event)

    def focusOutEvent(self, event: QFocusEvent) -> None:
        """Typing has ended."""
        super().focusOutEvent(event)
        self.ended.emit()
