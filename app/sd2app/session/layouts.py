"""Layouts for what one does: which panes each shows, and how wide."""

from __future__ import annotations

from typing import NamedTuple

from PySide6.QtCore import QByteArray, QObject, Signal

from sd2app.settings import Settings

_KEPT = "layouts/shown"


class Layout(NamedTuple):
    """How a layout is until the user changes it."""

    tip: str
    panes: tuple[str, ...]  # that are shown where they have content; "over": the side panel so
    views_px: int  # width of video and scene, which stand beside the maps
    panel: str  # open at the side
    folded: bool  # to its icons


LAYOUTS = {
    "Look": Layout(
        "Video, scene and maps: move the sensor, and see what follows",
        ("video", "scene", "over"), 384, "Sensor", True,
    ),
    "Label": Layout(
        "Video and maps over the spans: mark what happens", ("video", "over"), 384, "Labels", True
    ),
    "Learn": Layout(
        "Maps beside the panel that trains denoisers and classifiers", (), 384, "Train", False
    ),
    "Capture": Layout(
        "Video and what the radar measures: record both", ("video", "over"), 560, "Sensor", True
    ),
}  # fmt: skip


class Layouts(QObject):
    """The layout in use, and what the user made of each; kept in the settings."""

    leaving = Signal()
    """Sizes are to be kept, before another layout is shown."""
    changed = Signal()  # another layout
    panes_changed = Signal()  # another pane of the same one

    def __init__(self, settings: Settings, parent: QObject) -> None:
        super().__init__(parent)
        self._settings = settings
        kept = settings.stored(_KEPT, "")
        self.name = kept if kept in LAYOUTS else next(iter(LAYOUTS))

    @property
    def usual(self) -> Layout:
        """The layout in use as it was before the user changed it."""
        return LAYOUTS[self.name]

    def choose(self, name: str) -> None:
        """Show another layout."""
        if name != self.name:
            self.leaving.emit()
            self.name = name
            self._settings.set_value(_KEPT, name)
            self.changed.emit()

    def shows(self, pane: str) -> bool:
        """True where the layout has a pane."""
        return self.flag(pane, pane in self.usual.panes)

    def show(self, pane: str, shown: bool) -> None:
        """Give the layout a pane, or take it away."""
        self.keep(pane, shown)
        self.panes_changed.emit()

    def flag(self, name: str, usual: bool) -> bool:
        """What is kept for the layout under a name."""
        return self._settings.flag(self._place(name), usual)

    def text(self, name: str, usual: str) -> str:
        """Text that is kept for the layout under a name."""
        return self._settings.stored(self._place(name), usual)

    def keep(self, name: str, value: bool | str) -> None:
        """Keep something for the layout."""
        self._settings.set_value(self._place(name), value)

    def sizes(self, name: str) -> QByteArray | None:
        """Sizes that a splitter had in the layout."""
        return self._settings.layout(f"{self.name}/{name}")

    def keep_sizes(self, name: str, state: QByteArray) -> None:
        """Keep the sizes of a splitter for the layout."""
        self._settings.set_layout(f"{self.name}/{name}", state)

    def _place(self, name: str) -> str:
        return f"layouts/{self.name}/{name}"
