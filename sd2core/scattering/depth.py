"""Visibility by a depth buffer: fast and approximate.

Each frame's triangles are drawn into a square picture of the depths that the
sensor sees. It decides for the vertices that lie clearly on or clearly behind the
surface in it; a vertex beside a rim, or close beneath another surface, is decided
by exact's own search. A vertex counts only when one of its triangles faces the
sensor, and of a closed surface only such triangles are drawn: faces must be
oriented outwards (see docs/decisions/0010).

Where one image plane does not suffice (the body more than 63 degrees off the axis,
or around the sensor), the frame is decided exactly.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sd2core.numerics.compiled import compiled
from sd2core.scattering.exact import (
    CONTACT,
    EDGE,
    WIDEST,
    axes_along,
    exact_visibility_kernel,
    search_view,
    surface_box,
)

SMOOTH_PIXELS = 8.0
"""Four neighbouring pixels whose depths differ by less than this, in pixels at the
vertex's own range, show one surface; otherwise a rim may pass between them."""

ON_IT_PIXELS = 0.5
"""A vertex that lies no deeper than this behind the surface lies on it.

For a body of 1.8 m that is 7 mm at 128 pixels and 4 mm at 256. It grows and shrinks
with the body; the sensor's distance does not change it."""

BEHIND_PIXELS = 0.5
"""A vertex deeper by this than all four pixels is hidden."""

LOOSE = 2
"""Value of ``facing`` for a vertex without a triangle that has an area."""

THINNEST = 1e-9
"""A triangle thinner than this, in pixels, covers none."""

ALMOST_ONE = 1.0 - 1e-9
"""Added before rounding down to round up; a pixel on the edge belongs to both sides."""


@compiled
def _project(positions, faces, sensor, centre, axes, picture) -> float:  # type: ignore[no-untyped-def]
    """Image coordinates and depth of one frame's vertices, in metres at the body.

    ``picture`` (4, V) receives right, up, the projective depth and the ratio of the
    distance of the body's centre to the vertex's own depth. The projective depth is
    the depth behind the centre times that ratio: linear over the image, free of
    cancellation for far sensors. Returns the size of the surface, or −1 when one plane
    does not serve.
    """
    x, y, z = positions[0], positions[1], positions[2]
    low, high = surface_box(x, y, z, faces)
    centre[:] = 0.5 * (low + high)
    distance = np.sqrt(((centre - sensor) ** 2).sum())
    if distance == 0:
        return -1.0
    axes_along(
        (centre[0] - sensor[0]) / distance,
        (centre[1] - sensor[1]) / distance,
        (centre[2] - sensor[2]) / distance,
        axes,
    )
    widest = -np.inf
    nearest = np.inf
    for v in range(x.shape[0]):
        px, py, pz = x[v] - centre[0], y[v] - centre[1], z[v] - centre[2]
        right = axes[0, 0] * px + axes[0, 1] * py + axes[0, 2] * pz
        up = axes[1, 0] * px + axes[1, 1] * py + axes[1, 2] * pz
        behind = axes[2, 0] * px + axes[2, 1] * py + axes[2, 2] * pz
        widest = max(widest, abs(right) + abs(up) - WIDEST * (distance + behind))
        nearest = min(nearest, distance + behind)
        scale = distance / (distance + behind)
        picture[0, v], picture[1, v] = right * scale, up * scale
        picture[2, v], picture[3, v] = behind * scale, scale
    return np.sqrt(((high - low) ** 2).sum()) if widest <= 0 and nearest > 0 else -1.0


@compiled
def _draw(picture, faces, closed, depths, facing, drawn) -> int:  # type: ignore[no-untyped-def]
    """Draw the nearest depth into each pixel whose centre a triangle covers.

    ``picture`` (4, V) holds columns and rows in pixels, ``depths`` infinity where
    there is nothing. ``facing`` (V,) starts as :data:`LOOSE` and receives whether a
    triangle of the vertex faces the sensor, ``drawn`` (F, 3) the triangles that can
    hide something. Returns how many.
    """
    x, y, depth = picture[0], picture[1], picture[2]
    count = 0
    for f in range(faces.shape[0]):
        i, j, k = faces[f, 0], faces[f, 1], faces[f, 2]
        x0, x1, x2 = x[i], x[j], x[k]
        y0, y1, y2 = y[i], y[j], y[k]
        left, right = min(x0, x1, x2), max(x0, x1, x2)
        top, bottom = min(y0, y1, y2), max(y0, y1, y2)
        area = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
        if abs(area) <= THINNEST * (right - left + bottom - top):
            continue
        # The view looks away from the sensor: what turns left outside turns right.
        if area < 0:
            facing[i] = facing[j] = facing[k] = 1
        else:
            for v in (i, j, k):
                if facing[v] == LOOSE:
                    facing[v] = 0
            if closed:
                continue
        drawn[count, 0], drawn[count, 1], drawn[count, 2] = i, j, k
        count += 1
        # Columns and rows are positive: truncating is rounding down.
        c0, c1 = int(left + ALMOST_ONE), int(right)
        r0, r1 = int(top + ALMOST_ONE), int(bottom)
        if c0 > c1 or r0 > r1:
            continue
        part = 1.0 / area
        d0, d1, d2 = depth[i], depth[j], depth[k]
        for row in range(r0, r1 + 1):
            for column in range(c0, c1 + 1):
                w0 = ((x1 - column) * (y2 - row) - (x2 - column) * (y1 - row)) * part
                w1 = ((x2 - column) * (y0 - row) - (x0 - column) * (y2 - row)) * part
                w2 = 1.0 - w0 - w1
                if min(w0, w1, w2) >= -EDGE:
                    here = w0 * d0 + w1 * d1 + w2 * d2
                    depths[row, column] = min(depths[row, column], here)
    return count


@compiled
def _look_up(picture, depths, facing, pixel, needed, visible, doubtful) -> int:  # type: ignore[no-untyped-def]
    """Compare the needed vertices of one frame with the picture.

    ``doubtful`` (V,) receives those that it cannot decide; they count as visible.
    Returns how many there are.
    """
    count = 0
    for v in range(needed.shape[0]):
        doubtful[v] = 0
        if needed[v] == 0:
            continue
        if facing[v] == 0:
            visible[v] = 0
            continue
        visible[v] = 1
        column, row = int(picture[0, v]), int(picture[1, v])
        a, b = depths[row, column], depths[row, column + 1]
        c, d = depths[row + 1, column], depths[row + 1, column + 1]
        nearest, farthest = min(min(a, b), min(c, d)), max(max(a, b), max(c, d))
        depth, one = picture[2, v], pixel * picture[3, v]
        if nearest < np.inf and depth <= nearest + ON_IT_PIXELS * one:
            continue
        if farthest < np.inf:
            if depth > farthest + BEHIND_PIXELS * one:
                visible[v] = 0
                continue
            if farthest - nearest <= SMOOTH_PIXELS * one:
                u, w = picture[0, v] - column, picture[1, v] - row
                surface = (1 - w) * ((1 - u) * a + u * b) + w * ((1 - u) * c + u * d)
                if depth <= surface + ON_IT_PIXELS * one:
                    continue
        doubtful[v] = 1
        count += 1
    return count


@compiled
def depth_visibility_kernel(
    positions: NDArray[np.float32],
    faces: NDArray[np.int32],
    closed: bool,
    sensor: NDArray[np.float64],
    resolution: int,
    needed: NDArray[np.uint8],
    first: int,
    last: int,
    visible: NDArray[np.uint8],
) -> None:
    """Set ``visible`` of the needed vertices in frames ``first`` to ``last``.

    Parameters
    ----------
    positions : float array, shape (n, 3, V)
        Metres.
    faces : int32 array, shape (F, 3)
        Counter-clockwise seen from outside.
    closed : bool
        They enclose a body, as :func:`.visibility.encloses` says.
    sensor : float64 array, shape (3,)
        In the frame of the positions.
    resolution : int
        Pixels along each side of the depth buffer.
    needed : uint8 array, shape (n, V)
        Which vertices to test.
    first, last : int
        Half-open range of frames.
    visible : uint8 array, shape (n, V)
        Written where needed.
    """
    vertices = positions.shape[2]
    picture = np.empty((4, vertices), np.float64)
    depths = np.empty((resolution, resolution), np.float64)
    facing = np.empty(vertices, np.uint8)
    drawn = np.empty(faces.shape, np.int32)
    doubtful = np.empty(vertices, np.uint8)
    axes = np.empty((3, 3), np.float64)
    centre = np.empty(3, np.float64)
    # Of the search.
    towards = np.empty((3, vertices), np.float64)
    image, depth = np.empty((2, vertices), np.float32), np.empty(vertices, np.float32)
    for t in range(first, last):
        wanted = False
        for v in range(vertices):
            wanted |= needed[t, v] != 0
        if not wanted:
            continue
        size = _project(positions[t], faces, sensor, centre, axes, picture)
        if size < 0:
            exact_visibility_kernel(positions, faces, sensor, needed, t, t + 1, visible)
            continue
        x, y = picture[0], picture[1]
        xmin = ymin = np.inf
        xmax = ymax = -np.inf
        for v in range(vertices):
            xmin, xmax = min(xmin, x[v]), max(xmax, x[v])
            ymin, ymax = min(ymin, y[v]), max(ymax, y[v])
        pixel = max(xmax - xmin, ymax - ymin) / (resolution - 2)
        per_metre = 1.0 / pixel if pixel > 0 else 0.0
        for v in range(vertices):
            x[v] = (x[v] - xmin) * per_metre + 0.5
            y[v] = (y[v] - ymin) * per_metre + 0.5
        depths[:] = np.inf
        facing[:] = LOOSE
        triangles = _draw(picture, faces, closed, depths, facing, drawn)
        count = _look_up(picture, depths, facing, pixel, needed[t], visible[t], doubtful)
        if count == 0:
            continue
        for v in range(vertices):
            image[0, v], image[1, v], depth[v] = x[v], y[v], picture[2, v]
            for axis in range(3):
                towards[axis, v] = sensor[axis] - positions[t, axis, v]
        search_view(
            positions[t, 0], positions[t, 1], positions[t, 2], drawn[:triangles], towards, axes,
            np.float32(-np.inf), CONTACT * size, doubtful, count, image, depth,
            visible[t],
        )  # fmt: skip
