"""Settings of the mesh over the video, kept between sessions."""

from __future__ import annotations

from dataclasses import dataclass

from PySide6.QtCore import QObject, Signal

from sd2app.settings import Settings, StoredChoices


@dataclass(frozen=True)
class OverlayStyle:
    """Style of the mesh over the video."""

    shown: bool = True
    opacity: float = 0.5  # from 0 (invisible) to 1 (it hides the person)
    as_dots: bool = False  # vertices instead of the surface


class OverlayModel(QObject):
    """Choices that change no data and are the user's own, not the recording's."""

    changed = Signal()

    def __init__(self, settings: Settings, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._stored = StoredChoices(settings, "overlay", vars(OverlayStyle()))
        if not 0 <= self._stored["opacity"] <= 1:
            self._stored.set("opacity", OverlayStyle.opacity)

    @property
    def style(self) -> OverlayStyle:
        """Style of the mesh."""
        return OverlayStyle(**{name: self._stored[name] for name in self._stored.defaults})

    def set_style(self, **changes: float) -> None:
        """Change some of it, and remember it."""
        if "opacity" in changes:
            changes["opacity"] = min(max(changes["opacity"], 0.0), 1.0)
        changed = [self._stored.set(name, value) for name, value in changes.items()]
        if any(changed):
            self.changed.emit()
