"""A strip of frames: the video above the mesh of that moment, or one over the other."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sd2core.body.camera import PinholeCamera
from sd2core.body.model import vertex_normals
from sd2core.figures.colours import DIVERGING, rgb, velocity_colours
from sd2core.figures.strip_source import Row, StripOptions, StripSource, check_strip
from sd2core.figures.surface import Frame, find_visible_triangles, lightness, project_vertices
from sd2core.files.figure_files import save_figure
from sd2core.mesh.sequence import MeshSequence
from sd2core.mesh.things import joined
from sd2core.progress import Progress, silent
from sd2core.scattering.velocity import moments, radial_velocity
from sd2core.sensor import VirtualSensor

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.gridspec import GridSpecBase
    from matplotlib.transforms import Bbox

_INK, _PAPER = "#1d2127", "#f3f4f6"
_NAMES: dict[Row, str] = {"video": "Video", "mesh": "Mesh", "overlay": "Mesh over video"}
_PICTURE_IN = 1.3
"""Width of one picture."""
_GAP_IN, _LABEL_IN, _TITLE_IN, _BAR_IN = 0.05, 0.28, 0.3, 0.95
_PIXELS_PER_INCH = 300
_MUTED = "#5a6370"
_PLAIN = "#9fb4cc"
_OVERLAY, _OVERLAY_SHARE = "#2fc6a8", 0.5
_MARGIN = 0.1
"""Margin around the body, as a share of its extent."""
_SURFACE_PIXELS = 800
"""Across a picture: twice what is shown, for smooth outlines."""
_MAX_PIXELS = 800
"""Across a picture of the video: twice what is printed."""
_CENTRED: Any = {"ha": "center", "va": "center"}
_CELL_SHARE = 0.018
_DOT_PT = 0.6
"""Diameter of a dot in points, of which a picture is some 94 wide."""


def plot_strip(
    source: StripSource,
    frames: Sequence[int],
    options: StripOptions | None = None,
    progress: Progress = silent,
) -> Figure:
    """Draw a strip of frames.

    Parameters
    ----------
    source : StripSource
    frames : sequence of int
        Numbers on :attr:`StripSource.clock`, in the order in which they are drawn; 1 to 100.
    options : StripOptions, optional
    progress : Progress
        Called once per frame.

    Raises
    ------
    Sd2Error
        If a row needs what is not there, or a frame does not exist.
    """
    options = options or StripOptions()
    check_strip(source, frames, options)
    bodies = [Body.at(source, frame, options) for frame in frames]
    box = _strip_box(source, bodies, options)
    figure, cells = _figure(len(frames), options, box)
    for number, (frame, body) in enumerate(zip(frames, bodies, strict=True)):
        progress(number, len(frames))
        block, column = divmod(number, options.columns)
        for row, what in enumerate(options.rows):
            axes = figure.add_subplot(cells[block][row, column])
            axes.set(xlim=(0, box.width), ylim=(box.height, 0), xticks=[], yticks=[])
            axes.set_facecolor(_PAPER)
            axes.spines[:].set_visible(False)
            _draw_picture(axes, what, source, frame, body, box, options)
            if row == 0:
                time = f"{source.clock.time_of(frame):.2f} s"
                axes.set_title(time, loc="left", pad=2, fontsize=7, color=_INK)
                axes.set_title(str(frame), loc="right", pad=2, fontsize=6, color=_MUTED)
            if column == 0:
                name = _NAMES[what] + " (simulated)" * source.simulated
                axes.set_ylabel(name, fontsize=7, color=_INK)
    if _has_bar(options):
        _add_bar(figure, cells[0][:, :].get_position(figure), options.v_max_mps)
    progress(len(frames), len(frames))
    return figure


def save_strip(
    figure: Figure, path: Path, source: StripSource, frames: Sequence[int], options: StripOptions
) -> None:
    """Write a strip as PNG, SVG or PDF by the name's ending, with its provenance.

    Text and axes of SVG and PDF are text and lines; pictures and meshes are pictures in them.

    Parameters
    ----------
    figure : Figure
        Of :func:`plot_strip`.
    path : Path
        Ends in ``.png``, ``.svg`` or ``.pdf``; errors are those of :func:`save_figure`.
    source : StripSource
    frames : sequence of int
    options : StripOptions
        What the figure was made of, for its provenance.
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


def _figure(count: int, options: StripOptions, box: Frame) -> tuple[Figure, list[GridSpecBase]]:
    """An empty figure, and the places of pictures in it, block by block."""
    from matplotlib.figure import Figure

    rows, columns = len(options.rows), min(count, options.columns)
    blocks = math.ceil(count / options.columns)
    picture_in = _PICTURE_IN * box.height / box.width
    across_in = columns * (_PICTURE_IN + _GAP_IN) - _GAP_IN
    block_in = rows * (picture_in + _GAP_IN) - _GAP_IN
    width_in = _LABEL_IN + across_in + _GAP_IN + _BAR_IN * _has_bar(options)
    height_in = blocks * (_TITLE_IN + block_in + _GAP_IN) + _GAP_IN
    figure = Figure(figsize=(width_in, height_in), dpi=_PIXELS_PER_INCH / 2)
    figure.set_facecolor("white")
    below = figure.add_gridspec(
        blocks,
        1,
        left=_LABEL_IN / width_in,
        right=(_LABEL_IN + across_in) / width_in,
        top=1 - _TITLE_IN / height_in,
        bottom=2 * _GAP_IN / height_in,
        hspace=(_GAP_IN + _TITLE_IN) / block_in,
    )
    gaps = {"wspace": _GAP_IN / _PICTURE_IN, "hspace": _GAP_IN / picture_in}
    return figure, [below[block].subgridspec(rows, columns, **gaps) for block in range(blocks)]


def _has_bar(options: StripOptions) -> bool:
    return options.colour == "velocity" and "mesh" in options.rows


def _add_bar(figure: Figure, pictures: Bbox, v_max_mps: float) -> None:
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import ListedColormap, Normalize

    colours = ScalarMappable(Normalize(-v_max_mps, v_max_mps), ListedColormap(DIVERGING / 255))
    width_in, height_in = figure.get_size_inches()
    high = min(pictures.height, 2.2 / height_in)
    place = (pictures.x1 + 0.15 / width_in, pictures.y1 - high, 0.1 / width_in, high)
    bar = figure.colorbar(colours, cax=figure.add_axes(place))
    bar.set_ticks([-v_max_mps, -v_max_mps / 2, 0, v_max_mps / 2, v_max_mps])
    bar.set_ticklabels(
        [f"{value:+g}".replace("-", "−") if value else "0" for value in bar.get_ticks()]
    )
    bar.ax.tick_params(labelsize=6, length=2, color=_MUTED, labelcolor=_INK)
    bar.outline.set_visible(False)
    bar.set_label("radial velocity, m/s\n(approaching is positive)", fontsize=6, color=_INK)


@dataclass(frozen=True, eq=False)
class Body:
    """Everybody of one frame as one mesh, and the colours (V, 3) of its vertices from 0 to 1."""

    vertices_m: NDArray[np.float64]
    faces: NDArray[np.int32]  # none of a cloud of points
    colours: NDArray[np.float64]

    @classmethod
    def at(cls, source: StripSource, frame: int, options: StripOptions) -> Body | None:
        """Body at a frame of the strip's clock, None if nobody is there."""
        time_s = source.clock.time_of(frame)
        each = () if source.mesh is None else source.mesh.bodies
        shown = [(mesh, at) for mesh in each if (at := mesh.person_at(time_s)) is not None]
        if not shown:
            return None
        none = np.empty((0, 3), np.int32)
        vertices_m, faces = joined(
            [
                (mesh.frame(number).astype(np.float64), none if mesh.faces is None else mesh.faces)
                for mesh, number in shown
            ]
        )
        colours = np.tile(rgb(_PLAIN), (len(vertices_m), 1))
        if options.colour == "velocity":
            velocity = [_velocity(mesh, number, source.sensor) for mesh, number in shown]
            colours = velocity_colours(np.concatenate(velocity), options.v_max_mps)
        return cls(vertices_m, faces, colours.astype(np.float64) / 255)


def _velocity(mesh: MeshSequence, frame: int, sensor: VirtualSensor) -> NDArray[np.float64]:
    """Radial velocity of every vertex between the frames before and after, as the map has it."""
    stencil = moments(mesh.times_s, np.array([frame]), 1, mesh.presence)
    before, after = int(stencil.before[0, 0]), int(stencil.after[0, 0])
    a, b = (np.asarray(mesh.frame(k), np.float64).T for k in (before, after))  # (3, V)
    return radial_velocity(a, b, sensor.position_m, stencil.duration_s[0, 0])


def _strip_box(source: StripSource, bodies: Sequence[Body | None], options: StripOptions) -> Frame:
    """Part of the picture that every column shows."""
    camera = source.camera
    pixels = [project_vertices(body.vertices_m, camera)[0] for body in bodies if body is not None]
    whole = options.whole or not pixels
    low, high = np.zeros(2), np.array([camera.width, camera.height], float)
    if not whole:
        seen = np.concatenate(pixels)
        seen = seen[np.isfinite(seen).all(axis=1)]
        if len(seen):
            first, last = seen.min(axis=0), seen.max(axis=0)
            margin = _MARGIN * (last - first).max()
            # The mesh alone may reach beyond the picture; the video cannot.
            beyond = options.rows == ("mesh",)
            low = first - margin if beyond else np.maximum(first - margin, low)
            high = last + margin if beyond else np.minimum(last + margin, high)
            if not (high - low >= 1).all():
                low, high = np.zeros(2), np.array([camera.width, camera.height], float)
    low, high = np.floor(low), np.ceil(high)
    width, height = high - low
    return Frame(float(low[0]), float(low[1]), int(width), int(height))


def _draw_picture(
    axes: Axes,
    row: Row,
    source: StripSource,
    frame: int,
    body: Body | None,
    box: Frame,
    options: StripOptions,
) -> None:
    """Draw one picture into axes that span ``box``."""
    extent = (0, box.width, box.height, 0)
    if row != "mesh":
        assert source.video is not None
        left, top = int(box.left), int(box.top)
        picture = source.video.read(frame)[top : top + box.height, left : left + box.width]
        axes.imshow(_reduced(picture), extent=extent, aspect="auto", interpolation="antialiased")
    if row == "video":
        return
    if body is None:
        where = axes.transAxes
        axes.text(0.5, 0.5, "no person", transform=where, fontsize=7, color=_MUTED, **_CENTRED)
        return
    over = row == "overlay"
    if options.as_dots or not len(body.faces):
        _draw_dots(axes, body, source.camera, box, over)
    else:
        image = _surface(body, source.camera, box, over)
        axes.imshow(image, extent=extent, aspect="auto", interpolation="antialiased")


def _surface(body: Body, camera: PinholeCamera, box: Frame, over: bool) -> NDArray[np.uint8]:
    """The surface lit from the camera, as RGBA bytes."""
    zoom = _SURFACE_PIXELS / box.width
    fine = Frame(
        box.left, box.top, max(round(box.width * zoom), 1), max(round(box.height * zoom), 1), zoom
    )
    view = find_visible_triangles(body.vertices_m, body.faces, camera, fine)
    light = lightness(body.vertices_m, body.faces)[:, None]
    colours = rgb(_OVERLAY) / 255 if over else body.colours
    rgba = np.zeros((*view.owner.shape, 4), np.float32)
    shown = view.interpolated(colours * light)
    if len(shown):
        rgba[..., :3] = shown.mean(axis=0)  # where it is resampled it mixes with what is beside it
    rgba[view.shown, :3] = shown
    rgba[view.shown, 3] = _OVERLAY_SHARE if over else 1.0
    return np.rint(255 * np.clip(rgba, 0, 1)).astype(np.uint8)


def _reduced(picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """A picture (H, W, 3) no finer than a figure can show, by means of whole blocks of pixels."""
    size = picture.shape[1] // _MAX_PIXELS
    if size < 2:
        return picture
    height, width = (side // size for side in picture.shape[:2])
    blocks = picture[: height * size, : width * size].reshape(height, size, width, size, 3)
    return np.rint(blocks.mean(axis=(1, 3))).astype(np.uint8)


def _draw_dots(axes: Axes, body: Body, camera: PinholeCamera, box: Frame, over: bool) -> None:
    pixels, depth = project_vertices(body.vertices_m, camera)
    shown = np.isfinite(depth)
    if len(body.faces):
        normals = vertex_normals(body.vertices_m, body.faces)
        shown &= (normals * body.vertices_m).sum(axis=1) < 0
    order = np.flatnonzero(shown)[np.argsort(-depth[shown], kind="stable")]
    if over:
        # One dot in a cell, the nearest: what is under it has to stay visible.
        cells = np.floor(pixels[order[::-1]] / (_CELL_SHARE * box.width)).astype(np.int64)
        order = order[::-1][np.unique(cells, axis=0, return_index=True)[1]]
    places = box.place(pixels[order])
    colours: Any = np.clip(0.82 * body.colours[order], 0, 1)  # the pale middle on a pale ground
    axes.scatter(
        places[:, 0],
        places[:, 1],
        s=_DOT_PT**2,
        c=_OVERLAY if over else colours,
        linewidths=0,
        rasterized=True,
    )
