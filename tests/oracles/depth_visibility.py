"""The depth buffer in NumPy.

The same arithmetic as :mod:`sd2core.scattering.depth`; only a pixel centre on an
edge, or a depth on the limit, to the last digit can come out differently.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from oracles.exact_visibility import exact_visibility
from sd2core.scattering.depth import (
    ALMOST_ONE,
    BEHIND_PIXELS,
    LOOSE,
    ON_IT_PIXELS,
    SMOOTH_PIXELS,
    THINNEST,
)
from sd2core.scattering.exact import EDGE, WIDEST, axes_along

_PAIRS_AT_ONCE = 1 << 20


def depth_visibility(
    points: NDArray[Any],
    faces: NDArray[np.int32],
    closed: bool,
    sensor: NDArray[np.float64],
    resolution: int,
    needed: NDArray[np.bool_],
) -> NDArray[np.bool_]:
    """Mark the needed vertices of one frame that are visible by the depth buffer, shape (V,).

    Parameters
    ----------
    points : float array, shape (3, V)
        Metres.
    faces : int32 array, shape (F, 3)
        Counter-clockwise seen from outside.
    closed : bool
        They enclose a body, so that back-facing ones hide nothing more.
    sensor : float64 array, shape (3,)
        In the frame of the points.
    resolution : int
        Pixels along each side of the depth buffer.
    needed : bool array, shape (V,)
    """
    place = np.asarray(points, np.float64)
    centre = 0.5 * (place.min(axis=1) + place.max(axis=1))
    towards = centre - sensor
    distance = float(np.linalg.norm(towards))
    if distance == 0:
        return exact_visibility(points, faces, sensor, needed)
    axes = np.empty((3, 3))
    fx, fy, fz = (towards / distance).tolist()
    axes_along(fx, fy, fz, axes)
    right, up, behind = axes @ (place - centre[:, None])
    ahead = distance + behind
    if (ahead <= 0).any() or (np.abs(right) + np.abs(up) > WIDEST * ahead).any():
        return exact_visibility(points, faces, sensor, needed)
    scale = distance / ahead
    image = np.stack([right * scale, up * scale])
    low, high = image.min(axis=1), image.max(axis=1)
    pixel = float((high - low).max()) / (resolution - 2)
    image = (image - low[:, None]) * (1 / pixel if pixel > 0 else 0.0) + 0.5
    depth = behind * scale
    depths, facing, drawn = _draw(image, depth, faces, closed, resolution)

    column, row = image.astype(int)
    u, w = image - np.stack([column, row])
    around = np.stack([depths[row + r, column + c] for r in (0, 1) for c in (0, 1)])  # (4, V)
    inside = np.isfinite(around).all(axis=0)
    nearest = around.min(axis=0)
    around = np.where(inside, around, 0.0)
    weights = np.stack([(1 - w) * (1 - u), (1 - w) * u, w * (1 - u), w * u])
    one = pixel * scale
    farthest = around.max(axis=0)
    behind_all = inside & (depth > farthest + BEHIND_PIXELS * one)
    smooth = inside & (farthest - nearest <= SMOOTH_PIXELS * one)
    on_it = smooth & (depth <= (weights * around).sum(axis=0) + ON_IT_PIXELS * one)
    on_it |= np.isfinite(nearest) & (depth <= nearest + ON_IT_PIXELS * one)
    possible = needed & (facing != 0)
    doubtful = possible & ~on_it & ~behind_all
    seen: NDArray[np.bool_] = possible & on_it
    seen |= exact_visibility(points, faces[drawn], sensor, doubtful)
    return seen


def _draw(
    image: NDArray[np.float64],
    depth: NDArray[np.float64],
    faces: NDArray[np.int32],
    closed: bool,
    size: int,
) -> tuple[NDArray[np.float64], NDArray[np.uint8], NDArray[np.bool_]]:
    """Nearest depth per pixel, which vertices face the sensor, which triangles can hide."""
    x, y = image[0][faces].T, image[1][faces].T  # (3, F) each
    low = np.stack([x.min(axis=0), y.min(axis=0)])
    high = np.stack([x.max(axis=0), y.max(axis=0)])
    area = (x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0])
    solid = np.abs(area) > THINNEST * (high - low).sum(axis=0)
    facing = np.full(image.shape[1], LOOSE, np.uint8)
    facing[faces[solid]] = 0
    facing[faces[solid & (area < 0)]] = 1
    drawn = solid & (area < 0) if closed else solid

    first, last = (low + ALMOST_ONE).astype(int), high.astype(int)
    extent = np.maximum(last - first + 1, 0) * drawn
    pixels = extent[0] * extent[1]
    depths = np.full(size * size, np.inf)
    parts = np.cumsum(pixels) // _PAIRS_AT_ONCE
    for part in range(int(parts[-1]) + 1 if len(parts) else 0):
        chosen = np.flatnonzero((parts == part) & (pixels > 0))
        f = np.repeat(chosen, pixels[chosen])
        ends = np.cumsum(pixels[chosen])
        within = np.arange(len(f)) - np.repeat(ends - pixels[chosen], pixels[chosen])
        column = first[0, f] + within % extent[0, f]
        row = first[1, f] + within // extent[0, f]
        (x0, x1, x2), (y0, y1, y2), per_area = x[:, f], y[:, f], 1 / area[f]
        w0 = ((x1 - column) * (y2 - row) - (x2 - column) * (y1 - row)) * per_area
        w1 = ((x2 - column) * (y0 - row) - (x0 - column) * (y2 - row)) * per_area
        w2 = 1 - w0 - w1
        corner = depth[faces[f]].T
        here = w0 * corner[0] + w1 * corner[1] + w2 * corner[2]
        covered = np.minimum(np.minimum(w0, w1), w2) >= -EDGE
        np.minimum.at(depths, (row * size + column)[covered], here[covered])
    return depths.reshape(size, size), facing, drawn
