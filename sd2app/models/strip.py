"""A strip of frames in the making: choices, a preview, the file."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, Signal

from sd2app.jobs.latest import Emit, LatestRunner
from sd2app.models.content import UNTITLED, Content
from sd2core.errors import Sd2Error
from sd2core.figures.frames import frames_around, parse_frames, spread_frames
from sd2core.figures.strip_source import MOST_FRAMES, Row, StripOptions, StripSource

Way = Literal["spread", "around", "list"]
_PREVIEW_DPI = 110


@dataclass(frozen=True)
class StripChoice:
    """What the user chose.

    Parameters
    ----------
    way : str
        Frames ``spread`` evenly, ``around`` the cursor, or a ``list``.
    count, step : int
        How many, and how many frames apart around the cursor.
    text : str
        The list, as on the command line.
    """

    way: Way = "spread"
    count: int = 8
    step: int = 5
    text: str = "0:60:10"


class StripModel(QObject):
    """Draws a preview whenever something is chosen; the newest choice wins.

    Signals
    -------
    changed
        A choice, or whether it is being drawn.
    drawn
        Another preview.
    written : Path
        The file is there.
    """

    changed = Signal()
    drawn = Signal()
    written = Signal(object)

    def __init__(self, content: Content, cursor_s: float, parent: QObject | None = None) -> None:
        super().__init__(parent)
        recording = content.recording
        named = recording.title if recording.folder == UNTITLED else str(recording.folder)
        self.source = StripSource.of(recording, content.video, content.mesh, named)
        self._cursor = self.source.clock.frame_at(cursor_s)
        self._choice = StripChoice()
        there = {"video": content.video, "mesh": content.mesh}
        rows: Any = tuple(row for row, part in there.items() if part is not None)
        self._options = StripOptions(rows=rows)
        self._picture: NDArray[np.uint8] | None = None
        self._problem = ""
        self._runner = LatestRunner("strip", self)
        self._runner.finished.connect(self._receive)
        self._runner.failed.connect(self._refuse)
        self._runner.idle_changed.connect(lambda _: self.changed.emit())
        self._exporting = False
        self._draw()

    # --- what is there --------------------------------------------------------------------

    @property
    def choice(self) -> StripChoice:
        """Which frames."""
        return self._choice

    @property
    def options(self) -> StripOptions:
        """How they are drawn."""
        return self._options

    @property
    def available(self) -> tuple[Row, ...]:
        """Rows that can be drawn."""
        video, mesh = self.source.video is not None, self.source.mesh is not None
        rows: dict[Row, bool] = {"video": video, "mesh": mesh, "overlay": video and mesh}
        return tuple(row for row, there in rows.items() if there)

    @property
    def picture(self) -> NDArray[np.uint8] | None:
        """The preview, RGBA of shape (H, W, 4)."""
        return self._picture

    @property
    def problem(self) -> str:
        """Why it cannot be drawn."""
        return self._problem

    @property
    def busy(self) -> bool:
        """Whether it is being drawn or written."""
        return self._runner.busy

    @property
    def exporting(self) -> bool:
        """Whether it is being written."""
        return self._exporting

    def frames(self) -> list[int]:
        """The frames of the strip; raises Sd2Error where the list is none."""
        total, choice = len(self.source.clock), self._choice
        if choice.way == "list":
            return parse_frames(choice.text, total)
        if choice.way == "around":
            return frames_around(self._cursor, choice.count, choice.step, total)
        return spread_frames(choice.count, total)

    # --- choosing -------------------------------------------------------------------------

    def choose(self, **changes: object) -> None:
        """Choose other frames."""
        choice = replace(self._choice, **changes)  # type: ignore[arg-type]
        count = min(max(choice.count, 1), MOST_FRAMES)
        choice = replace(choice, count=count, step=max(choice.step, 1))
        if choice != self._choice:
            self._choice = choice
            self._draw()

    def set_options(self, **changes: object) -> None:
        """Draw them otherwise."""
        try:
            options = replace(self._options, **changes)  # type: ignore[arg-type]
        except Sd2Error:
            self.changed.emit()  # the last row cannot be taken away
            return
        if options != self._options:
            self._options = options
            self._draw()

    def set_row(self, row: Row, shown: bool) -> None:
        """Show a row, or not; rows keep their order."""
        rows = {*self._options.rows, row} if shown else {*self._options.rows} - {row}
        self.set_options(rows=tuple(name for name in self.available if name in rows))

    def export(self, path: Path) -> None:
        """Write the strip."""
        try:
            frames = self.frames()
        except Sd2Error as error:
            self._refuse(error)
            return
        source, options = self.source, self._options

        def write(emit: Emit) -> Path:
            from sd2core.figures.strip import plot_strip, save_strip

            figure = plot_strip(source, frames, options, lambda *_: emit(None))
            save_strip(figure, path, source, frames, options)
            return path

        self._exporting = True
        self._runner.submit(write)
        self.changed.emit()

    def close(self) -> None:
        """Stop drawing."""
        self._runner.close()

    # --- inside ---------------------------------------------------------------------------

    def _draw(self) -> None:
        self._problem = ""
        try:
            frames = self.frames()
        except Sd2Error as error:
            self._runner.cancel()
            self._refuse(error)
            return
        source, options = self.source, self._options

        def draw(emit: Emit) -> NDArray[np.uint8]:
            from matplotlib.backends.backend_agg import FigureCanvasAgg

            from sd2core.figures.strip import plot_strip

            figure = plot_strip(source, frames, options, lambda *_: emit(None))
            figure.set_dpi(_PREVIEW_DPI)
            canvas = FigureCanvasAgg(figure)
            canvas.draw()
            return np.array(canvas.buffer_rgba())

        self._runner.submit(draw)
        self.changed.emit()

    def _receive(self, result: Any) -> None:
        if isinstance(result, Path):
            self._exporting = False
            self.changed.emit()
            self.written.emit(result)
            return
        self._picture = result
        self.drawn.emit()

    def _refuse(self, error: Exception) -> None:
        self._exporting = False
        self._problem = str(error)
        self.changed.emit()
