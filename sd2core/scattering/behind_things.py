"""Points that things around a body, or other bodies, hide from a sensor."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.numerics.compiled import kernels_ready
from sd2core.scattering.exact import exact_visibility_kernel
from sd2core.scattering.exact_plain import exact_visibility

CORNERS = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
"""Which end of a box in x, y, z each corner is at, (8, 3)."""

_ROOM = 1e-5
"""Tangent by which pictures are taken to be larger than they are, for roundings."""


def hide_behind(
    vertices_m: NDArray[np.float64],
    faces: NDArray[np.int32],
    points: NDArray[Any],
    origin_m: NDArray[np.float64],
    sensor: NDArray[np.float64],
    seen: NDArray[np.uint8],
) -> None:
    """Set ``seen`` to 0 for the points of one frame that another surface hides.

    A second test beside that of the body itself, and always exact: the pixels of a depth buffer
    are as fine with a table beside the body as without.

    Parameters
    ----------
    vertices_m : float64 array, shape (W, 3)
        Of that surface, in the camera frame.
    faces : int32 array, shape (F, 3)
    points : float array, shape (3, V)
        Relative to ``origin_m``.
    origin_m : float64 array, shape (3,)
        In the camera frame.
    sensor : float64 array, shape (3,)
        In the frame of the points.
    seen : uint8 array, shape (V,)
        Written where it is 1; others are not tested.
    """
    asked = np.flatnonzero(seen)
    if not len(asked) or not len(faces):
        return
    count = len(asked)
    both = np.concatenate([points[:, asked], (vertices_m - origin_m).T], axis=1).astype(np.float32)
    faces = faces + np.int32(count)
    needed = np.zeros((1, both.shape[1]), np.uint8)
    needed[0, :count] = 1
    if not kernels_ready():
        seen[asked] = exact_visibility(both, faces, sensor, needed[0] > 0)[:count]
        return
    visible = np.zeros_like(needed)
    exact_visibility_kernel(both[None], faces, sensor, needed, 0, 1, visible)
    seen[asked] = visible[0, :count]


def may_hide(
    hiding_m: NDArray[np.float64], hidden_m: NDArray[np.float64], places_m: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Frames (n,) in which something in one box may hide something in another.

    It cannot where the boxes do not overlap in the sensor's picture, or the first lies deeper.

    Parameters
    ----------
    hiding_m, hidden_m : float64 array, shape (n, 2, 3)
        Lowest and highest corner of each box, in the frame of the sensor's place.
    places_m : float64 array, shape (n, 3)
        Of the sensor.
    """
    away = hidden_m.mean(axis=1) - places_m
    axes = np.empty((len(away), 3, 3))  # right, up and forward
    axes[:, 2] = away / np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-12)
    # A direction that is not along forward.
    aside = np.eye(3)[np.abs(axes[:, 2]).argmin(axis=1)]
    axes[:, 0] = np.cross(aside, axes[:, 2])
    axes[:, 0] /= np.maximum(np.linalg.norm(axes[:, 0], axis=1, keepdims=True), 1e-12)
    axes[:, 1] = np.cross(axes[:, 2], axes[:, 0])

    def seen(ends_m: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
        """Depths (n, 8) of a box's corners, and their places in the picture, (n, 2, 8)."""
        corners = ends_m[:, CORNERS, [0, 1, 2]] - places_m[:, None]  # (n, 8, 3)
        turned = axes @ corners.transpose(0, 2, 1)
        return turned[:, 2], turned[:, :2] / np.maximum(turned[:, 2:], 1e-9)

    (depth, picture), (far, behind) = seen(hiding_m), seen(hidden_m)
    overlap = (picture.min(axis=2) <= behind.max(axis=2) + _ROOM) & (
        picture.max(axis=2) >= behind.min(axis=2) - _ROOM
    )
    nearer = depth.min(axis=1) <= far.max(axis=1)
    # Of a box that reaches around the sensor or behind it, no picture tells.
    around = (depth.min(axis=1) <= 1e-3) | (far.min(axis=1) <= 1e-3)
    return around | (overlap.all(axis=1) & nearer)
