"""Counting of vertices per velocity bin, frame by frame."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sd2core.doppler.kernels import (
    ALL,
    AREA,
    CLIP,
    DROP,
    FACING,
    MASK,
    MULTIPLICITY,
    ONE,
    PROJECTED,
    WRAP,
    count_kernel,
    needed_kernel,
)
from sd2core.doppler.options import SynthesisOptions
from sd2core.scattering.amplitude import projected_areas, range_weight
from sd2core.scattering.beam_kernels import beam_tables
from sd2core.scattering.echo_paths import EchoPath, mean_distance_m
from sd2core.scattering.visibility import facing_mask


@dataclass(frozen=True, eq=False)
class Scatterers:
    """Visibility and weights of the V vertices in n frames; all vertices count by default."""

    normals: NDArray[np.int8] | None = None
    """Shape (n, 3, V): only vertices whose normal faces the sensor count."""
    mask: NDArray[np.uint8] | None = None  # (n, V): only marked ones count
    areas: NDArray[np.float32] | None = None  # (n, V) in m²: a vertex counts by its area
    area_vectors: NDArray[np.float32] | None = None
    """Shape (n, 3, V): a vertex counts by the area in m² that it turns towards the sensor."""
    vertex_counts: NDArray[np.float32] | None = None
    """Shape (V,): number of vertices that each stands for; None: itself only."""
    parts: NDArray[np.uint8] | None = None
    """Shape (V,): part of the body of each vertex, to count apart; None: all together."""
    path: EchoPath | None = None  # whose beam weighs them

    @property
    def kinds(self) -> tuple[int, int]:
        """Which vertices count, and what, in the words of the kernels."""
        which = MASK if self.mask is not None else FACING if self.normals is not None else ALL
        if self.area_vectors is not None:
            return which, PROJECTED
        if self.areas is not None:
            return which, AREA
        return which, ONE if self.vertex_counts is None else MULTIPLICITY

    def arguments(self) -> tuple[Any, ...]:
        """Arguments of the kernels: values in the places of :class:`Paths`, empty without any."""
        normals, areas, vectors = self.normals, self.areas, self.area_vectors
        beam = beam_tables(None if self.path is None else self.path.sensor)
        axes = beam.axes[None] if self.path is None else self.path.axes
        return (
            _NO_NORMALS if normals is None else normals.reshape(-1),
            _NO_MASK if self.mask is None else self.mask,
            _NO_AREAS if areas is None else areas.reshape(-1),
            _NO_AREAS if vectors is None else vectors.reshape(-1),
            _NO_AREAS if self.vertex_counts is None else self.vertex_counts,
            _NO_PARTS if self.parts is None else self.parts,
            *self.kinds,
            (axes, beam.across, beam.up),
        )

    def seen(self, row: int, points: NDArray[Any], ends: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Visible vertices of frame ``row``, bool (V,); ``points`` (3, V) are its vertices."""
        if self.mask is not None:
            return self.mask[row] > 0
        if self.normals is not None:
            normals = self.normals[row : row + 1]
            return np.all([facing_mask(points[None], normals, end)[0] for end in ends], axis=0)
        return np.ones(points.shape[1], bool)

    def weights(
        self, row: int, points: NDArray[Any], ends: NDArray[np.float64], counting: Counting
    ) -> NDArray[np.float64]:
        """Weight of each vertex of a frame, float64 (V,).

        Parameters
        ----------
        row : int
            Number of the frame.
        points : ndarray, (3, V)
            Its vertices.
        ends : float64 ndarray, (1 or 2, 3)
            Of the path, in the frame of the vertices.
        counting : Counting
            Gives the range law.
        """
        if self.area_vectors is not None:
            areas = [projected_areas(points, self.area_vectors[row], end) for end in ends]
            weight = np.mean(areas, axis=0)
        elif self.areas is not None:
            weight = self.areas[row].astype(np.float64)
        else:
            weight = self.multiplicity(points.shape[1])
        if counting.range_exponent:
            law = counting.range_exponent, counting.reference_range_m
            weight = weight * range_weight(mean_distance_m(points, ends), *law)
        if self.path is not None:
            weight = weight * self.path.gain(points, ends)
        return weight

    def multiplicity(self, vertices: int) -> NDArray[np.float64]:
        """Number of vertices that each of ``vertices`` stands for, float64 (V,)."""
        if self.vertex_counts is None:
            return np.ones(vertices)
        return self.vertex_counts.astype(np.float64)


_NO_NORMALS = np.empty(0, np.int8)
_NO_MASK = np.empty((0, 0), np.uint8)
_NO_AREAS = np.empty(0, np.float32)
_NO_PARTS = np.empty(0, np.uint8)


class Paths(NamedTuple):
    """Vertices by groups of consecutive frames, and their places, as the kernels take them.

    Of a surface of which little moves each group has vertices of its own
    (:mod:`sd2core.doppler.moving`); otherwise all frames are one group, with all vertices.
    """

    vertex: NDArray[np.int32]  # (N,), ascending within a group
    first: NDArray[np.int64]  # (groups + 1,): number of the first of every group
    places: NDArray[Any]
    """Group after group, so that memory is read from front to back: the positions of its n
    vertices at the group's knots, (knots, 3, n)."""
    centre: NDArray[np.int64]  # (frames,): knot of every frame, counted within its group
    before: NDArray[np.int64]  # (frames, samples), like that
    after: NDArray[np.int64]
    group_frames: int
    vertices: int  # V


@dataclass(frozen=True, eq=False)
class Frames:
    """Consecutive prepared frames."""

    positions: NDArray[Any]
    """Shape (knots, 3, V), float32 or float64, relative to the clip's origin; velocities have
    their precision."""
    centre: NDArray[np.int64]  # (n,): knot of every frame
    before: NDArray[np.int64]
    """Knots, shape (n, samples), between which each velocity sample of a frame is measured."""
    after: NDArray[np.int64]
    duration_s: NDArray[np.float64]
    """Time between the two, (n, samples); 0 where there is nothing to measure."""

    def __len__(self) -> int:
        return len(self.centre)

    def rows(self, rows: slice) -> Frames:
        """View of some of the frames; nothing is copied."""
        return Frames(
            self.positions,
            self.centre[rows],
            self.before[rows],
            self.after[rows],
            self.duration_s[rows],
        )

    def paths(self) -> Paths:
        """All vertices of these frames."""
        vertices = self.positions.shape[2]
        return Paths(
            *_every(vertices),
            self.positions.reshape(-1),
            self.centre,
            self.before,
            self.after,
            max(len(self), 1),
            vertices,
        )


@lru_cache(maxsize=8)
def _every(vertices: int) -> tuple[NDArray[np.int32], NDArray[np.int64]]:
    """All vertices as one group."""
    return np.arange(vertices, dtype=np.int32), np.array([0, vertices], np.int64)


@dataclass(frozen=True)
class Counting:
    """Velocity axis and range law of the counting."""

    bins: int
    v_max_mps: float
    beyond: int  # DROP, WRAP or CLIP
    range_exponent: float
    reference_range_m: float

    def scale(self, duration_s: NDArray[np.float64], precision: Any) -> NDArray[Any]:
        """Bins per metre of range change, in the precision of the positions."""
        rate = np.divide(1.0, duration_s, out=np.zeros_like(duration_s), where=duration_s > 0)
        return (rate * (0.5 * self.bins / self.v_max_mps)).astype(precision)

    def arguments(self) -> tuple[int, int, float, np.float32]:
        """Arguments of the kernels."""
        reference_m = np.float32(self.reference_range_m)
        return self.bins, self.beyond, float(self.range_exponent), reference_m


def counting_of(options: SynthesisOptions) -> Counting:
    """Velocity axis and range law of the options."""
    return Counting(
        options.axis.bins,
        options.axis.v_max_mps,
        {"drop": DROP, "wrap": WRAP, "clip": CLIP}[options.beyond],
        options.range_exponent if options.range_law == "vertex" else 0.0,
        options.reference_range_m,
    )


@dataclass(frozen=True, eq=False)
class Counts:
    """Result of counting some frames."""

    histogram: NDArray[np.float64]
    """Vertices, or their weights, per part of the body and bin, shape (n, parts, bins); the mean
    over a frame's samples. One part is the whole body."""
    visible: NDArray[np.float64]
    """Number of visible vertices, shape (n,); a vertex that stands for several counts as many."""
    beyond: NDArray[np.float64]  # those of them beyond the axis

    @classmethod
    def empty(cls, frames: int, bins: int, parts: int = 1) -> Counts:
        """Zero counts of some frames."""
        return cls(np.zeros((frames, parts, bins)), np.zeros(frames), np.zeros(frames))

    def rows(self, rows: slice) -> Counts:
        """View of some of the frames; writing to it writes to the whole."""
        return Counts(self.histogram[rows], self.visible[rows], self.beyond[rows])


def place_in_bins(
    f: NDArray[Any], counting: Counting
) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
    """Bin of every position on the axis (``bins`` where dropped), and a mask of those beyond it.

    The axis runs from 0 to ``bins`` and is closed at both ends, as in ``np.histogram``.
    """
    bins = counting.bins
    beyond = (f < 0) | (f > bins)
    if counting.beyond == WRAP:
        f = np.where(beyond, f - bins * np.floor(f / bins), f)
    number = np.clip(f, 0, bins - 1e-3).astype(np.intp)
    if counting.beyond == DROP:
        number[beyond] = bins
    return number, beyond


def count(
    paths: Paths,
    start: int,
    duration_s: NDArray[np.float64],
    ends: NDArray[np.float64],
    counting: Counting,
    scatterers: Scatterers,
    into: Counts,
) -> None:
    """Count frames from ``start`` on, compiled.

    Parameters
    ----------
    paths : Paths
        Those that are counted: of what moves, bins that are not kept get less than their share.
    duration_s : float64 array, shape (n, samples)
        Of the n frames that are counted; so are mask and ``into``.
    ends : float64 array, shape (1 or 2, 3)
        The sensor, and its image by way of a wall, in the frame of the positions.
    counting : Counting
        Velocity axis and range law.
    scatterers : Scatterers
        Normals, areas and area vectors are those of all frames of the paths, in their order.
    into : Counts
        Written; zero at first.
    """
    precision = paths.places.dtype
    count_kernel(
        tuple(paths),
        start,
        counting.scale(duration_s, precision),
        scatterers.arguments(),
        ends.astype(precision),
        counting.arguments(),
        into.histogram,
        into.visible,
        into.beyond,
    )


def mark_needed(
    paths: Paths,
    start: int,
    duration_s: NDArray[np.float64],
    ends: NDArray[np.float64],
    counting: Counting,
    live: NDArray[np.uint8],
) -> NDArray[np.uint8]:
    """Mark the vertices (n, V) whose visibility can change the histogram, compiled.

    Parameters
    ----------
    paths, start, duration_s, ends
        As for :func:`count`.
    counting : Counting
        Axis, and what happens beyond it.
    live : uint8 ndarray, (bins + 1,)
        1 for bins that are kept; the last entry is for velocities beyond the axis.
    """
    needed = np.zeros((len(duration_s), paths.vertices), np.uint8)
    precision = paths.places.dtype
    needed_kernel(
        tuple(paths),
        start,
        counting.scale(duration_s, precision),
        ends.astype(precision),
        counting.arguments(),
        live,
        needed,
    )
    return needed
