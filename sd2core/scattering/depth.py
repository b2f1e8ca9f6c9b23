"""Visibility by a depth buffer: the fast, approximate rung below exact.

Each frame's triangles are drawn into a square picture of the depths that the
sensor sees. A vertex counts when one of its triangles faces the sensor and it lies
no deeper than the picture says at its place, within a bias. Faces must be oriented
outwards, as for the facing test (see docs/decisions/0010).

Where one image plane does not serve (the body more than 63 degrees off the axis,
or around the sensor), the frame is decided exactly.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sd2core.compiled import compiled
from sd2core.scattering.exact import EDGE, WIDEST, axes_along, exact_visibility_kernel

BIAS_PIXELS = 0.7
"""A vertex may lie this much deeper than the picture, in pixels at its own range.

For a body of 1.8 m that is 1 cm at 128 pixels and 5 mm at 256. It grows and
shrinks with the body; the sensor's distance does not change it."""

RIM_PIXELS = 3.0
"""The same beside an empty pixel: there a round surface turns away within a pixel."""

LOOSE = 2
"""Facing is unknown: no triangle with an area belongs to the vertex."""

THINNEST = 1e-9
"""A triangle thinner than this, in pixels, covers none."""

ALMOST_ONE = 1.0 - 1e-9
"""Added before rounding down to round up; a pixel on the edge belongs to both sides."""


@compiled
def _project(positions, sensor, centre, axes, picture) -> float:  # type: ignore[no-untyped-def]
    """Image coordinates and depth of one frame's vertices, in metres at the body.

    ``picture`` (4, V) receives right, up, the projective depth and the ratio of the
    distance of the body's centre to the vertex's own depth. The projective depth is
    the depth behind the centre times that ratio: linear over the image, free of
    cancellation for far sensors. Returns the distance to the centre, or 0 when one
    plane does not serve.
    """
    low, high = np.empty(3, np.float64), np.empty(3, np.float64)
    distance = 0.0
    for axis in range(3):
        row = positions[axis]
        least = most = row[0]
        for v in range(row.shape[0]):
            least, most = min(least, row[v]), max(most, row[v])
        low[axis], high[axis] = least, most
        centre[axis] = 0.5 * (low[axis] + high[axis])
        distance += (centre[axis] - sensor[axis]) ** 2
    distance = np.sqrt(distance)
    if distance == 0:
        return 0.0
    axes_along(
        (centre[0] - sensor[0]) / distance,
        (centre[1] - sensor[1]) / distance,
        (centre[2] - sensor[2]) / distance,
        axes,
    )
    x, y, z = positions[0], positions[1], positions[2]
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
    return distance if widest <= 0 and nearest > 0 else 0.0


@compiled
def _draw(picture, faces, depths, facing) -> None:  # type: ignore[no-untyped-def]
    """Draw the nearest depth into each pixel whose centre a triangle covers.

    ``picture`` (4, V) holds columns and rows in pixels, ``depths`` infinity where
    there is nothing. ``facing`` (V,) starts as :data:`LOOSE` and receives whether a
    triangle of the vertex faces the sensor.
    """
    x, y, depth = picture[0], picture[1], picture[2]
    for f in range(faces.shape[0]):
        i, j, k = faces[f, 0], faces[f, 1], faces[f, 2]
        x0, x1, x2 = x[i], x[j], x[k]
        y0, y1, y2 = y[i], y[j], y[k]
        left, right = min(x0, x1, x2), max(x0, x1, x2)
        top, bottom = min(y0, y1, y2), max(y0, y1, y2)
        area = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
        if abs(area) <= THINNEST * (right - left + bottom - top):
            continue
        for v in (i, j, k):
            # The view looks away from the sensor: what turns left outside turns right.
            if area < 0:
                facing[v] = 1
            elif facing[v] == LOOSE:
                facing[v] = 0
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


@compiled
def depth_visibility_kernel(
    positions: NDArray[np.float32],  # (n, 3, V)
    faces: NDArray[np.int32],  # (F, 3)
    sensor: NDArray[np.float64],  # (3,), in the frame of positions
    resolution: int,
    needed: NDArray[np.uint8],  # (n, V): which vertices to test
    first: int,
    last: int,
    visible: NDArray[np.uint8],  # (n, V), written where needed
) -> None:
    """Set ``visible`` of the needed vertices in frames ``first`` to ``last``."""
    vertices = positions.shape[2]
    picture = np.empty((4, vertices), np.float64)
    depths = np.empty((resolution, resolution), np.float64)
    facing = np.empty(vertices, np.uint8)
    axes = np.empty((3, 3), np.float64)
    centre = np.empty(3, np.float64)
    for t in range(first, last):
        wanted = False
        for v in range(vertices):
            wanted |= needed[t, v] != 0
        if not wanted:
            continue
        if _project(positions[t], sensor, centre, axes, picture) == 0:
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
        _draw(picture, faces, depths, facing)
        _look_up(picture, depths, facing, pixel, needed[t], visible[t])


@compiled
def _look_up(picture, depths, facing, pixel, needed, visible) -> None:  # type: ignore[no-untyped-def]
    """Compare the needed vertices of one frame with the picture."""
    for v in range(needed.shape[0]):
        if needed[v] == 0:
            continue
        if facing[v] == 0:
            visible[v] = 0
            continue
        column, row = int(picture[0, v]), int(picture[1, v])
        u, w = picture[0, v] - column, picture[1, v] - row
        a, b = depths[row, column], depths[row, column + 1]
        c, d = depths[row + 1, column], depths[row + 1, column + 1]
        if max(max(a, b), max(c, d)) < np.inf:
            limit = (1 - w) * ((1 - u) * a + u * b) + w * ((1 - u) * c + u * d)
            bias = BIAS_PIXELS
        else:
            limit = -np.inf
            for corner in (a, b, c, d):
                if corner < np.inf:
                    limit = max(limit, corner)
            bias = RIM_PIXELS
        near = limit == -np.inf or picture[2, v] <= limit + bias * pixel * picture[3, v]
        visible[v] = 1 if near else 0


def compile_kernels() -> None:
    """Call every kernel of this module once."""
    positions = np.array([[[0, 1, 0], [0, 0, 1], [2, 2, 2]]], np.float32)
    faces = np.array([[0, 1, 2]], np.int32)
    marks = np.ones((1, 3), np.uint8)
    depth_visibility_kernel(positions, faces, np.zeros(3), 128, marks, 0, 1, marks.copy())
