"""Mode of the window, in which the mouse does something else until the user ends it."""

from __future__ import annotations

from PySide6.QtCore import QObject, Signal


class Mode(QObject):
    """On from the user's request until what was asked for is done, or is given up."""

    changed = Signal()

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self.active = False

    def end(self) -> None:
        """Switch it off."""
        if self.active:
            self.toggle()

    def toggle(self) -> None:
        """Switch it on or off."""
        self.active = not self.active
        self.changed.emit()
