"""Figures of maps and strips of frames: choices, preview, export."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, Signal

from sd2app.background.latest import Emit, LatestRunner, ProblemModel
from sd2app.maps.difference import DifferenceModel
from sd2app.session.content import UNTITLED, Content, folder_for_command
from sd2app.session.session import Session
from sd2app.widgets.text import quoted
from sd2core.cli.labels.recording import DrawnLabels
from sd2core.cli.strip import Strip
from sd2core.errors import Sd2Error
from sd2core.figures.maps import Levels, MapRow, draw_maps, save_maps
from sd2core.figures.strip_source import (
    Row,
    StripOptions,
    StripSource,
    frames_around,
    parse_frames,
    spread_frames,
)
from sd2core.files.figure_files import check_figure
from sd2core.labels.spans import Labels
from sd2core.options.bounds import STRIP_FRAMES
from sd2core.options.records import words_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_PREVIEW_DPI = 110

Plot = Callable[[Emit], "Figure"]
Save = Callable[["Figure", Path], None]


class DrawnFigure(ProblemModel):
    """Draws what is chosen in the background; the newest choice wins.

    ``choice`` is a frozen record; a figure says in :meth:`_recipe` how it is drawn and saved.
    """

    drawn = Signal()  # another preview
    written = Signal(object)  # Path
    failed = Signal(str)  # to write it; the picture stays

    def __init__(self, name: str, choice: Any, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.choice = choice
        self.picture: NDArray[np.uint8] | None = None  # the preview, RGBA of shape (H, W, 4)
        self.exporting = False  # the figure is being written
        self._runner = LatestRunner(name, self, self._receive, self._refuse)
        self._runner.idle_changed.connect(lambda _: self.changed.emit())

    def choose(self, **changes: object) -> None:
        """Change the content of the figure."""
        choice = replace(self.choice, **changes)
        if choice != self.choice:
            self.choice = choice
            self._draw()

    def export(self, path: Path) -> None:
        """Write the figure, by the ending of its name."""
        try:
            check_figure(path)
            plot, save = self._recipe()
        except Sd2Error as error:
            self.failed.emit(str(error))
            return

        def write(emit: Emit) -> Path:
            save(plot(emit), path)
            return path

        self.exporting = True
        self._runner.submit(write)
        self.changed.emit()

    def _recipe(self) -> tuple[Plot, Save]:
        """Functions that draw and save what is chosen now; raises Sd2Error if nothing can be."""
        raise NotImplementedError

    def _draw(self) -> None:
        if self.exporting:  # what is chosen meanwhile does not end that
            self.changed.emit()
            return
        try:
            plot, _ = self._recipe()
        except Sd2Error as error:
            self._refuse(error)
            return

        def draw(emit: Emit) -> NDArray[np.uint8]:
            from matplotlib.backends.backend_agg import FigureCanvasAgg

            figure = plot(emit)
            figure.set_dpi(_PREVIEW_DPI)
            canvas = FigureCanvasAgg(figure)
            canvas.draw()
            return np.array(canvas.buffer_rgba())

        self.problem = ""
        self._runner.submit(draw)
        self.changed.emit()

    def _receive(self, result: Any) -> None:
        if isinstance(result, Path):
            self.exporting = False
            self.changed.emit()
            self.written.emit(result)
        else:
            self.picture = result
            self.drawn.emit()

    def _refuse(self, error: Exception) -> None:
        self._runner.cancel()
        if self.exporting:
            self.exporting = False
            self.changed.emit()
            self.failed.emit(str(error))
            self._draw()
        else:
            super()._refuse(error)


@dataclass(frozen=True)
class MapChoice:
    """Content of a figure of maps."""

    left_out: frozenset[str] = frozenset()  # titles of hidden maps
    whole: bool = False  # the whole recording instead of the time window
    with_labels: bool = True
    with_difference: bool = True  # if the difference to the radar is on screen


class MapFigure(DrawnFigure):
    """Draws the maps as they are when it is made, one above the other.

    ``denoiser`` is the denoiser in words.
    """

    def __init__(
        self,
        session: Session,
        difference: DifferenceModel,
        labels: Labels,
        denoiser: str,
        parent: QObject,
    ) -> None:
        super().__init__("figure", MapChoice(), parent)
        s, levels, clock = session, session.display.levels, session.playback.timebase
        notes = {s.maps.denoised: denoiser, s.maps.before: s.maps.before.status}
        self._recording = s.document.recording
        self._named = {one.title: one.name for one in s.maps.all if one.name}
        # By titles; those without a map are left out.
        self._rows = {
            track.title: MapRow(
                track.map,
                " · ".join(filter(None, (track.title, notes.get(track, "")))),
                track.reference,
                track.offset_s,
            )
            for track in s.maps.all
            if track.map is not None
        }
        self._pair: tuple[str, str] | None = None
        if difference.shown:
            self._pair = difference.denoised.title, difference.real.title
        self.has_difference = difference.shown  # the difference to the radar is on screen
        self._levels = Levels(levels.scale, levels.low_db, levels.high_db, levels.colour_map)
        self._labels = labels
        self.has_labels = bool(labels.spans)  # there are labels to draw
        self._view_s = s.span.start_s, s.span.end_s
        self._whole_s = clock.start_s, clock.end_s
        self._heading = f"{s.document.title}{' (simulated)' if s.document.simulated else ''}"
        self._about = {
            "recording": s.document.title,
            "simulated": s.document.simulated,
            "sensor_position_m": list(s.sensor.sensor.position_m),
            "denoiser": denoiser,
            "synthetic": s.maps.synthetic.status,
        }
        self._draw()

    @property
    def titles(self) -> tuple[str, ...]:
        """Maps that can be shown."""
        return tuple(self._rows)

    @property
    def line(self) -> str:
        """Command for a terminal that draws these maps of the saved recording."""
        assert self._recording is not None
        shown = [title for title in self._rows if title not in self.choice.left_out]
        from_s, to_s = (None, None) if self.choice.whole else self._view_s
        drawn = DrawnLabels(
            recording=folder_for_command(self._recording),
            out=Path("maps.png"),
            maps=",".join(self._named[title] for title in shown if title in self._named) or None,
            from_s=from_s,
            to_s=to_s,
        )
        return quoted(words_of("labels figure", drawn))

    def set_shown(self, title: str, shown: bool) -> None:
        """Show a map, or leave it out."""
        left_out = self.choice.left_out
        self.choose(left_out=left_out - {title} if shown else left_out | {title})

    def _recipe(self) -> tuple[Plot, Save]:
        choice, levels, heading, about = self.choice, self._levels, self._heading, self._about
        titles = [title for title in self._rows if title not in choice.left_out]
        rows = [self._rows[title] for title in titles]
        if not rows:
            raise Sd2Error("No map is chosen", "at least one")
        pair: tuple[int, int] | None = None
        if self._pair is not None and choice.with_difference and {*self._pair} <= {*titles}:
            pair = titles.index(self._pair[0]), titles.index(self._pair[1])
        labels = self._labels if choice.with_labels else None
        start_s, end_s = self._whole_s if choice.whole else self._view_s

        def plot(emit: Emit) -> Figure:
            return draw_maps(
                rows,
                levels,
                start_s=start_s,
                end_s=end_s,
                difference=pair,
                labels=labels,
                heading=heading,
            )

        return plot, lambda figure, path: save_maps(figure, path, rows, about)


@dataclass(frozen=True)
class StripChoice:
    """Frames and layout of a strip, as the user chose them."""

    way: Literal["spread", "around", "list"] = "spread"  # evenly, around the cursor, or a list
    count: int = 8
    step: int = 5  # in frames, around the cursor
    text: str = "0:60:10"  # the list, as on the command line
    options: StripOptions = field(default_factory=StripOptions)  # the layout


class StripModel(DrawnFigure):
    """Draws frames side by side, the video above its mesh."""

    def __init__(self, content: Content, cursor_s: float, parent: QObject | None = None) -> None:
        recording = content.recording
        parts = {"video": content.video, "mesh": content.mesh}
        rows: Any = tuple(row for row, part in parts.items() if part is not None)
        super().__init__("strip", StripChoice(options=StripOptions(rows=rows)), parent)
        named = recording.title if recording.folder == UNTITLED else str(recording.folder)
        self.source = StripSource.of(recording, content.video, content.mesh, named)
        self._recording = recording
        self._cursor = self.source.clock.frame_at(cursor_s)
        self._draw()

    @property
    def line(self) -> str:
        """Command for a terminal that draws the strip of the saved recording."""
        choice, options = self.choice, self.options
        spread = choice.way == "spread"
        strip = Strip(
            paths=(folder_for_command(self._recording),),
            out=Path("strip.png"),
            frames=None if spread else ",".join(map(str, self.frames())),
            count=choice.count if spread else None,
            rows=",".join(options.rows),
            dots=options.as_dots,
            colour=options.colour,
            v_max_mps=options.v_max_mps,
            whole=options.whole,
            columns=options.columns,
        )
        return quoted(words_of("strip", strip))

    @property
    def options(self) -> StripOptions:
        """Chosen layout."""
        return self.choice.options

    @property
    def available(self) -> tuple[Row, ...]:
        """Rows that can be drawn."""
        video, mesh = self.source.video is not None, self.source.mesh is not None
        rows: dict[Row, bool] = {"video": video, "mesh": mesh, "overlay": video and mesh}
        return tuple(row for row, can_draw in rows.items() if can_draw)

    def frames(self) -> list[int]:
        """The frames of the strip; raises Sd2Error where the list is none."""
        total, choice = len(self.source.clock), self.choice
        if choice.way == "list":
            return parse_frames(choice.text, total)
        if choice.way == "around":
            return frames_around(self._cursor, choice.count, choice.step, total)
        return spread_frames(choice.count, total)

    def choose(self, **changes: object) -> None:
        """Choose other frames, no more than can be drawn."""
        choice = replace(self.choice, **changes)
        count = int(STRIP_FRAMES.nearest(choice.count))
        super().choose(**{**changes, "count": count, "step": max(choice.step, 1)})

    def set_options(self, **changes: object) -> None:
        """Change the layout."""
        try:
            self.choose(options=replace(self.options, **changes))  # type: ignore[arg-type]
        except Sd2Error:
            self.changed.emit()  # the last row cannot be taken away

    def set_row(self, row: Row, shown: bool) -> None:
        """Show a row, or not; rows keep their order."""
        rows = {*self.options.rows, row} if shown else {*self.options.rows} - {row}
        self.set_options(rows=tuple(name for name in self.available if name in rows))

    def _recipe(self) -> tuple[Plot, Save]:
        source, options, frames = self.source, self.options, self.frames()

        def plot(emit: Emit) -> Figure:
            from sd2core.figures.strip import plot_strip

            return plot_strip(source, frames, options, lambda *_: emit(None))

        def save(figure: Figure, path: Path) -> None:
            from sd2core.figures.strip import save_strip

            save_strip(figure, path, source, frames, options)

        return plot, save
