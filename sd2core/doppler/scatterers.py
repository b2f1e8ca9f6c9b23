"""Which vertices of a frame count, and how much, before the range law and with it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.scattering.amplitude import projected_areas, range_weight
from sd2core.scattering.visibility import facing_mask


@dataclass(frozen=True, eq=False)
class Scatterers:
    """What a stretch of frames counts. Without ``normals`` and ``mask`` all vertices count.

    Parameters
    ----------
    normals : int8 array, shape (n, 3, V), or None
        Those count whose normal faces the sensor.
    mask : uint8 array, shape (n, V), or None
        Those count that are marked.
    areas : float32 array, shape (n, V), or None
        A vertex counts by its area in m².
    area_vectors : float32 array, shape (n, 3, V), or None
        A vertex counts by the area in m² that it turns towards the sensor.
    vertex_counts : float32 array, shape (V,), or None
        How many vertices each stands for; None: itself only.
    """

    normals: NDArray[np.int8] | None = None
    mask: NDArray[np.uint8] | None = None
    areas: NDArray[np.float32] | None = None
    area_vectors: NDArray[np.float32] | None = None
    vertex_counts: NDArray[np.float32] | None = None

    def seen(
        self, row: int, points: NDArray[Any], sensor: NDArray[np.float64]
    ) -> NDArray[np.bool_]:
        """Which vertices of a frame count, bool (V,).

        Parameters
        ----------
        row : int
            Number of the frame within the stretch.
        points : float array, shape (3, V)
            Its vertices, in metres.
        sensor : float64 array, shape (3,)
        """
        if self.mask is not None:
            return self.mask[row] > 0
        if self.normals is not None:
            return facing_mask(points[None], self.normals[row : row + 1], sensor)[0] > 0
        return np.ones(points.shape[1], bool)

    def weights(
        self,
        row: int,
        points: NDArray[Any],
        sensor: NDArray[np.float64],
        range_exponent: float,
        reference_range_m: float,
    ) -> NDArray[np.float64]:
        """What each vertex of a frame counts, float64 (V,); parameters as for :meth:`seen`."""
        if self.area_vectors is not None:
            weight = projected_areas(points, self.area_vectors[row], sensor)
        elif self.areas is not None:
            weight = self.areas[row].astype(np.float64)
        else:
            weight = self.heads(points.shape[1])
        if range_exponent:
            distance = np.linalg.norm(points - sensor[:, None], axis=0)
            weight = weight * range_weight(distance, range_exponent, reference_range_m)
        return weight

    def heads(self, vertices: int) -> NDArray[np.float64]:
        """How many vertices each of ``vertices`` stands for, float64 (V,)."""
        if self.vertex_counts is None:
            return np.ones(vertices)
        return self.vertex_counts.astype(np.float64)
