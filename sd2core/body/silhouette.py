"""Whether a mesh lies on the person in the picture: overlap of silhouettes."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.body.camera import PinholeCamera
from sd2core.numerics.raster import rasterise

NEAREST_M = 0.05
"""What is nearer to the camera, or behind it, is not in the picture."""


def silhouette(
    vertices_m: NDArray[Any],
    faces: NDArray[np.int32],
    camera: PinholeCamera,
    size: tuple[int, int] | None = None,
) -> NDArray[np.bool_]:
    """Pixels that a mesh covers.

    Parameters
    ----------
    vertices_m : float array, shape (V, 3)
        In the camera frame.
    faces : int32 array, shape (F, 3)
        Counter-clockwise seen from outside.
    camera : PinholeCamera
    size : (width, height), optional
        Of the mask, which shows the whole picture; by default the picture's own.

    Returns
    -------
    bool array, shape (height, width)
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
