"""Exact visibility in NumPy.

The same rule as :mod:`sd2core.scattering.exact`, reached by another way: double
precision throughout, and always the six faces of a cube around the sensor unless
the whole body lies well within one of them.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.scattering.exact import CONTACT, EDGE

_FLAT = 1e-13
_CELLS = 64
_PAIRS_AT_ONCE = 1 << 20


def exact_visibility(
    points: NDArray[Any],
    faces: NDArray[np.int32],
    sensor: NDArray[np.float64],
    needed: NDArray[np.bool_],
) -> NDArray[np.bool_]:
    """Mark the needed vertices of one frame that no face hides, shape (V,).

    Parameters
    ----------
    points : float array, shape (3, V)
        Metres.
    faces : int32 array, shape (F, 3)
        Oriented in any way.
    sensor : float64 array, shape (3,)
        In the frame of the points.
    needed : bool array, shape (V,)
    """
    seen = needed.copy()
    place = np.asarray(points, np.float64).T  # (V, 3)
    size = float(np.linalg.norm(np.ptp(place, axis=0)))
    contact = CONTACT * size
    ray = place - sensor
    towards = 0.5 * (place.min(axis=0) + place.max(axis=0)) - sensor
    distance = float(np.linalg.norm(towards))
    view = _axes_along(towards / distance) if distance > 0 else np.eye(3)
    local = ray @ view.T
    if distance > 0 and (np.abs(local[:, :2]).sum(axis=1) < local[:, 2]).all():
        views = [(view, needed)]
    else:
        main = np.abs(ray).argmax(axis=1)
        sign = np.take_along_axis(ray, main[:, None], axis=1)[:, 0] >= 0
        views = []
        for axis in range(3):
            for positive in (False, True):
                axes = np.eye(3)[[(axis + 1) % 3, (axis + 2) % 3, axis]]
                axes[2] *= 1.0 if positive else -1.0
                views.append((axes, needed & (main == axis) & (sign == positive)))
    for axes, owned in views:
        owned = owned & (ray @ axes[2] > contact)
        if owned.any():
            _search(place, faces, sensor, ray @ axes.T, np.flatnonzero(owned), contact, seen)
    return seen


def _axes_along(forward: NDArray[np.float64]) -> NDArray[np.float64]:
    right = np.cross(forward, np.eye(3)[np.abs(forward).argmin()])
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(forward, right), forward])


def _search(
    place: NDArray[np.float64],
    faces: NDArray[np.int32],
    sensor: NDArray[np.float64],
    local: NDArray[np.float64],
    owned: NDArray[np.intp],
    contact: float,
    seen: NDArray[np.bool_],
) -> None:
    depth = local[:, 2]
    with np.errstate(divide="ignore", invalid="ignore"):
        image = local[:, :2] / depth[:, None]
    low, high = image[owned].min(axis=0), image[owned].max(axis=0)
    cell_size = max(float((high - low).max()), 1e-12) / _CELLS
    columns = int((high - low)[0] / cell_size) + 1
    rows = int((high - low)[1] / cell_size) + 1

    corner_depth = depth[faces]
    ahead = corner_depth.max(axis=1) > contact
    whole = corner_depth.min(axis=1) > contact
    with np.errstate(invalid="ignore"):
        # A triangle that reaches behind the view may cover any part of it.
        top_left = np.where(whole[:, None], image[faces].min(axis=1), low)
        bottom_right = np.where(whole[:, None], image[faces].max(axis=1), high)
    nearest = np.where(whole, corner_depth.min(axis=1), 0.0)
    slack = 1e-9
    ahead &= (bottom_right >= low - slack).all(axis=1) & (top_left <= high + slack).all(axis=1)
    chosen = np.flatnonzero(ahead)
    if not len(chosen):
        return
    first = np.clip(((top_left[chosen] - slack - low) / cell_size).astype(int), 0, None)
    last = ((bottom_right[chosen] + slack - low) / cell_size).astype(int)
    limit = np.array([columns, rows]) - 1
    first, last = np.minimum(first, limit), np.clip(last, 0, limit)

    cells = ((image[owned] - low) / cell_size).astype(int)
    cells = np.minimum(cells, limit)
    number = cells[:, 1] * columns + cells[:, 0]
    order = owned[np.argsort(number, kind="stable")]
    starts = np.concatenate([[0], np.cumsum(np.bincount(number, minlength=columns * rows))])

    # One entry per triangle and row of cells, then one per triangle and vertex.
    heights = last[:, 1] - first[:, 1] + 1
    strip = np.repeat(np.arange(len(chosen)), heights)
    row = first[strip, 1] + _count_within(heights)
    begin = starts[row * columns + first[strip, 0]]
    lengths = starts[row * columns + last[strip, 0] + 1] - begin
    if not lengths.any():
        return
    cuts = np.searchsorted(
        np.cumsum(lengths), np.arange(0, int(lengths.sum()) + _PAIRS_AT_ONCE, _PAIRS_AT_ONCE)
    )
    for a, b in zip(cuts[:-1], [*cuts[1:-1], len(lengths)], strict=True):
        triangle = chosen[np.repeat(strip[a:b], lengths[a:b])]
        vertex = order[np.repeat(begin[a:b], lengths[a:b]) + _count_within(lengths[a:b])]
        possible = (
            seen[vertex]
            & (depth[vertex] > nearest[triangle])
            & (image[vertex] >= top_left[triangle] - slack).all(axis=1)
            & (image[vertex] <= bottom_right[triangle] + slack).all(axis=1)
            & (faces[triangle] != vertex[:, None]).all(axis=1)
        )
        triangle, vertex = triangle[possible], vertex[possible]
        hidden = crosses(place, faces[triangle], vertex, sensor, contact)
        seen[vertex[hidden]] = False


def _count_within(lengths: NDArray[Any]) -> NDArray[np.intp]:
    """0, 1, … within each run of the given lengths."""
    ends = np.cumsum(lengths)
    return np.arange(int(lengths.sum())) - np.repeat(ends - lengths, lengths)


def crosses(
    place: NDArray[np.float64],
    corners: NDArray[np.int32],
    vertex: NDArray[np.intp],
    sensor: NDArray[np.float64],
    contact: float,
) -> NDArray[np.bool_]:
    """Tell for each triangle if it crosses the open segment from its vertex to the sensor.

    Parameters
    ----------
    place : float64 array, shape (V, 3)
        Of the vertices, metres.
    corners : int32 array, shape (n, 3)
        Of the triangles.
    vertex : int array, shape (n,)
        The vertex of each triangle's segment.
    sensor : float64 array, shape (3,)
    contact : float
        Metres that are left out at both ends of the segment.

    Returns
    -------
    bool array, shape (n,)
    """
    start = place[vertex]
    ray = sensor - start
    length = np.linalg.norm(ray, axis=1)
    far = length > 2 * contact
    direction = ray / np.where(far, length, 1.0)[:, None]
    a, b, c = (place[corners[:, corner]] - start for corner in range(3))
    edge1, edge2 = b - a, c - a
    h = np.cross(direction, edge2)
    det = (edge1 * h).sum(axis=1)
    size = np.linalg.norm(edge1, axis=1) * np.linalg.norm(edge2, axis=1)
    solid = far & (np.abs(det) > _FLAT * size)
    safe = np.where(solid, det, 1.0)
    u = -(a * h).sum(axis=1) / safe
    q = np.cross(edge1, a)
    w = (direction * q).sum(axis=1) / safe
    along = (edge2 * q).sum(axis=1) / safe
    inside = (u >= -EDGE) & (w >= -EDGE) & (u + w <= 1 + EDGE)
    return solid & inside & (along > contact) & (along < length - contact)
