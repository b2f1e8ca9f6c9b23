"""Projection of a mesh into a picture: the visible triangle and the brightness of each pixel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sd2core.body.camera import PinholeCamera
from sd2core.numerics.raster import interpolate, rasterise
from sd2core.scattering.visibility import sum_cross_products

NEAREST_M = 0.01
_DARKEST = 0.35
"""Lightness of a surface that is seen from its edge."""
_DOTS_ACROSS = 210
"""Sides of a dot that make up the longer side of the picture."""
_CELL_PER_DOT = 2.2
"""One dot in a cell of this many dots' sides: where vertices crowd, the person stays visible."""


@dataclass(frozen=True)
class Frame:
    """Part of a camera's picture, enlarged."""

    left: float  # corner in pixels of the camera's picture
    top: float
    width: int  # of the enlarged part
    height: int
    zoom: float = 1.0  # its pixels per pixel of the picture

    @classmethod
    def whole(cls, camera: PinholeCamera) -> Frame:
        """The whole picture at its own size."""
        return cls(0.0, 0.0, camera.width, camera.height)

    def place(self, pixels: NDArray[np.floating]) -> NDArray[np.float64]:
        """Coordinates within the part of pixels (..., 2) of the picture."""
        return (np.asarray(pixels, np.float64) - (self.left, self.top)) * self.zoom


def project_vertices(
    vertices_m: NDArray[np.floating], camera: PinholeCamera
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Pixels (V, 2) and depths (V,) of vertices; NaN behind the camera and where unknown."""
    points = np.asarray(vertices_m, np.float64)
    depth = np.where(points[:, 2] > NEAREST_M, points[:, 2], np.nan)
    return camera.focal_px * points[:, :2] / depth[:, None] + camera.centre_px, depth


@dataclass(frozen=True, eq=False)
class VisibleTriangles:
    """Triangle that each pixel shows."""

    owner: NDArray[np.int32]
    """Number of the triangle, shape (height, width); minus one beside the mesh."""
    points: NDArray[np.float32]  # (V, 2), pixels
    nearness: NDArray[np.float32]  # (V,), 1 / depth; 0 where that is not known
    faces: NDArray[np.int32]  # (F, 3)

    @property
    def shown(self) -> NDArray[np.bool_]:
        """Pixels that the mesh covers, (height, width)."""
        return self.owner >= 0

    def interpolated(self, attributes: NDArray[np.floating]) -> NDArray[np.float32]:
        """Attributes (V, K) of the vertices at the pixels that are covered, (N, K)."""
        rows, columns = np.nonzero(self.shown)
        values = np.zeros((len(rows), attributes.shape[1]), np.float32)
        given = np.ascontiguousarray(attributes, np.float32)
        interpolate(
            self.points, self.nearness, self.faces, rows, columns, self.owner, given, values
        )
        return values


def find_visible_triangles(
    vertices_m: NDArray[np.floating],
    faces: NDArray[np.int32],
    camera: PinholeCamera,
    frame: Frame | None = None,
) -> VisibleTriangles:
    """Find the triangle of a mesh that each pixel of a picture, or of a part of it, shows.

    Parameters
    ----------
    vertices_m : float array, shape (V, 3)
        In the camera's frame, metres; triangles with an unknown corner (NaN, or not ahead of the
        camera) are left out.
    faces : int32 array, shape (F, 3)
        Counter-clockwise seen from outside; those that face away are not seen.
    camera : PinholeCamera
    frame : Frame, optional
        Part of the picture; by default the whole at its own size.

    Returns
    -------
    VisibleTriangles
        Owners are numbers among the triangles that are not left out, which are its ``faces``.
    """
    frame = frame or Frame.whole(camera)
    pixels, depth = project_vertices(vertices_m, camera)
    known = np.isfinite(depth)
    ahead = np.ascontiguousarray(faces[known[faces].all(axis=1)])
    owner = np.full((frame.height, frame.width), -1, np.int32)
    points = np.where(known[:, None], frame.place(pixels), 0.0).astype(np.float32)
    nearness = np.where(known, 1.0 / np.where(known, depth, 1.0), 0.0).astype(np.float32)
    rasterise(points, nearness, ahead, np.zeros(owner.shape, np.float32), owner)
    return VisibleTriangles(owner, points, nearness, ahead)


def lightness(vertices_m: NDArray[np.floating], faces: NDArray[np.int32]) -> NDArray[np.float32]:
    """Lightness of each vertex by a lamp at the camera, (V,): a third edge-on, 1 square on.

    Area-weighted normals: smooth where the surface is.
    """
    points = np.ascontiguousarray(np.asarray(vertices_m, np.float64).T)
    normal = np.empty((points.shape[1], 3), np.float64)
    sum_cross_products(points, faces, normal)
    lengths = np.linalg.norm(normal, axis=1) * np.linalg.norm(points, axis=0)
    cosine = np.abs(np.einsum("vi,iv->v", normal, points)) / np.maximum(lengths, 1e-30)
    return (_DARKEST + (1.0 - _DARKEST) * cosine).astype(np.float32)


def shade_mesh(
    vertices_m: NDArray[np.floating],
    faces: NDArray[np.int32] | None,
    camera: PinholeCamera,
    frame: Frame | None = None,
) -> NDArray[np.float32]:
    """Shade a mesh by a lamp at the camera: 0 beside it, from a third (edge-on) to 1 (square on).

    Parameters
    ----------
    vertices_m : float array, shape (V, 3)
        In the camera's frame, metres.
    faces : int32 array, shape (F, 3), or None
        Counter-clockwise seen from outside. None: the vertices are drawn as dots of value 1
        (:func:`draw_dots`).
    camera : PinholeCamera
    frame : Frame, optional
        Part of the picture; by default the whole at its own size.

    Returns
    -------
    float32 array, shape (height, width)
    """
    if faces is None:
        return draw_dots(vertices_m, camera, frame)
    view = find_visible_triangles(vertices_m, faces, camera, frame)
    light = np.zeros(view.owner.shape, np.float32)
    light[view.shown] = view.interpolated(lightness(vertices_m, faces)[:, None])[:, 0]
    return light


def draw_dots(
    vertices_m: NDArray[np.floating], camera: PinholeCamera, frame: Frame | None = None
) -> NDArray[np.float32]:
    """The nearest vertex of every cell as a square of ones, (height, width)."""
    frame = frame or Frame.whole(camera)
    pixels, depth = project_vertices(vertices_m, camera)
    pixels = frame.place(pixels)
    size = max(round(max(frame.width, frame.height) / _DOTS_ACROSS), 1)
    light = np.zeros((frame.height, frame.width), np.float32)
    with np.errstate(invalid="ignore"):
        inside = ((pixels >= 0) & (pixels < (frame.width, frame.height))).all(axis=1)
    pixels = pixels[inside][np.argsort(depth[inside], kind="stable")]
    cells = np.floor(pixels / (_CELL_PER_DOT * size)).astype(np.int64)
    _, first = np.unique(cells, axis=0, return_index=True)
    corner = np.floor(pixels[first] - (size - 1) / 2).astype(np.int64)
    for offset in np.ndindex(size, size):
        columns, rows = (corner + offset).T
        columns = np.clip(columns, 0, frame.width - 1)
        light[np.clip(rows, 0, frame.height - 1), columns] = 1.0
    return light
