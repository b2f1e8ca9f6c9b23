"""Visibility of vertices by their normals: those that face a sensor.

``facing`` tests each vertex's normal and relies on faces that are oriented
outwards. ``exact`` tests if a triangle lies between vertex and sensor and
does not care about orientation. A vertex without a surface around it (loose, or
with zero-area faces only) has no normal and counts as facing.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.numerics.compiled import compiled

NORMAL_SCALE = 127
"""A unit normal's component as a signed byte: directions are right to 0.4 degrees."""


def encloses(faces: NDArray[np.int32]) -> bool:
    """True if faces are a closed surface of consistent orientation.

    Every edge then belongs to two triangles that run along it in opposite
    directions, and what looks onto the body from outside meets a face that is
    turned towards it before any that is turned away.

    Parameters
    ----------
    faces : int32 array, shape (F, 3)
    """
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).astype(np.int64)
    edges = edges[edges[:, 0] != edges[:, 1]]
    vertices = int(edges.max(initial=0)) + 1
    forward = np.sort(edges[:, 0] * vertices + edges[:, 1])
    backward = np.sort(edges[:, 1] * vertices + edges[:, 0])
    return bool((forward == backward).all() and (forward[1:] != forward[:-1]).all())


@compiled
def add_cross_product(x, y, z, face, total):  # type: ignore[no-untyped-def]
    """Add the edge cross product of a triangle to the totals of its vertices.

    Parameters
    ----------
    x, y, z : float array, shape (V,)
        Places of the vertices.
    face : int32 array, shape (3,)
    total : float64 array, shape (V, 3)
        Added to.
    """
    i, j, k = face[0], face[1], face[2]
    px, py, pz = np.float64(x[i]), np.float64(y[i]), np.float64(z[i])
    ax, ay, az = x[j] - px, y[j] - py, z[j] - pz
    bx, by, bz = x[k] - px, y[k] - py, z[k] - pz
    nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    for v in (i, j, k):
        total[v, 0] += nx
        total[v, 1] += ny
        total[v, 2] += nz


@compiled
def set_normal(total, v, normal, at):  # type: ignore[no-untyped-def]
    """Write the normal of a vertex, :data:`NORMAL_SCALE` long.

    Parameters
    ----------
    total : float64 array, shape (V, 3)
        Sums of :func:`add_cross_product`; a sum of 0 gives a normal of 0.
    v : int
        Vertex, a row of ``total``.
    normal : int8 array, shape (3, ...)
        Written in column ``at``.
    at : int
    """
    length = np.sqrt(total[v, 0] ** 2 + total[v, 1] ** 2 + total[v, 2] ** 2)
    factor = NORMAL_SCALE / length if length > 0 else 0.0
    for axis in range(3):
        normal[axis, at] = np.int8(np.rint(total[v, axis] * factor))


@compiled
def sum_cross_products(
    points: NDArray[Any],  # (3, V)
    faces: NDArray[np.int32],
    total: NDArray[np.float64],  # (V, 3), written
) -> None:
    """Sum the edge cross products of every vertex's triangles: six times its area vector."""
    x, y, z = points[0], points[1], points[2]
    total[:] = 0
    for f in range(faces.shape[0]):
        add_cross_product(x, y, z, faces[f], total)


@compiled
def vertex_normals_kernel(
    positions: NDArray[np.float32], faces: NDArray[np.int32], normals: NDArray[np.int8]
) -> None:
    """Find area-weighted vertex normals as signed bytes.

    Positions are (n, 3, V), faces (F, 3) counter-clockwise seen from outside; ``normals``
    (n, 3, V) are written: :data:`NORMAL_SCALE` times the outward unit normal, zero where there is
    no surface.
    """
    vertices = positions.shape[2]
    total = np.empty((vertices, 3), np.float64)
    for t in range(positions.shape[0]):
        sum_cross_products(positions[t], faces, total)
        for v in range(vertices):
            set_normal(total, v, normals[t], v)


def facing_mask(
    positions: NDArray[np.float32], normals: NDArray[np.int8], sensor: NDArray[np.float64]
) -> NDArray[np.uint8]:
    """Mask of the vertices whose normal does not point away from the sensor.

    Parameters
    ----------
    positions : float32 array, shape (n, 3, V)
    normals : int8 array, shape (n, 3, V)
    sensor : float64 array, shape (3,)
        In the frame of the positions.

    Returns
    -------
    uint8 array, shape (n, V)
    """
    place = sensor.astype(np.float32)
    cosine = np.zeros((positions.shape[0], positions.shape[2]), np.float32)
    for axis in range(3):
        cosine += (place[axis] - positions[:, axis]) * normals[:, axis]
    return (cosine >= 0).astype(np.uint8)


@compiled
def facing_kernel(  # type: ignore[no-untyped-def]
    x, y, z, nx, ny, nz, sx: np.float32, sy: np.float32, sz: np.float32, visible
) -> None:
    """Compiled form of :func:`facing_mask` for a run of vertices of one frame.

    Parameters
    ----------
    x, y, z : float array, shape (n,)
        Places of the vertices.
    nx, ny, nz : int8 array, shape (n,)
        Their normals.
    sx, sy, sz : float32
        Place of the sensor.
    visible : uint8 array, shape (n,)
        Written.
    """
    for v in range(visible.shape[0]):
        cosine = (
            (sx - x[v]) * np.float32(nx[v])
            + (sy - y[v]) * np.float32(ny[v])
            + (sz - z[v]) * np.float32(nz[v])
        )
        visible[v] = np.uint8(1) if cosine >= np.float32(0) else np.uint8(0)
