"""Mode in which a click on the body places an inertial sensor."""

from __future__ import annotations

from PySide6.QtCore import QObject, Signal


class PlacingModel(QObject):
    """On from the user's request until the click, or until the user gives it up."""

    changed = Signal()

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self.active = False

    def begin(self) -> None:
        """Wait for the click."""
        self._set(True)

    def end(self) -> None:
        """Wait no more."""
        self._set(False)

    def _set(self, active: bool) -> None:
        if active != self.active:
            self.active = active
            self.changed.emit()
