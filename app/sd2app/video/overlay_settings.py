"""Settings of the mesh over the video, kept between sessions."""

from __future__ import annotations

from dataclasses import dataclass, replace

from PySide6.QtCore import QObject, Signal

from sd2app.settings import Settings


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
        self._settings = settings
        self._style = OverlayStyle(
            shown=settings.flag("overlay/shown", OverlayStyle.shown),
            opacity=settings.share("overlay/opacity", OverlayStyle.opacity),
            as_dots=settings.flag("overlay/as_dots", OverlayStyle.as_dots),
        )

    @property
    def style(self) -> OverlayStyle:
        """Style of the mesh."""
        return self._style

    def set_style(self, **changes: object) -> None:
        """Change some of it, and remember it."""
        style = replace(self._style, **changes)  # type: ignore[arg-type]
        style = replace(style, opacity=min(max(style.opacity, 0.0), 1.0))
        if style == self._style:
            return
        self._style = style
        for name, value in vars(style).items():
            self._settings.set_value(f"overlay/{name}", value)
        self.changed.emit()
