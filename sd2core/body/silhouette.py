"""Silhouettes of meshes in a picture, and their overlap."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.body.camera import PinholeCamera
from sd2core.numerics.raster import rasterise

NEAREST_M = 0.05
"""Smallest depth that is drawn."""


def silhouette(
    vertices_m: NDArray[Any],
    faces: NDArray[np.int32],
    camera: PinholeCamera,
    size: tuple[int, int] | None = None,
) -> NDArray[np.bool_]:
    """Mask (height, width) of the pixels that a mesh in the camera frame covers.

    ``size`` (width, height) is that of the mask, which shows the whole picture; by default the
    picture's own.
    """
    width, height = size or (camera.width, camera.height)
    vertices = np.asarray(vertices_m, np.float64)
    ahead = vertices[:, 2] > NEAREST_M
    kept = faces[ahead[faces].all(axis=1)]
    depth = np.where(ahead, vertices[:, 2], 1.0)
    points = camera.project(np.concatenate([vertices[:, :2], depth[:, None]], axis=1))
    points *= np.array([width / camera.width, height / camera.height])
    buffer = np.zeros((height, width), np.float32)
    owner = np.full((height, width), -1, np.int32)
    rasterise(
        points.astype(np.float32),
        (1.0 / depth).astype(np.float32),
        np.ascontiguousarray(kept, np.int32),
        buffer,
        owner,
    )
    return owner >= 0


def overlap(one: NDArray[np.bool_], other: NDArray[np.bool_]) -> float:
    """Intersection over union of two masks of one size; NaN when both are empty."""
    union = int(np.count_nonzero(one | other))
    return int(np.count_nonzero(one & other)) / union if union else float("nan")
