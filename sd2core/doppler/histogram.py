"""Counting vertices per velocity bin, frame by frame.

The compiled form goes through each frame in runs of vertices that stay in the
second-level cache. Each step of a run is a loop of its own with few streams, which
the compiler turns into vector instructions.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.compiled import compiled
from sd2core.scattering.amplitude import NEAREST_RANGE_M, range_weight
from sd2core.scattering.visibility import facing_kernel, facing_mask

_RUN = 16384
_TABLES = 8

ALL, FACING, MASK = 0, 1, 2
"""Which vertices count: all, those facing the sensor, those marked in a mask."""

DROP, WRAP, CLIP = 0, 1, 2
"""What happens beyond the axis."""


@dataclass(frozen=True, eq=False)
class Frames:
    """A stretch of prepared frames, as the kernels take it.

    Parameters
    ----------
    positions : float32 array, shape (knots, 3, V)
        Relative to the clip's origin.
    centre : int64 array, shape (n,)
        Knot of every frame.
    before, after : int64 array, shape (n, samples)
        Between which knots each velocity sample of a frame is measured.
    duration_s : float64 array, shape (n, samples)
        Time between the two; 0 where there is nothing to measure.
    """

    positions: NDArray[np.float32]
    centre: NDArray[np.int64]
    before: NDArray[np.int64]
    after: NDArray[np.int64]
    duration_s: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.centre)

    def rows(self, rows: slice) -> Frames:
        """Some of the frames; nothing is copied."""
        return Frames(
            self.positions,
            self.centre[rows],
            self.before[rows],
            self.after[rows],
            self.duration_s[rows],
        )


@dataclass(frozen=True)
class Counting:
    """The choices that the counting itself needs.

    Parameters
    ----------
    bins : int
    v_max_mps : float
    beyond : int
        DROP, WRAP or CLIP.
    range_exponent, reference_range_m : float
    """

    bins: int
    v_max_mps: float
    beyond: int
    range_exponent: float
    reference_range_m: float

    def scale(self, duration_s: NDArray[np.float64]) -> NDArray[np.float32]:
        """Bins per metre of range change."""
        rate = np.divide(1.0, duration_s, out=np.zeros_like(duration_s), where=duration_s > 0)
        scale: NDArray[np.float32] = (rate * (0.5 * self.bins / self.v_max_mps)).astype(np.float32)
        return scale


@dataclass(frozen=True, eq=False)
class Counts:
    """What a stretch of frames counts to.

    Parameters
    ----------
    histogram : float64 array, shape (n, bins)
        Vertices, or their weights, per bin; the mean over a frame's samples.
    visible, beyond : float64 array, shape (n,)
        Number of vertices that are seen, and of those beyond the axis.
    """

    histogram: NDArray[np.float64]
    visible: NDArray[np.float64]
    beyond: NDArray[np.float64]

    @classmethod
    def empty(cls, frames: int, bins: int) -> Counts:
        """Zeros."""
        return cls(np.zeros((frames, bins)), np.zeros(frames), np.zeros(frames))

    def rows(self, rows: slice) -> Counts:
        """Some of the frames; writing to them writes to the whole."""
        return Counts(self.histogram[rows], self.visible[rows], self.beyond[rows])


def relative_range(
    positions: NDArray[np.float32], sensor: NDArray[np.float64]
) -> NDArray[np.float32]:
    """Range of each vertex less the sensor's distance from the clip's origin.

    |p − s| − |s| = p·(p − 2s) / (|p − s| + |s|). What differs from vertex to vertex
    and from knot to knot is kept at the body's own scale, so the difference of two
    is the exact change of range of :func:`radial_velocity` however far the sensor
    is, with one range per vertex and knot. In single precision its error is below
    1e-5 m/s at 30 frames/s within a metre of the clip's origin and grows with the
    distance from there, as does the rounding of the positions themselves.

    Parameters
    ----------
    positions : float32 array, shape (3, V)
        Relative to the clip's origin.
    sensor : float64 array, shape (3,)

    Returns
    -------
    float32 array, shape (V,)
    """
    x, y, z = positions
    sx, sy, sz = sensor.astype(np.float32)
    two = np.float32(2)
    away = np.sqrt((x - sx) ** 2 + (y - sy) ** 2 + (z - sz) ** 2)
    difference = x * (x - two * sx) + y * (y - two * sy) + z * (z - two * sz)
    ranges: NDArray[np.float32] = difference / np.maximum(
        away + _distance(sensor), np.float32(1e-30)
    )
    return ranges


def _distance(sensor: NDArray[np.float64]) -> np.float32:
    return np.float32(np.linalg.norm(sensor.astype(np.float32).astype(np.float64)))


def bins_plain(
    frames: Frames, t: int, sample: int, sensor: NDArray[np.float64], counting: Counting
) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
    """Bin of every vertex (``bins`` where dropped), and whether it lies beyond the axis."""
    closer = relative_range(frames.positions[frames.before[t, sample]], sensor) - relative_range(
        frames.positions[frames.after[t, sample]], sensor
    )
    per_bin = closer * counting.scale(frames.duration_s[t, sample : sample + 1])
    return place_in_bins(per_bin + np.float32(0.5 * counting.bins), counting)


def place_in_bins(
    f: NDArray[Any], counting: Counting
) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
    """Whole bin numbers from positions on the axis, which runs from 0 to ``bins``.

    The axis is closed at both ends, as ``np.histogram`` has it.
    """
    bins = counting.bins
    beyond = (f < 0) | (f > bins)
    if counting.beyond == WRAP:
        f = np.where(beyond, f - bins * np.floor(f / bins), f)
    number = np.clip(f, 0, bins - 1e-3).astype(np.intp)
    if counting.beyond == DROP:
        number[beyond] = bins
    return number, beyond


def count_plain(
    frames: Frames,
    sensor: NDArray[np.float64],
    counting: Counting,
    which: int,
    normals: NDArray[np.int8] | None,
    mask: NDArray[np.uint8] | None,
    areas: NDArray[np.float32] | None,
    into: Counts,
) -> None:
    """The same as :func:`count`, in NumPy."""
    for t, knot in enumerate(frames.centre):
        points = frames.positions[knot]
        seen = np.ones(points.shape[1], bool)
        if which == FACING and normals is not None:
            seen = facing_mask(points[None], normals[t : t + 1], sensor)[0] > 0
        elif which == MASK and mask is not None:
            seen = mask[t] > 0
        into.visible[t] = seen.sum()
        weight = np.ones(points.shape[1])
        if areas is not None:
            weight = areas[t].astype(np.float64)
        if counting.range_exponent:
            distance = relative_range(points, sensor) + _distance(sensor)
            weight = weight * range_weight(
                distance, counting.range_exponent, counting.reference_range_m
            )
        measured = max(1, int((frames.duration_s[t] > 0).sum()))
        for sample in np.flatnonzero(frames.duration_s[t] > 0).tolist():
            number, beyond = bins_plain(frames, t, sample, sensor, counting)
            total = np.bincount(number[seen], weight[seen], counting.bins + 1)
            into.histogram[t] += total[: counting.bins] / measured
            into.beyond[t] += (beyond & seen).sum() / measured


def count(
    frames: Frames,
    sensor: NDArray[np.float64],
    counting: Counting,
    which: int,
    normals: NDArray[np.int8] | None,
    mask: NDArray[np.uint8] | None,
    areas: NDArray[np.float32] | None,
    into: Counts,
) -> None:
    """Count all frames of a stretch, compiled.

    Parameters
    ----------
    sensor : float64 array, shape (3,)
        In the frame of the positions.
    which : int
        ALL, FACING (with ``normals`` (n, 3, V)) or MASK (with ``mask`` (n, V)).
    areas : float32 array, shape (n, V), or None
        Weight of every vertex; None counts 1.
    into : Counts
        Of as many frames; zero at first.
    """
    _count_kernel(
        frames.positions,
        frames.centre,
        frames.before,
        frames.after,
        counting.scale(frames.duration_s),
        normals if normals is not None else _NO_NORMALS,
        mask if mask is not None else _NO_MASK,
        areas if areas is not None else _NO_AREAS,
        sensor.astype(np.float32),
        which,
        areas is not None,
        counting.bins,
        counting.beyond,
        counting.range_exponent,
        np.float32(counting.reference_range_m),
        into.histogram,
        into.visible,
        into.beyond,
    )


_NO_NORMALS = np.empty((0, 3, 0), np.int8)
_NO_MASK = np.empty((0, 0), np.uint8)
_NO_AREAS = np.empty((0, 0), np.float32)
_NEAREST = np.float32(NEAREST_RANGE_M)


@compiled
def _relative_ranges(x, y, z, sx, sy, sz, distance, ranges):  # type: ignore[no-untyped-def]
    """Compiled form of :func:`relative_range` for one knot."""
    two = np.float32(2)
    for v in range(ranges.shape[0]):
        px, py, pz = x[v], y[v], z[v]
        qx, qy, qz = px - sx, py - sy, pz - sz
        away = np.sqrt(qx * qx + qy * qy + qz * qz)
        difference = px * (px - two * sx) + py * (py - two * sy) + pz * (pz - two * sz)
        ranges[v] = difference / max(away + distance, np.float32(1e-30))


@compiled
def _extend(positions, sensor, distance, known, upto, ring):  # type: ignore[no-untyped-def]
    """Work out the knots from ``known`` to ``upto``; the ring keeps the newest few."""
    for knot in range(known, upto + 1):
        points = positions[knot]
        _relative_ranges(
            points[0], points[1], points[2],
            sensor[0], sensor[1], sensor[2], distance, ring[knot % ring.shape[0]],
        )  # fmt: skip
    return max(known, upto + 1)


@compiled
def _axis_positions(before, after, scale, offset, f):  # type: ignore[no-untyped-def]
    """Position on the velocity axis, in bins."""
    for v in range(f.shape[0]):
        f[v] = offset + scale * (before[v] - after[v])


@compiled
def _slots(f, seen, bins, beyond, slot):  # type: ignore[no-untyped-def]
    """Slot per vertex: its bin, ``bins`` when beyond the axis, ``bins + 1`` when hidden.

    Returns how many seen vertices lie beyond the axis.
    """
    end = np.float32(bins)
    inner = end - np.float32(1e-3)
    zero, off, dark = np.float32(0), np.float32(bins), np.float32(bins + 1)
    if beyond == WRAP:
        for v in range(f.shape[0]):
            x = f[v]
            y = x - end * np.floor(x / end)
            f[v] = x if (x >= zero) & (x <= end) else y + np.float32(2 * bins)
    outside = np.int32(0)
    if beyond == DROP:
        for v in range(f.shape[0]):
            x = f[v]
            inside = (x >= zero) & (x <= end)
            y = min(x, inner) if inside else off
            slot[v] = np.uint8(np.int32(y if seen[v] != 0 else dark))
            outside += np.int32((not inside) & (seen[v] != 0))
    elif beyond == CLIP:
        for v in range(f.shape[0]):
            x = f[v]
            inside = (x >= zero) & (x <= end)
            y = max(min(x, inner), zero)
            slot[v] = np.uint8(np.int32(y if seen[v] != 0 else dark))
            outside += np.int32((not inside) & (seen[v] != 0))
    else:
        for v in range(f.shape[0]):
            x = f[v]
            inside = x <= end
            y = x if inside else x - np.float32(2 * bins)
            y = max(min(y, inner), zero)
            slot[v] = np.uint8(np.int32(y if seen[v] != 0 else dark))
            outside += np.int32((not inside) & (seen[v] != 0))
    return outside


@compiled
def _squared_ratios(ranges, distance, reference, weight):  # type: ignore[no-untyped-def]
    """(R_ref / R)² of a run of vertices."""
    for v in range(weight.shape[0]):
        ratio = reference / max(ranges[v] + distance, _NEAREST)
        weight[v] = ratio * ratio


@compiled
def _raise_to(weight, exponent, spare):  # type: ignore[no-untyped-def]
    """Squared ratios to ratios to the power of ``exponent``, in place."""
    if exponent != np.floor(exponent):
        power = np.float32(exponent * 0.5)
        for v in range(weight.shape[0]):
            weight[v] = weight[v] ** power
        return
    whole, odd = int(exponent) // 2, int(exponent) % 2
    while odd == 0 and whole > 1 and whole % 2 == 0:
        for v in range(weight.shape[0]):
            weight[v] *= weight[v]
        whole //= 2
    if odd == 0 and whole == 1:
        return
    for v in range(weight.shape[0]):
        spare[v] = weight[v]
        weight[v] = np.sqrt(weight[v]) if odd == 1 else np.float32(1)
    while whole > 0:
        if whole % 2 == 1:
            for v in range(weight.shape[0]):
                weight[v] *= spare[v]
        whole //= 2
        if whole > 0:
            for v in range(weight.shape[0]):
                spare[v] *= spare[v]


@compiled
def _tally(slot, counts):  # type: ignore[no-untyped-def]
    """Add 1 per vertex; several tables in turn, so that equal slots do not wait."""
    whole = slot.shape[0] // _TABLES * _TABLES
    for v in range(0, whole, _TABLES):
        for table in range(_TABLES):
            counts[table, slot[v + table]] += np.int32(1)
    for v in range(whole, slot.shape[0]):
        counts[0, slot[v]] += np.int32(1)


@compiled
def _tally_weights(slot, weight, sums):  # type: ignore[no-untyped-def]
    whole = slot.shape[0] // _TABLES * _TABLES
    for v in range(0, whole, _TABLES):
        for table in range(_TABLES):
            sums[table, slot[v + table]] += np.float64(weight[v + table])
    for v in range(whole, slot.shape[0]):
        sums[0, slot[v]] += np.float64(weight[v])


@compiled
def _count_kernel(  # type: ignore[no-untyped-def]
    positions, centre, before, after, scale, normals, mask, areas, sensor,
    which, weighted, bins, beyond, exponent, reference, histogram, visible, outside,
):  # fmt: skip
    vertices = positions.shape[2]
    samples = before.shape[1]
    sx, sy, sz = sensor[0], sensor[1], sensor[2]
    offset = np.float32(0.5 * bins)
    f = np.empty(_RUN, np.float32)
    weight = np.empty(_RUN, np.float32)
    spare = np.empty(_RUN, np.float32)
    seen = np.ones(_RUN, np.uint8)
    slot = np.empty(_RUN, np.uint8)
    counts = np.zeros((_TABLES, 256), np.int32)
    sums = np.zeros((_TABLES, 256), np.float64)
    weights = weighted or exponent != 0
    distance = np.float32(np.sqrt(np.float64(sx) ** 2 + np.float64(sy) ** 2 + np.float64(sz) ** 2))
    ring = np.empty((samples + 2, vertices), np.float32)
    known = before[0, 0]
    for t in range(centre.shape[0]):
        known = _extend(positions, sensor, distance, known, after[t, samples - 1], ring)
        counts[:, : bins + 2] = 0
        sums[:, : bins + 2] = 0
        seen_count = np.int64(0)
        outside_count = 0
        measured = 0
        for sample in range(samples):
            if scale[t, sample] > 0:
                measured += 1
        measured = max(measured, 1)
        middle = positions[centre[t]]
        x, y, z = middle[0], middle[1], middle[2]
        for v0 in range(0, vertices, _RUN):
            v1 = min(v0 + _RUN, vertices)
            n = v1 - v0
            sight = seen[:n]
            if which == FACING:
                nx, ny, nz = normals[t, 0], normals[t, 1], normals[t, 2]
                facing_kernel(
                    x[v0:v1], y[v0:v1], z[v0:v1], nx[v0:v1], ny[v0:v1], nz[v0:v1],
                    sx, sy, sz, sight,
                )  # fmt: skip
            elif which == MASK:
                marks = mask[t]
                sight = marks[v0:v1]
            for v in range(n):
                seen_count += np.int64(sight[v])
            if exponent != 0:
                here = ring[centre[t] % ring.shape[0]]
                _squared_ratios(here[v0:v1], distance, reference, weight[:n])
                _raise_to(weight[:n], exponent, spare[:n])
                if weighted:
                    area = areas[t, v0:v1]
                    for v in range(n):
                        weight[v] *= area[v]
            elif weighted:
                weight[:n] = areas[t, v0:v1]
            for sample in range(samples):
                if scale[t, sample] <= 0:
                    continue
                a = ring[before[t, sample] % ring.shape[0]]
                b = ring[after[t, sample] % ring.shape[0]]
                _axis_positions(a[v0:v1], b[v0:v1], scale[t, sample], offset, f[:n])
                outside_count += _slots(f[:n], sight, bins, beyond, slot[:n])
                if weights:
                    _tally_weights(slot[:n], weight[:n], sums)
                else:
                    _tally(slot[:n], counts)
        for bin_number in range(bins):
            total = 0.0
            for table in range(_TABLES):
                total += sums[table, bin_number] if weights else counts[table, bin_number]
            histogram[t, bin_number] = total / measured
        visible[t] = seen_count
        outside[t] = outside_count / measured


def mark_needed(
    frames: Frames, sensor: NDArray[np.float64], counting: Counting, live: NDArray[np.uint8]
) -> NDArray[np.uint8]:
    """Mark the vertices whose visibility can change the histogram, compiled.

    Parameters
    ----------
    live : uint8 array, shape (bins + 1,)
        1 for bins that are kept; the last entry is for velocities beyond the axis.

    Returns
    -------
    uint8 array, shape (n, V)
    """
    needed = np.zeros((len(frames), frames.positions.shape[2]), np.uint8)
    _needed_kernel(
        frames.positions,
        frames.before,
        frames.after,
        counting.scale(frames.duration_s),
        sensor.astype(np.float32),
        counting.bins,
        counting.beyond,
        live,
        needed,
    )
    return needed


def mark_needed_plain(
    frames: Frames, sensor: NDArray[np.float64], counting: Counting, live: NDArray[np.uint8]
) -> NDArray[np.uint8]:
    """The same as :func:`mark_needed`, in NumPy."""
    needed = np.zeros((len(frames.centre), frames.positions.shape[2]), np.uint8)
    for t in range(len(frames.centre)):
        for sample in range(frames.before.shape[1]):
            if frames.duration_s[t, sample] > 0:
                number, _ = bins_plain(frames, t, sample, sensor, counting)
                needed[t] |= live[number]
    return needed


@compiled
def _needed_kernel(  # type: ignore[no-untyped-def]
    positions, before, after, scale, sensor, bins, beyond, live, needed
) -> None:
    vertices = positions.shape[2]
    sx, sy, sz = sensor[0], sensor[1], sensor[2]
    offset = np.float32(0.5 * bins)
    f = np.empty(_RUN, np.float32)
    seen = np.ones(_RUN, np.uint8)
    slot = np.empty(_RUN, np.uint8)
    distance = np.float32(np.sqrt(np.float64(sx) ** 2 + np.float64(sy) ** 2 + np.float64(sz) ** 2))
    ring = np.empty((before.shape[1] + 2, vertices), np.float32)
    known = before[0, 0]
    for t in range(needed.shape[0]):
        known = _extend(positions, sensor, distance, known, after[t, -1], ring)
        for sample in range(before.shape[1]):
            if scale[t, sample] <= 0:
                continue
            a = ring[before[t, sample] % ring.shape[0]]
            b = ring[after[t, sample] % ring.shape[0]]
            for v0 in range(0, vertices, _RUN):
                v1 = min(v0 + _RUN, vertices)
                n = v1 - v0
                _axis_positions(a[v0:v1], b[v0:v1], scale[t, sample], offset, f[:n])
                _slots(f[:n], seen[:n], bins, beyond, slot[:n])
                for v in range(n):
                    needed[t, v0 + v] |= live[slot[v]]


def compile_kernels() -> None:
    """Call every kernel of this module once."""
    zero = np.zeros((1, 1), np.int64)
    frames = Frames(np.ones((1, 3, 4), np.float32), zero[0], zero, zero, np.ones((1, 1)))
    counting = Counting(32, 2.0, DROP, 4.0, 2.2)
    count(frames, np.zeros(3), counting, ALL, None, None, None, Counts.empty(1, 32))
    mark_needed(frames, np.zeros(3), counting, np.ones(33, np.uint8))
