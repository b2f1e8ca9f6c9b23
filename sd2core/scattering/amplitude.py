"""Echo of a vertex: its share of the surface, its orientation, the range law."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.numerics.compiled import compiled
from sd2core.scattering.visibility import sum_cross_products

NEAREST_RANGE_M = 0.1
"""Least range of the range law, which is a far-field law; nearer vertices count as here."""


@compiled
def vertex_areas_kernel(
    positions: NDArray[np.float32], faces: NDArray[np.int32], areas: NDArray[np.float32]
) -> None:
    """Find the area that each vertex stands for: a third of its adjacent triangles.

    In double precision: the area of a sliver is the small difference of large products.
    Positions (n, 3, V) are in metres, ``areas`` (n, V) are written in square metres; their sum
    over a frame is the area of the surface.
    """
    for t in range(positions.shape[0]):
        x, y, z = positions[t, 0], positions[t, 1], positions[t, 2]
        area = areas[t]
        area[:] = 0
        for f in range(faces.shape[0]):
            i, j, k = faces[f, 0], faces[f, 1], faces[f, 2]
            px, py, pz = np.float64(x[i]), np.float64(y[i]), np.float64(z[i])
            ax, ay, az = x[j] - px, y[j] - py, z[j] - pz
            bx, by, bz = x[k] - px, y[k] - py, z[k] - pz
            nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
            third = np.float32(np.sqrt(nx * nx + ny * ny + nz * nz) / 6.0)
            area[i] += third
            area[j] += third
            area[k] += third


@compiled
def vertex_area_vectors_kernel(
    positions: NDArray[np.float32], faces: NDArray[np.int32], vectors: NDArray[np.float32]
) -> None:
    """Find the area vector of each vertex: a third of the sum of its adjacent triangles'.

    A triangle's area vector is its area times its outward unit normal. Its part
    along a direction is the area seen from there; a closed surface's sum to zero.

    Positions (n, 3, V) are in metres, faces (F, 3) counter-clockwise seen from outside; ``vectors``
    (n, 3, V) are written in square metres.
    """
    vertices = positions.shape[2]
    total = np.empty((vertices, 3), np.float64)
    for t in range(positions.shape[0]):
        sum_cross_products(positions[t], faces, total)
        for axis in range(3):
            for v in range(vertices):
                vectors[t, axis, v] = np.float32(total[v, axis] / 6.0)


def projected_areas(
    points: NDArray[Any], vectors: NDArray[np.float32], sensor: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Area that each vertex turns towards the sensor, A·cos θ.

    Parameters
    ----------
    points : float array, shape (3, V)
        Metres.
    vectors : float32 array, shape (3, V)
        Area vectors from :func:`vertex_area_vectors_kernel`.
    sensor : float64 array, shape (3,)

    Returns
    -------
    float64 array, shape (V,)
        Square metres; 0 where the surface is turned away, and on the sensor itself.
    """
    ray = sensor[:, None] - points
    along = (ray * vectors).sum(axis=0)
    return np.maximum(along, 0) / np.maximum(np.linalg.norm(ray, axis=0), 1e-30)


def range_weight(
    range_m: NDArray[Any], exponent: float, reference_range_m: float
) -> NDArray[np.float32]:
    """Power relative to the reference range, ``(R_ref / R) ** exponent``.

    The radar equation gives an exponent of 4 for a point scatterer. Ranges below
    :data:`NEAREST_RANGE_M` count as that range.
    """
    ratio = reference_range_m / np.maximum(range_m, NEAREST_RANGE_M)
    return np.power(ratio, exponent).astype(np.float32)
