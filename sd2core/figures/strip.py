"""A strip of frames: pictures of the video above the mesh, one column per moment."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from sd2core.figures.colours import DIVERGING
from sd2core.figures.strip_drawing import MUTED, Body, draw_picture, strip_box
from sd2core.figures.strip_source import Row, StripOptions, StripSource, check_strip
from sd2core.figures.surface import Frame
from sd2core.files.figure_files import save_figure
from sd2core.progress import Progress, silent

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_INK, _PAPER = "#1d2127", "#f3f4f6"
_PICTURE_IN = 1.3
"""Width of one picture."""
_GAP_IN, _LABEL_IN, _TITLE_IN, _BAR_IN = 0.05, 0.28, 0.3, 0.95
_PIXELS_PER_INCH = 300


def plot_strip(
    source: StripSource,
    frames: Sequence[int],
    options: StripOptions | None = None,
    progress: Progress = silent,
) -> Figure:
    """Draw a strip of frames, which are numbers on :attr:`StripSource.clock`.

    Progress is called once per frame. Raises Sd2Error if a row needs what is not there, or
    a frame does not exist.
    """
    from matplotlib.figure import Figure

    options = options or StripOptions()
    check_strip(source, frames, options)
    bodies = [Body.at(source, frame, options) for frame in frames]
    box = strip_box(source, bodies, options)
    layout = _Layout(len(frames), options, box)
    figure = Figure(figsize=(layout.width_in, layout.height_in), dpi=_PIXELS_PER_INCH / 2)
    figure.set_facecolor("white")
    for column, (frame, body) in enumerate(zip(frames, bodies, strict=True)):
        progress(column, len(frames))
        for row in range(len(options.rows)):
            axes = figure.add_axes(layout.place(column, row))
            axes.set(xlim=(0, box.width), ylim=(box.height, 0), xticks=[], yticks=[])
            axes.set_facecolor(_PAPER)
            for spine in axes.spines.values():
                spine.set_visible(False)
            draw_picture(axes, options.rows[row], source, frame, body, box, options)
            if row == 0:
                _write_time(axes, source.clock.time_of(frame), frame)
            if column % options.columns == 0:
                _write_row(axes, options.rows[row], source.simulated)
    if options.colour == "velocity" and "mesh" in options.rows:
        _add_bar(figure, layout, options.v_max_mps)
    progress(len(frames), len(frames))
    return figure


def save_strip(
    figure: Figure, path: Path, source: StripSource, frames: Sequence[int], options: StripOptions
) -> None:
    """Write a strip as PNG, SVG or PDF by the name's ending, with its provenance.

    Text and axes of SVG and PDF are text and lines; pictures and meshes are pictures in them.
    """
    provenance = {
        "source": source.name,
        "frames": list(frames),
        "simulated": source.simulated,
        "sensor_position_m": list(source.sensor.position_m),
        "camera": asdict(source.camera),
        "options": asdict(options),
    }
    save_figure(figure, path, provenance, _PIXELS_PER_INCH)


class _Layout:
    """Layout of the strip, in inches from the top left."""

    def __init__(self, count: int, options: StripOptions, box: Frame) -> None:
        self._columns = min(count, options.columns)
        self._rows = len(options.rows)
        self._blocks = math.ceil(count / options.columns)
        self._picture_in = _PICTURE_IN * box.height / box.width
        self._block_in = _TITLE_IN + self._rows * (self._picture_in + _GAP_IN)
        bar = options.colour == "velocity" and "mesh" in options.rows
        self._pictures_in = self._columns * (_PICTURE_IN + _GAP_IN)
        self.width_in = _LABEL_IN + self._pictures_in + (_BAR_IN if bar else 0.0)
        self.height_in = self._blocks * self._block_in + _GAP_IN

    def place(self, column: int, row: int) -> tuple[float, float, float, float]:
        """Left, bottom, width and height of a picture, as shares of the figure."""
        block, column = divmod(column, self._columns)
        left = _LABEL_IN + column * (_PICTURE_IN + _GAP_IN)
        top = block * self._block_in + _TITLE_IN + row * (self._picture_in + _GAP_IN)
        return self._shares(left, top, _PICTURE_IN, self._picture_in)

    @property
    def bar(self) -> tuple[float, float, float, float]:
        """The colour bar, beside the first block."""
        height = min(self._block_in - _TITLE_IN - _GAP_IN, 2.2)
        return self._shares(_LABEL_IN + self._pictures_in + 0.1, _TITLE_IN, 0.1, height)

    def _shares(
        self, left: float, top: float, width: float, height: float
    ) -> tuple[float, float, float, float]:
        return (
            left / self.width_in,
            1 - (top + height) / self.height_in,
            width / self.width_in,
            height / self.height_in,
        )


def _write_time(axes: Axes, time_s: float, frame: int) -> None:
    axes.text(0, 1.02, f"{time_s:.2f} s", transform=axes.transAxes, fontsize=7, color=_INK)
    axes.text(1, 1.02, str(frame), transform=axes.transAxes, fontsize=6, color=MUTED, ha="right")


def _write_row(axes: Axes, row: Row, simulated: bool) -> None:
    name = {"video": "Video", "mesh": "Mesh", "overlay": "Mesh over video"}[row]
    axes.text(
        -0.05,
        0.5,
        f"{name} (simulated)" if simulated else name,
        transform=axes.transAxes,
        rotation=90,
        ha="right",
        va="center",
        fontsize=7,
        color=_INK,
    )


def _add_bar(figure: Figure, layout: _Layout, v_max_mps: float) -> None:
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import ListedColormap, Normalize

    colours = ScalarMappable(Normalize(-v_max_mps, v_max_mps), ListedColormap(DIVERGING / 255))
    axes = figure.add_axes(layout.bar)
    bar = figure.colorbar(colours, cax=axes)
    bar.set_ticks([-v_max_mps, -v_max_mps / 2, 0, v_max_mps / 2, v_max_mps])
    bar.set_ticklabels(
        [f"{value:+g}".replace("-", "−") if value else "0" for value in bar.get_ticks()]
    )
    bar.ax.tick_params(labelsize=6, length=2, color=MUTED, labelcolor=_INK)
    bar.outline.set_visible(False)
    bar.set_label("radial velocity, m/s\n(approaching is positive)", fontsize=6, color=_INK)
