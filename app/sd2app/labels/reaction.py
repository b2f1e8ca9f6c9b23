"""Reaction time of the user, by which marks are put back."""

from __future__ import annotations

from PySide6.QtCore import QObject, Signal

from sd2app.settings import Settings
from sd2core.labels.free_time import LONGEST_REACTION_S

LONGEST_MS = round(1000 * LONGEST_REACTION_S)
OFFERED_MS = (0, 100, 150, 200, 250, 300, 400)
_NAME = "reaction_ms"


class ReactionModel(QObject):
    """The user's reaction time, kept in the settings."""

    changed = Signal()

    def __init__(self, settings: Settings, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._settings = settings

    @property
    def reaction_ms(self) -> int:
        """Reaction time, 0 to :data:`LONGEST_MS`."""
        return min(max(self._settings.stored(_NAME, 0), 0), LONGEST_MS)

    @property
    def reaction_s(self) -> float:
        """Reaction time in seconds."""
        return self.reaction_ms / 1000.0

    def set_reaction_ms(self, reaction_ms: int) -> None:
        """Set the reaction time."""
        if reaction_ms != self.reaction_ms:
            self._settings.set_value(_NAME, min(max(reaction_ms, 0), LONGEST_MS))
            self.changed.emit()
