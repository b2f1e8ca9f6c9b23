"""Figure of the maps and labels: choices, preview, export."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from PySide6.QtCore import QObject

from sd2app.figures.preview import DrawnFigure
from sd2app.maps.difference import DifferenceModel
from sd2app.session.display import HeatmapLevels
from sd2app.session.maps import MapModel
from sd2core.errors import Sd2Error
from sd2core.figures.maps import Levels, MapRow, draw_maps, save_maps
from sd2core.files.figure_files import check_figure
from sd2core.labels.spans import Labels

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class FigureChoice:
    """Content of a figure."""

    left_out: frozenset[str] = frozenset()  # titles of hidden maps
    whole: bool = False  # the whole recording instead of the time window
    with_labels: bool = True
    with_difference: bool = True  # if the difference to the radar is on screen


class FigureModel(DrawnFigure):
    """Draws the maps as they are when it is made.

    ``tracks`` are from top to bottom, each with a note beside its title; those without a map
    are left out. ``view_s`` is the time window, ``whole_s`` all of the recording. ``about``
    goes into the file and must fit into JSON; ``recording`` and ``simulated`` make its heading.
    """

    def __init__(
        self,
        tracks: Sequence[tuple[MapModel, str]],
        difference: DifferenceModel,
        levels: HeatmapLevels,
        labels: Labels,
        view_s: tuple[float, float],
        whole_s: tuple[float, float],
        about: dict[str, Any],
        parent: QObject | None = None,
    ) -> None:
        super().__init__("figure", parent)
        there = [(track, words) for track, words in tracks if track.map is not None]
        self._titles = tuple(track.title for track, _ in there)
        self._rows = tuple(
            MapRow(track.map, " · ".join(filter(None, (track.title, words))), track.reference,
                   track.offset_s)
            for track, words in there if track.map is not None
        )  # fmt: skip
        self._pair: tuple[str, str] | None = None
        if difference.shown:
            self._pair = difference.denoised.title, difference.real.title
        self._levels = Levels(levels.scale, levels.low_db, levels.high_db, levels.colour_map)
        self._labels, self._view_s, self._whole_s, self._about = labels, view_s, whole_s, about
        self._choice = FigureChoice()
        self._draw()

    @property
    def choice(self) -> FigureChoice:
        """Chosen content of the figure."""
        return self._choice

    @property
    def titles(self) -> tuple[str, ...]:
        """Maps that can be shown."""
        return self._titles

    @property
    def has_labels(self) -> bool:
        """True if there are labels."""
        return bool(self._labels.spans)

    @property
    def has_difference(self) -> bool:
        """True while the difference to the radar is on screen."""
        return self._pair is not None

    def choose(self, **changes: object) -> None:
        """Change the content of the figure."""
        choice = replace(self._choice, **changes)  # type: ignore[arg-type]
        if choice != self._choice:
            self._choice = choice
            self._draw()

    def set_shown(self, title: str, shown: bool) -> None:
        """Show a map, or leave it out."""
        left_out = self._choice.left_out
        self.choose(left_out=left_out - {title} if shown else left_out | {title})

    def export(self, path: Path) -> None:
        """Write the figure, by the ending of its name."""
        try:
            check_figure(path)
            rows, plot = self._shown(), self._plot()
        except Sd2Error as error:
            self._refuse(error)
            return
        about = self._about
        self._write(path, lambda emit: save_maps(plot(), path, rows, about))

    def _draw(self) -> None:
        try:
            plot = self._plot()
        except Sd2Error as error:
            self._refuse(error)
            return
        self._preview(lambda emit: plot())

    def _shown(self) -> list[MapRow]:
        left_out = self._choice.left_out
        pairs = zip(self._titles, self._rows, strict=True)
        return [row for title, row in pairs if title not in left_out]

    def _plot(self) -> Any:
        rows, choice, labels, levels = self._shown(), self._choice, self._labels, self._levels
        if not rows:
            raise Sd2Error("No map is chosen", "at least one")
        titles = [title for title in self._titles if title not in choice.left_out]
        pair: tuple[int, int] | None = None
        if self._pair is not None and choice.with_difference and {*self._pair} <= {*titles}:
            pair = titles.index(self._pair[0]), titles.index(self._pair[1])
        start_s, end_s = self._whole_s if choice.whole else self._view_s
        simulated = " (simulated)" if self._about["simulated"] else ""
        heading = f"{self._about['recording']}{simulated}"

        def plot() -> Figure:
            return draw_maps(
                rows,
                levels,
                start_s=start_s,
                end_s=end_s,
                difference=pair,
                labels=labels if choice.with_labels else None,
                heading=heading,
            )

        return plot
