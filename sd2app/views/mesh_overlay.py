"""The mesh drawn over the picture it was fitted to."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sd2core.compiled import kernels_ready
from sd2core.simulate.raster import rasterise

_OPACITY = 0.35


def project(
    vertices: NDArray[np.floating], focal_px: float, width: int, height: int
) -> NDArray[np.float32]:
    """Pixel (x, y) of every vertex, (V, 2); NaN behind the camera.

    Pinhole camera at the origin, optical axis +z, principal point in the centre.
    """
    depth = np.where(vertices[:, 2] > 0.01, vertices[:, 2], np.nan)
    centre = np.array([width, height]) / 2
    return (focal_px * vertices[:, :2] / depth[:, None] + centre).astype(np.float32)


def covered_pixels(
    pixels: NDArray[np.float32], faces: NDArray[np.int32] | None, width: int, height: int
) -> NDArray[np.bool_]:
    """Pixels that the mesh covers, (height, width).

    Dots where there are no faces, and while the kernels are being compiled.
    """
    if faces is None or not kernels_ready():
        covered = np.zeros((height, width), bool)
        inside = (pixels >= 0).all(axis=1) & (pixels[:, 0] < width) & (pixels[:, 1] < height)
        columns, rows = pixels[inside].astype(np.int64).T
        covered[rows, columns] = True
        return covered
    ahead = faces[np.isfinite(pixels[:, 0])[faces].all(axis=1)]
    owner = np.full((height, width), -1, np.int32)
    same_depth = np.ones(len(pixels), np.float32)
    rasterise(pixels, same_depth, ahead, np.zeros((height, width), np.float32), owner)
    return owner >= 0


def blend(
    picture: NDArray[np.uint8], covered: NDArray[np.bool_], colour: tuple[int, ...]
) -> NDArray[np.uint8]:
    """A copy of the picture, tinted where it is covered."""
    tint = (np.array(colour) * _OPACITY).astype(np.uint8)
    result = picture.copy()
    result[covered] = (picture[covered] * np.float32(1.0 - _OPACITY)).astype(np.uint8) + tint
    return result
