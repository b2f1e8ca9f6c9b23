"""The mesh drawn over the picture it was fitted to."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sd2core.body.camera import PinholeCamera
from sd2core.compiled import kernels_ready
from sd2core.raster import rasterise

_NEAREST_M = 0.01
_DARKEST = 0.35
"""Lightness of a surface that is seen from its edge."""
_DOTS_ACROSS = 210
"""Sides of a dot that make up the longer side of the picture."""
_CELL_PER_DOT = 2.2
"""One dot in a cell of this many dots' sides: where vertices crowd, the person stays visible."""


def shaded(
    vertices: NDArray[np.floating], faces: NDArray[np.int32] | None, camera: PinholeCamera
) -> NDArray[np.float32]:
    """What a lamp at the camera makes of a mesh.

    Parameters
    ----------
    vertices : float array, shape (V, 3)
        Metres in the camera's frame.
    faces : int32 array, shape (F, 3), or None
        Dots where there are none, and while the kernels are being compiled.
    camera : PinholeCamera

    Returns
    -------
    float32 array, shape (height, width)
        0 beside the mesh; on it from a third (edge-on) to 1 (square on, and dots).
    """
    ahead = vertices[:, 2] > _NEAREST_M
    depth = np.where(ahead, vertices[:, 2], 1.0)
    pixels = camera.focal_px * vertices[:, :2] / depth[:, None] + camera.centre_px
    if faces is None or not kernels_ready():
        return _dots(pixels[ahead], depth[ahead], camera)
    faces = faces[ahead[faces].all(axis=1)]
    owner = np.full((camera.height, camera.width), -1, np.int32)
    rasterise(
        pixels.astype(np.float32),
        (1.0 / depth).astype(np.float32),
        faces,
        np.zeros(owner.shape, np.float32),
        owner,
    )
    light = np.append(_facing(vertices, faces), np.float32(0.0))  # owner -1 takes the last
    return light[owner]


def blend(
    picture: NDArray[np.uint8],
    light: NDArray[np.float32],
    colour: tuple[int, ...],
    opacity: float,
) -> NDArray[np.uint8]:
    """A copy of the picture with the mesh over it."""
    covered = light > 0
    paint = light[covered][:, None] * np.array(colour, np.float32)  # (N, 3)
    result = picture.copy()
    kept = picture[covered] * np.float32(1.0 - opacity)
    result[covered] = (kept + np.float32(opacity) * paint).astype(np.uint8)
    return result


def _facing(vertices: NDArray[np.floating], faces: NDArray[np.int32]) -> NDArray[np.float32]:
    """How squarely each face is seen: (F,) from :data:`_DARKEST` to 1."""
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    normal = np.cross(b - a, c - a)
    lengths = np.linalg.norm(normal, axis=1) * np.linalg.norm(a, axis=1)
    cosine = np.abs(np.einsum("fi,fi->f", normal, a)) / np.maximum(lengths, 1e-30)
    return (_DARKEST + (1.0 - _DARKEST) * cosine).astype(np.float32)


def _dots(
    pixels: NDArray[np.floating], depth: NDArray[np.floating], camera: PinholeCamera
) -> NDArray[np.float32]:
    """The nearest vertex of every cell as a square."""
    size = max(round(max(camera.width, camera.height) / _DOTS_ACROSS), 1)
    light = np.zeros((camera.height, camera.width), np.float32)
    inside = ((pixels >= 0) & (pixels < (camera.width, camera.height))).all(axis=1)
    pixels = pixels[inside][np.argsort(depth[inside], kind="stable")]
    cells = np.floor(pixels / (_CELL_PER_DOT * size)).astype(np.int64)
    _, first = np.unique(cells, axis=0, return_index=True)
    corner = np.floor(pixels[first] - (size - 1) / 2).astype(np.int64)
    for offset in np.ndindex(size, size):
        columns, rows = (corner + offset).T
        columns = np.clip(columns, 0, camera.width - 1)
        light[np.clip(rows, 0, camera.height - 1), columns] = 1.0
    return light
