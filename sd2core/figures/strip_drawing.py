"""One picture of a strip: the video, the mesh of that moment, or one over the other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sd2core.body.camera import PinholeCamera
from sd2core.figures.colours import rgb, velocity_colours
from sd2core.figures.strip_source import Row, StripOptions, StripSource
from sd2core.figures.surface import Frame, find_visible_triangles, lightness, project_vertices
from sd2core.mesh.sequence import MeshSequence
from sd2core.scattering.velocity import moments, radial_velocity
from sd2core.sensor import VirtualSensor

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MUTED = "#5a6370"
_PLAIN = "#9fb4cc"
_OVERLAY, _OVERLAY_SHARE = "#2fc6a8", 0.5
_MARGIN = 0.1
"""Margin around the body, as a share of its extent."""
_SURFACE_PIXELS = 800
"""Across a picture: twice what is shown, for smooth outlines."""
_MOST_PIXELS = 800
"""Across a picture of the video: twice what is printed."""
_CENTRED: Any = {"ha": "center", "va": "center"}
_CELL_SHARE = 0.018
_DOT_PT = 0.6
"""Diameter of a dot in points, of which a picture is some 94 wide."""


@dataclass(frozen=True, eq=False)
class Body:
    """The mesh of one frame, and the colours (V, 3) of its vertices from 0 to 1."""

    vertices_m: NDArray[np.float64]
    colours: NDArray[np.float64]

    @classmethod
    def at(cls, source: StripSource, frame: int, options: StripOptions) -> Body | None:
        """The mesh at a frame of the strip's clock, None where there is none."""
        mesh = source.mesh
        number = None if mesh is None else mesh.person_at(source.clock.time_of(frame))
        if mesh is None or number is None:
            return None
        vertices = np.asarray(mesh.frame(number), np.float64)
        colours = np.tile(rgb(_PLAIN), (len(vertices), 1))
        if options.colour == "velocity":
            colours = velocity_colours(_velocity(mesh, number, source.sensor), options.v_max_mps)
        return cls(vertices, colours.astype(np.float64) / 255)


def _velocity(mesh: MeshSequence, frame: int, sensor: VirtualSensor) -> NDArray[np.float64]:
    """Radial velocity of every vertex between the frames before and after, as the map has it."""
    stencil = moments(mesh.times_s, np.array([frame]), 1, mesh.presence)
    before, after = int(stencil.before[0, 0]), int(stencil.after[0, 0])
    a, b = (np.asarray(mesh.frame(k), np.float64).T for k in (before, after))  # (3, V)
    velocity: NDArray[np.float64] = radial_velocity(
        a, b, sensor.position_m, stencil.duration_s[0, 0]
    )
    return velocity


def strip_box(source: StripSource, bodies: Sequence[Body | None], options: StripOptions) -> Frame:
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


def draw_picture(
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
        axes.text(0.5, 0.5, "no person", transform=where, fontsize=7, color=MUTED, **_CENTRED)
        return
    over = row == "overlay"
    mesh = source.mesh
    assert mesh is not None
    if options.as_dots or mesh.faces is None:
        _draw_dots(axes, body, mesh.faces, source.camera, box, over)
    else:
        image = _surface(body, mesh.faces, source.camera, box, over)
        axes.imshow(image, extent=extent, aspect="auto", interpolation="antialiased")


def _surface(
    body: Body, faces: NDArray[np.int32], camera: PinholeCamera, box: Frame, over: bool
) -> NDArray[np.uint8]:
    """The surface lit from the camera, as RGBA bytes."""
    zoom = _SURFACE_PIXELS / box.width
    fine = Frame(
        box.left, box.top, max(round(box.width * zoom), 1), max(round(box.height * zoom), 1), zoom
    )
    view = find_visible_triangles(body.vertices_m, faces, camera, fine)
    light = lightness(body.vertices_m, faces)[:, None]
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
    size = picture.shape[1] // _MOST_PIXELS
    if size < 2:
        return picture
    height, width = (side // size for side in picture.shape[:2])
    blocks = picture[: height * size, : width * size].reshape(height, size, width, size, 3)
    return np.rint(blocks.mean(axis=(1, 3))).astype(np.uint8)


def _draw_dots(
    axes: Axes,
    body: Body,
    faces: NDArray[np.int32] | None,
    camera: PinholeCamera,
    box: Frame,
    over: bool,
) -> None:
    pixels, depth = project_vertices(body.vertices_m, camera)
    shown = np.isfinite(depth)
    if faces is not None:
        shown &= _faces_camera(body.vertices_m, faces)
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


def _faces_camera(vertices_m: NDArray[np.float64], faces: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Vertices with a triangle that faces the camera."""
    corners = vertices_m[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    facing = np.einsum("fi,fi->f", normal, corners[:, 0]) < 0
    result = np.zeros(len(vertices_m), bool)
    result[faces[facing]] = True
    return result
