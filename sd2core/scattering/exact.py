"""Exact visibility: compiled search on the sensor's image plane.

All rays meet at the sensor. Vertices are sorted into the cells of the sensor's
image plane; each triangle then meets only the few vertices in the cells that it
covers, and leaves out those in front of it. This search is single precision with
a safety margin, so it can only propose too much. The final test of a vertex is
in double precision, in space: a triangle must cross the open segment between
vertex and sensor (see docs/decisions/0003).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.numerics.compiled import compiled

CONTACT = 1e-6
"""Nearer to either end of the segment than this share of the body's size, a
triangle touches and does not hide (doubled seam vertices, a sensor on the skin)."""

EDGE = 1e-9
"""A triangle is this much larger in barycentric terms, so that a ray through a
common edge cannot slip between two triangles."""

_FLAT = 1e-13
"""Triangles seen more exactly edge-on than this, or without area, hide nothing."""

WIDEST = 2.0
"""Up to this tangent from the axis one image plane serves; beyond, six (a cube)."""

_ROUNDING = np.float32(1e-6)
"""Error of single-precision image coordinates, generously, relative to their size."""

_COLUMNS_PER_ROOT, _ROWS_PER_ROOT = 4.0, 0.7
_MAX_COLUMNS, _MAX_ROWS = 1024, 192
"""Cells of the image plane, per square root of the number of vertices, up to that many.

Beginning a row costs more than passing over a vertex: few rows, finely divided."""

LANES = 8
"""Vertices met at a time: as many as a vector register holds single-precision numbers."""


@compiled
def hides(  # type: ignore[no-untyped-def]
    x, y, z, i: int, j: int, k: int, v: int, gx: float, gy: float, gz: float, contact: float
) -> bool:
    """True if triangle (i, j, k) crosses the open segment from vertex v to the sensor.

    Möller and Trumbore's test in double precision, with everything relative to the vertex.

    Parameters
    ----------
    x, y, z : float array, shape (V,)
        Places of the vertices.
    i, j, k, v : int
    gx, gy, gz : float
        Vector from the vertex to the sensor.
    contact : float
        Length that is left out at both ends of the segment.
    """
    length = np.sqrt(gx * gx + gy * gy + gz * gz)
    if length <= 2 * contact:
        return False
    dx, dy, dz = gx / length, gy / length, gz / length
    px, py, pz = np.float64(x[v]), np.float64(y[v]), np.float64(z[v])
    ax, ay, az = x[i] - px, y[i] - py, z[i] - pz
    e1x, e1y, e1z = x[j] - px - ax, y[j] - py - ay, z[j] - pz - az
    e2x, e2y, e2z = x[k] - px - ax, y[k] - py - ay, z[k] - pz - az
    hx, hy, hz = dy * e2z - dz * e2y, dz * e2x - dx * e2z, dx * e2y - dy * e2x
    det = e1x * hx + e1y * hy + e1z * hz
    size = (e1x * e1x + e1y * e1y + e1z * e1z) * (e2x * e2x + e2y * e2y + e2z * e2z)
    if det * det <= _FLAT * _FLAT * size:
        return False
    u = -(ax * hx + ay * hy + az * hz) / det
    if u < -EDGE or u > 1 + EDGE:
        return False
    qx, qy, qz = e1y * az - e1z * ay, e1z * ax - e1x * az, e1x * ay - e1y * ax
    w = (dx * qx + dy * qy + dz * qz) / det
    if w < -EDGE or u + w > 1 + EDGE:
        return False
    along = (e2x * qx + e2y * qy + e2z * qz) / det
    return contact < along < length - contact


@compiled
def _clipped_bounds(a: NDArray[Any], near: float, bounds: NDArray[Any]) -> bool:
    """Image bounds of the part of a triangle beyond ``near``.

    ``a`` holds the corners' x, y, z per row in the view's frame; ``bounds``
    receives xmin, xmax, ymin, ymax of x/z and y/z. False: no such part.
    """
    exists = False
    for corner in range(3):
        other = (corner + 1) % 3
        z0, z1 = a[corner, 2], a[other, 2]
        for end in range(2):
            if end == 0:
                if z0 < near:
                    continue
                px, py = a[corner, 0] / z0, a[corner, 1] / z0
            else:
                if (z0 < near) == (z1 < near):
                    continue
                s = (near - z0) / (z1 - z0)
                px = (a[corner, 0] + s * (a[other, 0] - a[corner, 0])) / near
                py = (a[corner, 1] + s * (a[other, 1] - a[corner, 1])) / near
            if not exists:
                bounds[0] = bounds[1] = px
                bounds[2] = bounds[3] = py
                exists = True
            bounds[0], bounds[1] = min(bounds[0], px), max(bounds[1], px)
            bounds[2], bounds[3] = min(bounds[2], py), max(bounds[3], py)
    return exists


@compiled
def _proposed(  # type: ignore[no-untyped-def]
    sorted_x, sorted_y, sorted_depth, order, begin,
    x0, y0, x1, y1, x2, y2, left, right, top, bottom, least, nearest, i, j, k,
) -> np.int32:  # fmt: skip
    """Bits of the :data:`LANES` vertices from ``begin`` that triangle (i, j, k) may hide.

    Nearly every vertex fails some condition, but not a predictable one:
    without branches, the compiler judges all lanes at once.
    """
    bits = np.int32(0)
    first = np.uint64(begin)  # unsigned, so that no index is looked at for being negative
    for lane in range(LANES):
        at = first + np.uint64(lane)
        px, py, v = sorted_x[at], sorted_y[at], order[at]
        ax, ay, bx, by, cx, cy = x0 - px, y0 - py, x1 - px, y1 - py, x2 - px, y2 - py
        wa, wb, wc = bx * cy - cx * by, cx * ay - ax * cy, ax * by - bx * ay
        within = (px >= left) & (px <= right) & (py >= top) & (py <= bottom)
        within &= (wa >= least) & (wb >= least) & (wc >= least)
        within &= (sorted_depth[at] >= nearest) & (v != i) & (v != j) & (v != k)
        bits |= np.int32(within) << np.int32(lane)
    return bits


@compiled
def search_view(  # type: ignore[no-untyped-def]
    x, y, z, faces, g, axes, near, contact, owned, owned_count, image, depth, visible,
) -> None:  # fmt: skip
    """Set ``visible`` to 0 for the owned vertices that a triangle hides in one view.

    Parameters
    ----------
    x, y, z : float array, shape (V,)
        Places of the vertices.
    faces : int32 array, shape (F, 3)
        Triangles that may hide something.
    g : float64 array, shape (3, V)
        Sensor − vertex.
    axes : float64 array, shape (3, 3)
        The view's right, up and forward.
    near : float32
        In a view that looks in one direction only, cuts off triangles behind it.
    contact : float
        As for :func:`hides`.
    owned : uint8 array, shape (V,)
        Vertices that this view decides.
    owned_count : int
        Number of these.
    image : float32 array, shape (2, V)
        Image coordinates of each vertex.
    depth : float32 array, shape (V,)
        Depth of each vertex.
    visible : uint8 array, shape (V,)
    """
    vertices = depth.shape[0]
    xmin = ymin = np.float32(np.inf)
    xmax = ymax = dmax = np.float32(-np.inf)
    own = np.empty(owned_count, np.int32)
    at = 0
    for v in range(vertices):
        if owned[v]:
            own[at] = v
            at += 1
    for v in own:
        xmin, xmax = min(xmin, image[0, v]), max(xmax, image[0, v])
        ymin, ymax = min(ymin, image[1, v]), max(ymax, image[1, v])
        dmax = max(dmax, depth[v])
    # Each axis has its own cell size: a standing body is narrow and tall.
    columns = min(_MAX_COLUMNS, max(4, int(_COLUMNS_PER_ROOT * np.sqrt(owned_count))))
    rows = min(_MAX_ROWS, max(4, int(_ROWS_PER_ROOT * np.sqrt(owned_count))))
    wide, high = xmax - xmin, ymax - ymin
    cell, start = np.empty(vertices, np.int32), np.empty(columns * rows + 2, np.int32)
    # Sorted arrays have room for some lanes more.
    order = np.empty(owned_count + LANES, np.int32)
    sorted_image = np.empty((2, owned_count + LANES), np.float32)
    sorted_depth = np.empty(owned_count + LANES, np.float32)
    hidden = np.empty(owned_count, np.uint8)
    xscale = np.float32(columns) / wide if wide > 0 else np.float32(0)
    yscale = np.float32(rows) / high if high > 0 else np.float32(0)

    start[: columns * rows + 1] = 0
    for v in own:
        column = min(int((image[0, v] - xmin) * xscale), columns - 1)
        row = min(int((image[1, v] - ymin) * yscale), rows - 1)
        cell[v] = row * columns + column
        start[cell[v] + 1] += 1
    for c in range(columns * rows):
        start[c + 1] += start[c]
    for v in own[::-1]:
        # Filling each cell from its end leaves start one cell ahead; see below.
        start[cell[v] + 1] -= 1
        at = start[cell[v] + 1]
        order[at] = v
        sorted_image[0, at], sorted_image[1, at] = image[0, v], image[1, v]
        sorted_depth[at] = depth[v]
        hidden[at] = 0
    start[columns * rows + 1] = owned_count
    sorted_depth[owned_count : owned_count + LANES] = -np.inf

    sorted_x, sorted_y = sorted_image[0], sorted_image[1]
    corners = np.empty((3, 3), np.float64)
    bounds = np.empty(4, np.float64)
    for f in range(faces.shape[0]):
        i, j, k = faces[f, 0], faces[f, 1], faces[f, 2]
        d0, d1, d2 = depth[i], depth[j], depth[k]
        nearest = min(d0, d1, d2)
        if nearest > dmax:
            continue
        plain = nearest > near
        if plain:
            x0, x1, x2 = image[0, i], image[0, j], image[0, k]
            y0, y1, y2 = image[1, i], image[1, j], image[1, k]
            left, right = min(x0, x1, x2), max(x0, x1, x2)
            top, bottom = min(y0, y1, y2), max(y0, y1, y2)
        else:
            if max(d0, d1, d2) <= near:
                continue
            x0 = x1 = x2 = y0 = y1 = y2 = np.float32(0)
            for corner in range(3):
                v = faces[f, corner]
                for axis in range(3):
                    corners[corner, axis] = -(
                        axes[axis, 0] * g[0, v] + axes[axis, 1] * g[1, v] + axes[axis, 2] * g[2, v]
                    )
            if not _clipped_bounds(corners, np.float64(near), bounds):
                continue
            left, right = np.float32(bounds[0]), np.float32(bounds[1])
            top, bottom = np.float32(bounds[2]), np.float32(bounds[3])
            nearest = np.float32(0)
        reach = _ROUNDING * max(max(abs(left), abs(right)), max(abs(top), abs(bottom)))
        left, right, top, bottom = left - reach, right + reach, top - reach, bottom + reach
        if right < xmin or left > xmax or bottom < ymin or top > ymax:
            continue
        # An area test is this far from certain; a clipped triangle skips it.
        least = np.float32(-np.inf)
        if plain:
            least = np.float32(-8) * reach * ((right - left) + (bottom - top))
        c0 = min(int((max(left, xmin) - xmin) * xscale), columns - 1)
        c1 = min(int((min(right, xmax) - xmin) * xscale), columns - 1)
        r0 = min(int((max(top, ymin) - ymin) * yscale), rows - 1)
        r1 = min(int((min(bottom, ymax) - ymin) * yscale), rows - 1)
        if (x1 - x0) * (y2 - y0) < (x2 - x0) * (y1 - y0):
            x1, x2, y1, y2 = x2, x1, y2, y1
        # A run's last lanes may be other cells' vertices: they are judged like any.
        for row in range(r0, r1 + 1):
            first, last = start[row * columns + c0 + 1], start[row * columns + c1 + 2]
            for begin in range(first, last, LANES):
                bits = _proposed(
                    sorted_x, sorted_y, sorted_depth, order, begin,
                    x0, y0, x1, y1, x2, y2, left, right, top, bottom, least, nearest, i, j, k,
                )  # fmt: skip
                if bits == 0:
                    continue
                for at in range(begin, begin + LANES):
                    v = order[at]
                    if bits >> (at - begin) & 1 and hides(
                        x, y, z, i, j, k, v, g[0, v], g[1, v], g[2, v], contact
                    ):
                        # Nothing more can be behind a triangle here.
                        sorted_depth[at] = -np.inf
                        hidden[at] = 1
    for at in range(owned_count):
        if hidden[at]:
            visible[order[at]] = 0


@compiled
def surface_box(x, y, z, faces):  # type: ignore[no-untyped-def]
    """Lowest and highest corner of a surface, (3,) each; a loose vertex may be anywhere."""
    used = np.zeros(x.shape[0], np.uint8)
    for f in range(faces.shape[0]):
        used[faces[f, 0]] = used[faces[f, 1]] = used[faces[f, 2]] = 1
    low, high = np.empty(3, np.float64), np.empty(3, np.float64)
    for axis in range(3):
        p = x if axis == 0 else (y if axis == 1 else z)
        # In registers, and of a place that is used already: no branch, so that several go at once.
        least = most = first = p[faces[0, 0] if faces.shape[0] else 0]
        for v in range(p.shape[0]):
            place = p[v] if used[v] else first
            least, most = min(least, place), max(most, place)
        low[axis], high[axis] = least, most
    return low, high


@compiled
def see_frame(x, y, z, faces, sensor, needed, count, visible) -> None:  # type: ignore[no-untyped-def]
    """Set ``visible`` of the needed vertices of one frame that no triangle hides.

    Parameters
    ----------
    x, y, z : float array, shape (V,)
        Places of the vertices in metres.
    faces : int32 array, shape (F, 3)
        Oriented in any way.
    sensor : float64 array, shape (3,)
        In the frame of the places.
    needed : uint8 array, shape (V,)
        Which vertices to test.
    count : int
        Number of these.
    visible : uint8 array, shape (V,)
        Written where needed.
    """
    vertices = x.shape[0]
    g, axes = np.empty((3, vertices), np.float64), np.empty((3, 3), np.float64)
    image, depth = np.empty((2, vertices), np.float32), np.empty(vertices, np.float32)
    for v in range(vertices):
        if needed[v]:
            visible[v] = 1
        g[0, v], g[1, v], g[2, v] = sensor[0] - x[v], sensor[1] - y[v], sensor[2] - z[v]
    if faces.shape[0] == 0:
        return
    low, high = surface_box(x, y, z, faces)
    contact = CONTACT * np.sqrt(((high - low) ** 2).sum())
    away = 0.5 * (low + high) - sensor
    distance = np.sqrt(away[0] ** 2 + away[1] ** 2 + away[2] ** 2)

    narrow = distance > 0
    if narrow:
        axes_along(away[0] / distance, away[1] / distance, away[2] / distance, axes)
        for v in range(vertices):
            gx, gy, gz = -g[0, v], -g[1, v], -g[2, v]
            right = axes[0, 0] * gx + axes[0, 1] * gy + axes[0, 2] * gz
            up = axes[1, 0] * gx + axes[1, 1] * gy + axes[1, 2] * gz
            forward = axes[2, 0] * gx + axes[2, 1] * gy + axes[2, 2] * gz
            if forward <= 0 or abs(right) + abs(up) > WIDEST * forward:
                narrow = False
                break
            # Scaled to metres at the body, and depth counted from there:
            # a far sensor becomes an orthographic view without losing digits.
            image[0, v] = right * distance / forward
            image[1, v] = up * distance / forward
            depth[v] = forward - distance
    if narrow:
        search_view(
            x, y, z, faces, g, axes, np.float32(-np.inf), contact, needed, count, image,
            depth, visible,
        )  # fmt: skip
        return

    owned = np.empty(vertices, np.uint8)
    for side in range(6):
        sign = 1.0 - 2.0 * (side % 2)
        main = side // 2
        axes[:] = 0
        axes[0, (main + 1) % 3] = 1
        axes[1, (main + 2) % 3] = 1
        axes[2, main] = sign
        mine = 0
        for v in range(vertices):
            right, up = -g[(main + 1) % 3, v], -g[(main + 2) % 3, v]
            forward = -g[main, v] * sign
            depth[v] = forward
            owned[v] = 0
            if forward > contact:
                image[0, v], image[1, v] = right / forward, up / forward
                # Ties on the cube's edges belong to both sides: no harm.
                if needed[v] and abs(right) <= forward and abs(up) <= forward:
                    owned[v] = 1
                    mine += 1
        if mine == 0:
            continue
        search_view(
            x, y, z, faces, g, axes, np.float32(contact), contact, owned, mine, image,
            depth, visible,
        )  # fmt: skip


@compiled
def exact_visibility_kernel(
    positions: NDArray[np.float32],
    faces: NDArray[np.int32],
    sensor: NDArray[np.float64],
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
        Oriented in any way.
    sensor : float64 array, shape (3,)
        In the frame of the positions.
    needed : uint8 array, shape (n, V)
        Which vertices to test.
    first, last : int
        Half-open range of frames.
    visible : uint8 array, shape (n, V)
        Written where needed.
    """
    for t in range(first, last):
        count = 0
        for v in range(positions.shape[2]):
            count += needed[t, v] != 0
        if count > 0:
            x, y, z = positions[t, 0], positions[t, 1], positions[t, 2]
            see_frame(x, y, z, faces, sensor, needed[t], count, visible[t])


@compiled
def axes_along(fx: float, fy: float, fz: float, axes: NDArray[np.float64]) -> None:
    """Right, up and forward of a view.

    Parameters
    ----------
    fx, fy, fz : float
        Unit vector along which it looks.
    axes : float64 array, shape (3, 3)
        Written.
    """
    if abs(fz) < 0.9:
        rx, ry, rz = fy, -fx, 0.0
    else:
        rx, ry, rz = 0.0, fz, -fy
    length = np.sqrt(rx * rx + ry * ry + rz * rz)
    axes[0, 0], axes[0, 1], axes[0, 2] = rx / length, ry / length, rz / length
    axes[2, 0], axes[2, 1], axes[2, 2] = fx, fy, fz
    for a in range(3):
        b, c = (a + 1) % 3, (a + 2) % 3
        axes[1, a] = axes[2, b] * axes[0, c] - axes[2, c] * axes[0, b]
