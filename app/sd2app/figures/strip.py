"""Strip of frames: choices, preview, export."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from PySide6.QtCore import QObject

from sd2app.background.latest import Emit
from sd2app.figures.preview import DrawnFigure
from sd2app.session.content import UNTITLED, Content
from sd2core.errors import Sd2Error
from sd2core.figures.strip_source import (
    MOST_FRAMES,
    Row,
    StripOptions,
    StripSource,
    frames_around,
    parse_frames,
    spread_frames,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Way = Literal["spread", "around", "list"]


@dataclass(frozen=True)
class StripChoice:
    """Frames and layout of a strip, as the user chose them."""

    way: Way = "spread"  # spread evenly, around the cursor, or a list
    count: int = 8
    step: int = 5  # in frames, around the cursor
    text: str = "0:60:10"  # the list, as on the command line


class StripModel(DrawnFigure):
    """Draws a preview whenever something is chosen."""

    def __init__(self, content: Content, cursor_s: float, parent: QObject | None = None) -> None:
        super().__init__("strip", parent)
        recording = content.recording
        named = recording.title if recording.folder == UNTITLED else str(recording.folder)
        self.source = StripSource.of(recording, content.video, content.mesh, named)
        self._cursor = self.source.clock.frame_at(cursor_s)
        self._choice = StripChoice()
        there = {"video": content.video, "mesh": content.mesh}
        rows: Any = tuple(row for row, part in there.items() if part is not None)
        self._options = StripOptions(rows=rows)
        self._draw()

    # --- what is there --------------------------------------------------------------------

    @property
    def choice(self) -> StripChoice:
        """Chosen frames."""
        return self._choice

    @property
    def options(self) -> StripOptions:
        """Chosen layout."""
        return self._options

    @property
    def available(self) -> tuple[Row, ...]:
        """Rows that can be drawn."""
        video, mesh = self.source.video is not None, self.source.mesh is not None
        rows: dict[Row, bool] = {"video": video, "mesh": mesh, "overlay": video and mesh}
        return tuple(row for row, there in rows.items() if there)

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
        """Change the layout."""
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

        def write(emit: Emit) -> None:
            from sd2core.figures.strip import plot_strip, save_strip

            figure = plot_strip(source, frames, options, lambda *_: emit(None))
            save_strip(figure, path, source, frames, options)

        self._write(path, write)

    # --- inside ---------------------------------------------------------------------------

    def _draw(self) -> None:
        try:
            frames = self.frames()
        except Sd2Error as error:
            self._refuse(error)
            return
        source, options = self.source, self._options

        def plot(emit: Emit) -> Figure:
            from sd2core.figures.strip import plot_strip

            return plot_strip(source, frames, options, lambda *_: emit(None))

        self._preview(plot)
