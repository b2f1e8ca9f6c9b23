"""Normals and areas of vertices in NumPy, as the kernels of :mod:`sd2core.scattering` find them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.scattering.visibility import NORMAL_SCALE


def vertex_normals(positions: NDArray[Any], faces: NDArray[np.int32]) -> NDArray[np.int8]:
    """Area-weighted vertex normals as signed bytes.

    Parameters
    ----------
    positions : float array, shape (n, 3, V)
    faces : int32 array, shape (F, 3)
        Counter-clockwise seen from outside.

    Returns
    -------
    int8 array, shape (n, 3, V)
        127 times the outward unit normal; zero where there is no surface.
    """
    normals = np.empty(positions.shape, np.int8)
    for frame, points in enumerate(positions):
        corner = points.astype(np.float64)[:, faces]  # (3, F, 3)
        edge1, edge2 = corner[:, :, 1] - corner[:, :, 0], corner[:, :, 2] - corner[:, :, 0]
        cross = np.cross(edge1, edge2, axis=0)
        total = np.stack(
            [np.bincount(faces.ravel(), np.repeat(c, 3), points.shape[1]) for c in cross]
        )
        length = np.sqrt((total * total).sum(axis=0))
        factor = np.divide(NORMAL_SCALE, length, out=np.zeros_like(length), where=length > 0)
        normals[frame] = np.rint(total * factor)
    return normals


def vertex_areas(positions: NDArray[Any], faces: NDArray[np.int32]) -> NDArray[np.float32]:
    """Area that each vertex stands for: a third of its adjacent triangles.

    Parameters
    ----------
    positions : float array, shape (n, 3, V)
        Metres.
    faces : int32 array, shape (F, 3)

    Returns
    -------
    float32 array, shape (n, V)
        Square metres; a frame's sum is the area of the surface.
    """
    areas = np.empty((positions.shape[0], positions.shape[2]), np.float32)
    for frame, points in enumerate(positions.astype(np.float64, copy=False)):
        corner = points[:, faces]  # (3, F, 3)
        edge1, edge2 = corner[:, :, 1] - corner[:, :, 0], corner[:, :, 2] - corner[:, :, 0]
        third = np.linalg.norm(np.cross(edge1, edge2, axis=0), axis=0) / 6.0
        areas[frame] = np.bincount(faces.ravel(), np.repeat(third, 3), points.shape[1])
    return areas


def vertex_area_vectors(positions: NDArray[Any], faces: NDArray[np.int32]) -> NDArray[np.float32]:
    """Area vector of each vertex: a third of the sum of its adjacent triangles'.

    A triangle's area vector is its area times its outward unit normal. Its part
    along a direction is the area seen from there; a closed surface's sum to zero.

    Parameters
    ----------
    positions : float array, shape (n, 3, V)
        Metres.
    faces : int32 array, shape (F, 3)
        Counter-clockwise seen from outside.

    Returns
    -------
    float32 array, shape (n, 3, V)
        Square metres.
    """
    vectors = np.empty(positions.shape, np.float32)
    for frame, points in enumerate(positions.astype(np.float64, copy=False)):
        corner = points[:, faces]  # (3, F, 3)
        edge1, edge2 = corner[:, :, 1] - corner[:, :, 0], corner[:, :, 2] - corner[:, :, 0]
        for axis, third in enumerate(np.cross(edge1, edge2, axis=0) / 6.0):
            vectors[frame, axis] = np.bincount(faces.ravel(), np.repeat(third, 3), points.shape[1])
    return vectors
