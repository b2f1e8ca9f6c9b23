"""Space that a body takes up, and facts about its mesh that make it cheaper to draw; no VTK."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sd2core.mesh.sequence import MeshSequence

_SAMPLED_FRAMES = 9
_SAMPLED_VERTICES = 400
_SHADOW_CELL_M = 0.03
_FEW_FACES = 4000


@dataclass(frozen=True, eq=False)
class Extent:
    """Bounds of the body during the whole clip, from a few frames."""

    points_m: NDArray[np.float64]  # (n, 3): a sample of vertices of several frames
    low_m: NDArray[np.float64]  # (3,), with high_m the box around them
    high_m: NDArray[np.float64]
    floor_m: float  # y of the floor: where the feet are

    @classmethod
    def of_points(cls, points: NDArray[np.floating], floor_m: float | None = None) -> Extent:
        """Extent of points; the floor is at the lowest unless given."""
        points = np.asarray(points, np.float64).reshape(-1, 3)
        low, high = points.min(axis=0), points.max(axis=0)
        return cls(points, low, high, float(high[1]) if floor_m is None else floor_m)

    @classmethod
    def of_mesh(cls, mesh: MeshSequence) -> Extent:
        """Extent from a few frames over the clip, so that a long one stays on disk."""
        count = min(mesh.frame_count, _SAMPLED_FRAMES)
        frames = np.linspace(0, mesh.frame_count - 1, count).astype(int)
        stride = max(mesh.vertex_count // _SAMPLED_VERTICES, 1)
        kept, feet = [], []
        for index in frames:
            vertices = mesh.frame(int(index))
            feet.append(float(vertices[:, 1].max()))
            extremes = np.concatenate([vertices.argmin(axis=0), vertices.argmax(axis=0)])
            kept.append(np.concatenate([vertices[::stride], vertices[extremes]]))
        return cls.of_points(np.concatenate(kept), float(np.median(feet)))

    @property
    def centre_m(self) -> NDArray[np.float64]:
        """Middle of the box."""
        return 0.5 * (self.low_m + self.high_m)


def is_closed_outward(vertices: NDArray[np.floating], faces: NDArray[np.int32]) -> bool:
    """True if the surface is closed and its faces point outwards.

    Then the back of no face can be seen from outside, and drawing them is wasted.
    """
    from sd2core.scattering.visibility import encloses  # with kernels

    corners = np.asarray(vertices, np.float64)[faces] - np.mean(vertices, axis=0)  # (F, 3, 3)
    volume = np.einsum("fi,fi->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))
    return bool(volume > 0) and encloses(faces)


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
