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

_NEAR_M = 1e-3
"""Depth from which on a picture tells what is where."""


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
    count = len(vertices_m)
    both = np.empty((3, count + len(asked)), np.float32)
    np.subtract(vertices_m.T, origin_m[:, None], out=both[:, :count], casting="same_kind")
    both[:, count:] = points[:, asked]
    needed = np.zeros((1, both.shape[1]), np.uint8)
    needed[0, count:] = 1
    if not kernels_ready():
        seen[asked] = exact_visibility(both, faces, sensor, needed[0] > 0)[count:]
        return
    visible = np.zeros_like(needed)
    exact_visibility_kernel(both[None], faces, sensor, needed, 0, 1, visible)
    seen[asked] = visible[0, count:]


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
    # The picture is that along the axis of the frame which points most towards the second boxes.
    away = (hidden_m.mean(axis=1) - places_m).sum(axis=0)
    forward = int(np.abs(away).argmax())
    aside, sign = [axis for axis in range(3) if axis != forward], -1.0 if away[forward] < 0 else 1.0

    def seen(ends_m: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
        """Depths (n, 8) of a box's corners, and their places in the picture, (n, 8, 2)."""
        corners = (ends_m - places_m[:, None])[:, CORNERS, [0, 1, 2]]  # (n, 8, 3)
        depth = sign * corners[:, :, forward]
        return depth, corners[:, :, aside] / np.maximum(depth, 1e-9)[:, :, None]

    (depth, picture), (far, behind) = seen(hiding_m), seen(hidden_m)
    overlap = (picture.min(axis=1) <= behind.max(axis=1) + _ROOM) & (
        picture.max(axis=1) >= behind.min(axis=1) - _ROOM
    )
    nearer = depth.min(axis=1) <= far.max(axis=1)
    # Of a box that reaches around the sensor or behind it, no picture tells.
    around = (depth.min(axis=1) <= _NEAR_M) | (far.min(axis=1) <= _NEAR_M)
    return around | (overlap.all(axis=1) & nearer)
