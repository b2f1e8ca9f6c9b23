"""Display settings: levels, colours, theme; layouts for what one does, and what each shows."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal, NamedTuple, TypeVar

from PySide6.QtCore import QByteArray, QObject, Signal

from sd2app.palette import Palette, palette_for
from sd2app.settings import Settings

T = TypeVar("T")

MeshColour = Literal["velocity", "range", "visibility", "plain"]
Scale = Literal["dB", "linear"]
COLOUR_MAPS = ("viridis", "cividis", "magma", "inferno", "gray")


@dataclass(frozen=True)
class HeatmapLevels:
    """One level control for all heatmaps.

    A map is shown relative to its own reference (the 99.9th percentile of its
    non-zero values over the whole clip), because counted shares and received
    power have no common unit; the levels below that reference are absolute and
    shared.
    """

    scale: Scale = "dB"
    low_db: float = -30.0
    high_db: float = 0.0
    colour_map: str = "viridis"

    @property
    def ends(self) -> tuple[float, float, str]:
        """First and last value of the scale, and their unit; relative to the reference."""
        if self.scale == "dB":
            return self.low_db, self.high_db, "dB"
        return 0.0, 100.0 * 10.0 ** (self.high_db / 10.0), "%"


class DisplayModel(QObject):
    """Choices that change no data. Others read the attributes; the methods change them."""

    levels_changed = Signal()
    mesh_changed = Signal()
    theme_changed = Signal()

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.levels = HeatmapLevels()
        self.mesh_colour: MeshColour = "velocity"  # quantity that the colour of the mesh shows
        self.as_dots = False  # vertices are drawn instead of the surface
        self.dark = False
        self.palette: Palette = palette_for(False)  # colours of the theme that is on

    def set_levels(self, **changes: object) -> None:
        """Change some of the levels."""
        levels = replace(self.levels, **changes)  # type: ignore[arg-type]
        if levels.high_db - levels.low_db < 1.0:
            # The end that was moved pushes the other along.
            if "low_db" in changes:
                levels = replace(levels, high_db=levels.low_db + 1.0)
            else:
                levels = replace(levels, low_db=levels.high_db - 1.0)
        if levels != self.levels:
            self.levels = levels
            self.levels_changed.emit()

    def set_mesh_colour(self, colour: MeshColour) -> None:
        """Choose what the colour of the mesh means."""
        if colour != self.mesh_colour:
            self.mesh_colour = colour
            self.mesh_changed.emit()

    def set_as_dots(self, as_dots: bool) -> None:
        """Draw vertices as dots, or the surface."""
        if as_dots != self.as_dots:
            self.as_dots = as_dots
            self.mesh_changed.emit()

    def set_dark(self, dark: bool) -> None:
        """Choose the theme."""
        if dark != self.dark:
            self.dark, self.palette = dark, palette_for(dark)
            self.theme_changed.emit()


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
        ("video", "scene", "over"), 320, "Sensor", True,
    ),
    "Label": Layout(
        "Video and maps over the spans: mark what happens", ("video", "over"), 320, "Labels", True
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
        return self.kept(pane, pane in self.usual.panes)

    def show(self, pane: str, shown: bool) -> None:
        """Give the layout a pane, or take it away."""
        self.keep(pane, shown)
        self.panes_changed.emit()

    def kept(self, name: str, usual: T) -> T:
        """Value kept for the layout under a name."""
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
