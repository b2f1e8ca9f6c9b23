"""Space that a body takes up during a clip; no VTK."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sd2core.mesh.sequence import MeshSequence

_SAMPLED_FRAMES = 9
_SAMPLED_VERTICES = 400


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
