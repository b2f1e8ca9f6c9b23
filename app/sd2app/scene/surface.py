"""Facts about a triangle mesh that make it cheaper to draw; no VTK."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

_SHADOW_CELL_M = 0.03
_FEW_FACES = 4000


def is_closed_outward(vertices: NDArray[np.floating], faces: NDArray[np.integer]) -> bool:
    """True if the surface is closed and its faces point outwards.

    Then the back of no face can be seen from outside, and drawing them is
    wasted. Every edge of such a surface is walked once in either direction.
    """
    begin = faces.astype(np.int64)
    end = np.roll(begin, -1, axis=1)
    count = len(vertices)
    there = np.sort((begin * count + end).ravel())
    back = np.sort((end * count + begin).ravel())
    if not np.array_equal(there, back):
        return False
    corners = np.asarray(vertices, np.float64)[faces] - np.mean(vertices, axis=0)  # (F, 3, 3)
    volume = np.einsum("fi,fi->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))
    return bool(volume > 0)


def coarse_faces(
    vertices: NDArray[np.floating], faces: NDArray[np.integer], cell_m: float = _SHADOW_CELL_M
) -> NDArray[np.int32]:
    """Fewer triangles over the same vertices, (n, 3), good enough for a shadow.

    Vertices in one cube of ``cell_m`` are replaced by one of them; triangles
    that collapse or coincide are dropped.
    """
    if len(faces) <= _FEW_FACES:
        return np.asarray(faces, np.int32)
    points = np.asarray(vertices, np.float64)
    low = points.min(axis=0)
    cell_m = max(cell_m, float((points.max(axis=0) - low).max()) / 1000.0)
    cube = np.floor((points - low) / cell_m).astype(np.int64)  # (V, 3), below 1001
    _, first, member = np.unique(
        cube @ [1 << 20, 1 << 10, 1], return_index=True, return_inverse=True
    )
    coarse = np.sort(first[member][faces], axis=1)
    solid = (coarse[:, 0] != coarse[:, 1]) & (coarse[:, 1] != coarse[:, 2])
    return np.unique(coarse[solid], axis=0).astype(np.int32)
