"""Display settings: levels, colours, theme."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from PySide6.QtCore import QObject, Signal

from sd2app.palette import Palette, palette_for

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
