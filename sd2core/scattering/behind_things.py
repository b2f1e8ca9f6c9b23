"""Points that things around a body, or other bodies, hide from a sensor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sd2core.numerics.compiled import compiled
from sd2core.scattering.exact import see_frame

_ROOM = 1e-5
"""Tangent by which pictures are taken to be larger than they are, for roundings."""

_NEAR_M = 1e-3
"""Depth from which on a picture tells what is where."""


@dataclass(frozen=True, eq=False)
class Hiding:
    """Surface that may hide something, in each of n frames or the same (1) in all of them."""

    points: NDArray[np.float32]  # (n or 1, 3, W), relative to
    origins_m: NDArray[np.float64]  # (n or 1, 3), in the camera frame
    faces: NDArray[np.int32]  # (F, 3)
    boxes_m: NDArray[np.float64]
    """Ends of boxes around all of it, in the camera frame, (n or 1, K, 2, 3)."""
    counts: NDArray[np.uint8] | None = None
    """Vertices that hide at all, (n, W): faces without any do not. None: all."""

    @classmethod
    def still(
        cls,
        vertices_m: NDArray[np.float64],
        faces: NDArray[np.int32],
        boxes_m: NDArray[np.float64] | None = None,
    ) -> Hiding:
        """Still things, by their vertices (W, 3), in boxes (K, 2, 3) or in one around them."""
        if boxes_m is None:
            boxes_m = np.stack([vertices_m.min(axis=0), vertices_m.max(axis=0)])[None]
        origin_m = 0.5 * (boxes_m[:, 0].min(axis=0) + boxes_m[:, 1].max(axis=0))
        points = (vertices_m - origin_m).T[None]
        return cls(np.ascontiguousarray(points, np.float32), origin_m[None], faces, boxes_m[None])


@compiled
def may_hide(
    hiding_m: NDArray[np.float64], hidden_m: NDArray[np.float64], place_m: NDArray[np.float64]
) -> bool:
    """True if something in one box may hide something in another.

    It cannot where the boxes do not overlap in the sensor's picture, or the first lies deeper.

    Parameters
    ----------
    hiding_m, hidden_m : float64 array, shape (2, 3)
        Lowest and highest corner of each box, in the frame of the sensor's place.
    place_m : float64 array, shape (3,)
        Of the sensor.
    """
    # The picture is that along the axis of the frame which points most towards the second box.
    forward, most, sign = 0, -1.0, 1.0
    for axis in range(3):
        away = 0.5 * (hidden_m[0, axis] + hidden_m[1, axis]) - place_m[axis]
        if abs(away) > most:
            forward, most, sign = axis, abs(away), -1.0 if away < 0 else 1.0
    first, last = (0, 1) if sign > 0 else (1, 0)
    near = sign * (hiding_m[first, forward] - place_m[forward])
    deep = sign * (hiding_m[last, forward] - place_m[forward])
    front = sign * (hidden_m[first, forward] - place_m[forward])
    back = sign * (hidden_m[last, forward] - place_m[forward])
    # Of a box that reaches around the sensor or behind it, no picture tells.
    if near <= _NEAR_M or front <= _NEAR_M:
        return True
    if near > back:
        return False
    for axis in range(3):
        if axis == forward:
            continue
        low, high = hiding_m[0, axis] - place_m[axis], hiding_m[1, axis] - place_m[axis]
        under, over = hidden_m[0, axis] - place_m[axis], hidden_m[1, axis] - place_m[axis]
        if min(low / near, low / deep) > max(over / front, over / back) + _ROOM:
            return False
        if max(high / near, high / deep) < min(under / front, under / back) - _ROOM:
            return False
    return True


@compiled
def _hide_behind_kernel(  # type: ignore[no-untyped-def]
    surface, surface_origins_m, faces, boxes_m, counts,
    points, origins_m, places_m, needed, visible,
) -> None:  # fmt: skip
    """Do :func:`hide_behind`; ``counts`` (0, W) for all."""
    vertices, width = points.shape[2], surface.shape[2]
    room = vertices + width
    marked = np.zeros(room, np.uint8)
    both, seen = np.empty((3, room), np.float32), np.empty(room, np.uint8)
    asked, kept = np.empty(vertices, np.int32), np.empty_like(faces)
    box_m = np.empty((2, 3), np.float64)
    marked[width:] = 1
    for t in range(points.shape[0]):
        count = 0
        for v in range(vertices):
            asked[count] = v
            count += visible[t, v] & needed[t, v]
        if count == 0:
            continue
        for axis in range(3):
            low = high = points[t, axis, asked[0]]
            for number in range(count):
                value = points[t, axis, asked[number]]
                both[axis, width + number] = value
                low, high = min(low, value), max(high, value)
            box_m[0, axis] = np.float64(low) + origins_m[t, axis]
            box_m[1, axis] = np.float64(high) + origins_m[t, axis]
        place_m = places_m[t] + origins_m[t]
        boxes, near = boxes_m[min(t, len(boxes_m) - 1)], False
        for box in range(len(boxes)):
            near |= may_hide(boxes[box], box_m, place_m)
        if not near:
            continue
        at = min(t, len(surface) - 1)
        for axis in range(3):
            shift_m = surface_origins_m[at, axis] - origins_m[t, axis]
            for w in range(width):
                both[axis, w] = np.float64(surface[at, axis, w]) + shift_m
        hiding = faces
        if len(counts):
            left = 0
            for f in range(len(faces)):
                i, j, k = faces[f]
                kept[left] = faces[f]
                left += (counts[t, i] | counts[t, j] | counts[t, k]) != 0
            hiding = kept[:left]
        x, y, z = both[0, : width + count], both[1, : width + count], both[2, : width + count]
        see_frame(x, y, z, hiding, places_m[t], marked, count, seen)
        for number in range(count):
            visible[t, asked[number]] = seen[width + number]


def hide_behind(
    hiding: Hiding,
    points: NDArray[np.float32],
    origins_m: NDArray[np.float64],
    places_m: NDArray[np.float64],
    needed: NDArray[np.uint8],
    visible: NDArray[np.uint8],
) -> None:
    """Set ``visible`` to 0 for the points of n frames that another surface hides.

    A second test beside that of the body itself, and always exact: the pixels of a depth buffer
    are as fine with a table beside the body as without.

    Parameters
    ----------
    hiding : Hiding
        That surface.
    points : float32 array, shape (n, 3, V)
        Relative to ``origins_m``.
    origins_m : float64 array, shape (n, 3)
        In the camera frame.
    places_m : float64 array, shape (n, 3)
        Of the sensor, in the frame of the points.
    needed : uint8 array, shape (n, V)
        1 for the points that are tested where they are visible.
    visible : uint8 array, shape (n, V)
    """
    if not len(hiding.faces):
        return
    counts = hiding.counts
    _hide_behind_kernel(
        hiding.points, hiding.origins_m, hiding.faces, hiding.boxes_m,
        np.empty((0, hiding.points.shape[2]), np.uint8) if counts is None else counts,
        points, origins_m, places_m, needed, visible,
    )  # fmt: skip
