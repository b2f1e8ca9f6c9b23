"""Vertices that move: those that can enter a bin that is kept.

A vertex cannot change its range faster than it moves, |v_radial| ≤ |v|. One whose displacement,
in bins, stays below the distance from zero velocity to the nearest bin that is kept lies in an
emptied bin for *every* place of the sensor. The others are found once per block, and kept apart,
in the order of the vertices. Counting them alone gives every kept bin the
same number, bit by bit: the same loops of :mod:`sd2core.doppler.kernels` go over them, and the
same values are added up in the same order (docs/decisions/0057).
"""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.doppler.histogram import Counting, Frames, Paths
from sd2core.doppler.moving_kernels import (
    GROUP,
    gather_kernel,
    moving_kernel,
    moving_normals_kernel,
)

_LARGEST_SHARE = 0.6
"""Share of moving vertices up to which they are counted faster than everything
(``tests/benchmarks/test_moving_speed.py``)."""

_ROUNDINGS = 48.0
"""Bound of the error of the difference of two relative ranges, in roundings of the largest
distance from the origin: 2 × 10 by the steps of ``_relative_ranges``, doubled and more."""


def still_bins(bins: int, null_bins: Collection[int]) -> float:
    """Distance in bins from zero velocity to the nearest bin that is kept; 0 where zero is."""
    below = above = bins // 2
    while above in null_bins:
        above += 1
    while below - 1 in null_bins:
        below -= 1
    middle = 0.5 * bins
    return max(min(middle - below, above - middle), 0.0)


class MovingVertices(Paths):
    """Vertices of a block that can enter a kept bin.

    A vertex that moves in one frame mostly moves in the next, and the frames of a group share the
    knots between which their velocities are measured. Where it does not move it is in an emptied
    bin, and does no harm.
    """

    @property
    def nbytes(self) -> int:
        """Size in memory."""
        return self.vertex.nbytes + self.first.nbytes + self.places.nbytes

    @property
    def pairs(self) -> int:
        """Number of pairs of a vertex and a frame."""
        return GROUP * len(self.vertex)

    def hold_from(self, place_m: NDArray[np.float64]) -> bool:
        """True if they are all that can enter a kept bin: unless ranges overflow from there."""
        return bool(np.isfinite(place_m.astype(self.places.dtype) ** 2).all())

    def of(self, values: NDArray[Any]) -> NDArray[Any]:
        """Values of what moves, of what (frames, ..., V) all vertices have.

        Group after group, frame after frame, (..., n).
        """
        columns = values.reshape(len(values), -1, self.vertices)
        frames = np.arange(GROUP * (len(self.first) - 1)).reshape(-1, GROUP)
        # Of a last group with fewer frames the last stands for those that are missing.
        rows = np.minimum(frames, len(values) - 1)
        result = np.empty(GROUP * columns.shape[1] * len(self.vertex), values.dtype)
        gather_kernel(columns, rows, self.vertex, self.first, result)
        return result

    def normals(self, points: NDArray[np.float32], faces: NDArray[np.int32]) -> NDArray[np.int8]:
        """Normals of what moves, as :meth:`of` orders them.

        ``points`` (frames, 3, V) are those of all vertices.
        """
        result = np.empty(GROUP * 3 * len(self.vertex), np.int8)
        moving_normals_kernel(points, faces, self.vertex, self.first, result)
        return result


def find_moving(
    frames: Frames, reach_m: float, counting: Counting, still: float
) -> MovingVertices | None:
    """Vertices that can enter a bin that is kept; None where most of them can.

    The bound holds for what the kernels compute, roundings included, from any place.

    Parameters
    ----------
    frames : Frames
        Of a block, with all vertices.
    reach_m : float
        Largest coordinate of the frames.
    counting : Counting
        Velocity axis.
    still : float
        Bins from zero velocity to the nearest bin that is kept, see :func:`still_bins`.
    """
    precision = frames.positions.dtype
    scale = counting.scale(frames.duration_s, precision).astype(np.float64)  # bins per metre
    away_m = np.sqrt(3.0) * reach_m
    rounding = 0.5 * float(np.finfo(precision).eps)
    room = still - rounding * (_ROUNDINGS * away_m * scale + 8.0 * counting.bins)
    measured = scale > 0
    if still <= 0 or not (room[measured] > 0).all():
        return None
    limit_m = np.divide(room, scale, out=np.full_like(scale, np.inf), where=measured)
    vertices = frames.positions.shape[2]
    starts = np.arange(0, len(frames), GROUP)
    marks = np.zeros((len(starts), vertices), np.bool_)
    moving_kernel(frames.positions, frames.before, frames.after, limit_m, marks)
    if np.count_nonzero(marks) > _LARGEST_SHARE * marks.size:
        return None
    group, vertex = np.nonzero(marks)
    number = vertex.astype(np.int32)
    first = np.searchsorted(group, np.arange(len(starts) + 1))

    low = np.minimum.reduceat(np.minimum(frames.before.min(axis=1), frames.centre), starts)
    high = np.maximum.reduceat(np.maximum(frames.after.max(axis=1), frames.centre), starts)
    knots = low[:, None] + np.arange(int((high - low).max()) + 1)  # (groups, knots)
    knots = np.minimum(knots, high[:, None])
    places = np.empty(3 * knots.shape[1] * len(number), precision)
    gather_kernel(frames.positions, knots, number, first, places)
    base = np.repeat(low, GROUP)[: len(frames)]
    return MovingVertices(
        number,
        first,
        places,
        frames.centre - base,
        frames.before - base[:, None],
        frames.after - base[:, None],
        GROUP,
        vertices,
    )
