"""The mesh drawn over the picture it was fitted to."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

_OPACITY = 0.5
_STEPS = (1, 2, 4, 8, 16, 32)


def project(
    vertices: NDArray[np.floating], focal_px: float, width: int, height: int
) -> NDArray[np.float64]:
    """Pixel (x, y) of every vertex, (V, 2); NaN behind the camera.

    Pinhole camera at the origin, optical axis +z, principal point in the centre.
    """
    depth = np.where(vertices[:, 2] > 0.01, vertices[:, 2], np.nan).astype(np.float64)
    centre = np.array([width, height]) / 2
    pixels: NDArray[np.float64] = focal_px * vertices[:, :2] / depth[:, None] + centre
    return pixels


def covered_pixels(
    pixels: NDArray[np.float64], faces: NDArray[np.int32] | None, width: int, height: int
) -> NDArray[np.bool_]:
    """Pixels that the mesh covers, (height, width): faces towards the camera, or dots.

    Each face is sampled at a grid as fine as the pixels, up to 32 of them along an edge.
    """
    if faces is None or not len(faces):
        points = pixels
    else:
        corners = pixels[faces]  # (F, 3, 2)
        first = corners[:, 1] - corners[:, 0]
        second = corners[:, 2] - corners[:, 0]
        # y points down, so faces that are counter-clockwise from outside turn the other way.
        corners = corners[first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0] < 0]
        extent_px = np.ptp(corners, axis=1).max(axis=1)
        size = np.searchsorted(_STEPS[:-1], extent_px)
        points = np.concatenate(
            [
                np.einsum("sc,fcx->fsx", _barycentric(steps), corners[size == k]).reshape(-1, 2)
                for k, steps in enumerate(_STEPS)
            ]
        )
    covered = np.zeros((height, width), bool)
    inside = (points >= 0).all(axis=1) & (points[:, 0] < width) & (points[:, 1] < height)
    columns, rows = points[inside].astype(np.int64).T
    covered[rows, columns] = True
    return covered


def blend(
    picture: NDArray[np.uint8], covered: NDArray[np.bool_], colour: tuple[int, ...]
) -> NDArray[np.uint8]:
    """A copy of the picture, tinted where it is covered."""
    result = picture.copy()
    result[covered] = (picture[covered] * (1.0 - _OPACITY) + np.array(colour) * _OPACITY).astype(
        np.uint8
    )
    return result


def _barycentric(steps: int) -> NDArray[np.float64]:
    """Regular grid over a triangle, corners included, (samples, 3)."""
    a, b = np.meshgrid(np.arange(steps + 1), np.arange(steps + 1), indexing="ij")
    inside = a + b <= steps
    a, b = a[inside], b[inside]
    return np.stack([steps - a - b, a, b], axis=1) / steps
