"""Compiled inner loops of counting.

They go over the vertices of :class:`sd2core.doppler.histogram.Paths`: all, or those that move.
Each frame is processed in runs of vertices that stay in the second-level
cache. Each step of a run is a loop of its own with few streams, which the compiler
turns into vector instructions. :mod:`sd2core.doppler.histogram` explains the
numbers. Positions, sensor and scale are all in single precision, or all in
double: the compiler makes two forms of each loop, and constants are in single
precision, so that they do not widen the first (docs/decisions/0013).

Tuples are ``Paths`` there, and the ``arguments`` of ``Scatterers`` and ``Counting``.
"""

from __future__ import annotations

import numpy as np

from sd2core.numerics.compiled import compiled
from sd2core.scattering.amplitude import NEAREST_RANGE_M
from sd2core.scattering.beam_kernels import weigh_by_beam
from sd2core.scattering.visibility import facing_kernel

RUN = 16384
TABLES = 8
_NEAREST = np.float32(NEAREST_RANGE_M)

ALL, FACING, MASK = 0, 1, 2
"""Which vertices count: all, those facing the sensor, those marked in a mask."""

ONE, MULTIPLICITY, AREA, PROJECTED = 0, 1, 2, 3
"""What a vertex counts: 1, the vertices it stands for, its area, that towards the sensor."""

DROP, WRAP, CLIP = 0, 1, 2
"""What happens beyond the axis."""


@compiled
def _relative_ranges(x, y, z, sx, sy, sz, distance, ranges):  # type: ignore[no-untyped-def]
    """Ranges (n,) at one knot, less the sensor's ``distance`` from the clip's origin.

    |p − s| − |s| = p·(p − 2s) / (|p − s| + |s|). The differences between vertices and knots
    stay at the body's own scale, so the difference of two is the exact change of range of
    :func:`~sd2core.scattering.velocity.radial_velocity` however far the sensor is, with one range
    per vertex and knot. Its rounding error is a few roundings of the largest coordinate
    (:func:`sd2core.numerics.precision.velocity_error_mps`). Coordinates (n,) are relative to the
    clip's origin; the result has their precision.
    """
    two = np.float32(2)
    for v in range(ranges.shape[0]):
        px, py, pz = x[v], y[v], z[v]
        qx, qy, qz = px - sx, py - sy, pz - sz
        away = np.sqrt(qx * qx + qy * qy + qz * qz)
        difference = px * (px - two * sx) + py * (py - two * sy) + pz * (pz - two * sz)
        ranges[v] = difference / max(away + distance, np.float32(1e-30))


@compiled
def _mean_ranges(x, y, z, sx, sy, sz, distance, ranges):  # type: ignore[no-untyped-def]
    """Mean of ranges (n,) from a first end and :func:`_relative_ranges` from a second."""
    other = np.empty_like(ranges)
    _relative_ranges(x, y, z, sx, sy, sz, distance, other)
    half = np.float32(0.5)
    for v in range(ranges.shape[0]):
        ranges[v] = half * (ranges[v] + other[v])


@compiled
def distances_of(ends):  # type: ignore[no-untyped-def]
    """Distances of the ends of a path from the origin, in their precision."""
    away = np.empty(ends.shape[0], ends.dtype)
    for end in range(ends.shape[0]):
        x, y, z = np.float64(ends[end, 0]), np.float64(ends[end, 1]), np.float64(ends[end, 2])
        away[end] = np.sqrt(x**2 + y**2 + z**2)
    return away


@compiled
def ranges_at(here, knot, ends, distances, ranges, held):  # type: ignore[no-untyped-def]
    """Ranges (n,) of a group's vertices at one of its knots, computed when first asked for.

    By way of a wall they are half the length of the path.

    Parameters
    ----------
    here : (3 knots, n)
        Coordinates of the vertices, from :func:`group_of`.
    knot : int
        Number of the knot in the group.
    ends, distances
        Places (1 or 2, 3), and their :func:`distances_of`, by which ranges are less.
    ranges, held : (k, most) and int (k,)
        Keep those of the newest knots, and their numbers (-1: none); written.
    """
    row = knot % ranges.shape[0]
    # Cut like this the compiler knows that they lie side by side.
    result = ranges[row][: here.shape[1]]
    if held[row] != knot:
        x, y, z = here[3 * knot], here[3 * knot + 1], here[3 * knot + 2]
        _relative_ranges(x, y, z, ends[0, 0], ends[0, 1], ends[0, 2], distances[0], result)
        if ends.shape[0] > 1:
            _mean_ranges(x, y, z, ends[1, 0], ends[1, 1], ends[1, 2], distances[1], result)
        held[row] = knot
    return result


@compiled
def group_of(vertex, first, places, group):  # type: ignore[no-untyped-def]
    """Vertices (n,) of a group and their coordinates at its knots (3 knots, n).

    Parameters
    ----------
    vertex, first, places
        Those of :class:`~sd2core.doppler.histogram.Paths`.
    group : int
        Number of the group.
    """
    knots = places.shape[0] // (3 * max(vertex.shape[0], 1))
    begin, end = first[group], first[group + 1]
    here = places[3 * knots * begin : 3 * knots * end].reshape((3 * knots, end - begin))
    return vertex[begin:end], here


@compiled
def most_in_a_group(first):  # type: ignore[no-untyped-def]
    """Largest number of vertices in a group."""
    most = 0
    for group in range(first.shape[0] - 1):
        most = max(most, first[group + 1] - first[group])
    return most


@compiled
def run_end(numbers, p):  # type: ignore[no-untyped-def]
    """End of the vertices from ``p`` that lie in the same run of all as the first of them."""
    end = (numbers[p] // RUN + 1) * RUN
    q = min(p + RUN, numbers.shape[0])
    while numbers[q - 1] >= end:
        q -= 1
    return q


@compiled
def axis_positions(before, after, scale, offset, f):  # type: ignore[no-untyped-def]
    """Position on the velocity axis, in bins.

    Parameters
    ----------
    before, after : (n,)
        Ranges in metres at the two knots.
    scale : float
        Bins per metre of range change.
    offset : float
        Position of zero velocity, half the number of bins.
    f : (n,)
        Written.
    """
    for v in range(f.shape[0]):
        f[v] = offset + scale * (before[v] - after[v])


@compiled
def _slots_of(f, seen, bins, beyond, slot):  # type: ignore[no-untyped-def]
    """Set the slot of each vertex: its bin, ``bins`` beyond the axis, ``bins + 1`` if hidden.

    Returns the number of visible vertices beyond the axis.
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
    """Squared ratios (R_ref / R)² of a run of vertices."""
    for v in range(weight.shape[0]):
        ratio = reference / max(ranges[v] + distance, _NEAREST)
        weight[v] = ratio * ratio


@compiled
def _squared_ratios_between(x, y, z, ends, reference, weight):  # type: ignore[no-untyped-def]
    """Ratios R_ref² / (R₁ R₂) of a run of vertices on a path with two ends."""
    ax, ay, az = ends[0, 0], ends[0, 1], ends[0, 2]
    bx, by, bz = ends[1, 0], ends[1, 1], ends[1, 2]
    for v in range(weight.shape[0]):
        px, py, pz = x[v] - ax, y[v] - ay, z[v] - az
        qx, qy, qz = x[v] - bx, y[v] - by, z[v] - bz
        one = reference / max(np.sqrt(px * px + py * py + pz * pz), _NEAREST)
        weight[v] = one * (reference / max(np.sqrt(qx * qx + qy * qy + qz * qz), _NEAREST))


@compiled
def raise_to(weight, exponent, spare):  # type: ignore[no-untyped-def]
    """Raise ratios, given squared, to the power of ``exponent``, in place."""
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
def _projected(x, y, z, ax, ay, az, sx, sy, sz, weight):  # type: ignore[no-untyped-def]
    """Compiled form of :func:`sd2core.scattering.amplitude.projected_areas`."""
    for v in range(weight.shape[0]):
        qx, qy, qz = sx - x[v], sy - y[v], sz - z[v]
        along = max(qx * ax[v] + qy * ay[v] + qz * az[v], np.float32(0))
        weight[v] = along / max(np.sqrt(qx * qx + qy * qy + qz * qz), np.float32(1e-30))


@compiled
def multiplicity_beyond(f, seen, multiplicity, bins):  # type: ignore[no-untyped-def]
    """Number of vertices that the visible ones beyond the axis stand for."""
    end, total = np.float32(bins), np.int32(0)
    for v in range(f.shape[0]):
        outside = (seen[v] != 0) & ((f[v] < np.float32(0)) | (f[v] > end))
        total += np.int32(multiplicity[v]) if outside else np.int32(0)
    return total


@compiled
def multiplicity_seen(seen, multiplicity):  # type: ignore[no-untyped-def]
    """Number of vertices that the visible ones stand for."""
    total = np.int32(0)
    for v in range(seen.shape[0]):
        total += np.int32(multiplicity[v]) if seen[v] != 0 else np.int32(0)
    return total


@compiled
def weigh_run(  # type: ignore[no-untyped-def]
    p, q, own, middle, away, numbers, multiplicity, normals, marks, areas, vectors, which,
    weighting, beam, ends, distances, exponent, reference, seen, weight, spare,
):  # fmt: skip
    """Return the visibility of a run of vertices of a frame and set their weights.

    Parameters
    ----------
    p, q : int
        First vertex of the run and the one after its last, of the n in the frame.
    own : int
        Place of the frame's values among those of all frames, in values of one column.
    middle : (3, n)
        Places of the vertices in the frame.
    away : (n,)
        Their ranges, less the distance of the first end.
    numbers : int32 (n,)
        Their numbers among all V.
    multiplicity : float32 (n,)
        Number of vertices that each stands for.
    normals, areas, vectors : flat
        Of all frames; see :class:`~sd2core.doppler.histogram.Scatterers`.
    marks : uint8 (V,)
        The frame's row of the mask.
    which, weighting : int
        Which vertices count, and what.
    beam : tuple
        :class:`~sd2core.scattering.beam_kernels.BeamTables`, with axes for every end.
    ends, distances
        Places (1 or 2, 3), and their :func:`distances_of`.
    exponent, reference : float
        Those of the range law; an exponent of 0 turns it off.
    seen : uint8 (q - p,)
        Ones where all count; otherwise work space, which may be what is returned.
    weight : float32 (q - p,)
        Ones at first, which stay where each vertex counts 1 and there are no range law and no beam;
        written.
    spare : float32 (q - p,)
        Work space.
    """
    count = numbers.shape[0]
    x, y, z = middle[0][p:q], middle[1][p:q], middle[2][p:q]
    sx, sy, sz = ends[0, 0], ends[0, 1], ends[0, 2]
    two = ends.shape[0] > 1
    if which == FACING:
        normal = normals[3 * own : 3 * (own + count)].reshape((3, count))
        nx, ny, nz = normal[0][p:q], normal[1][p:q], normal[2][p:q]
        facing_kernel(x, y, z, nx, ny, nz, sx, sy, sz, seen)
        if two:
            also = np.empty_like(seen)
            facing_kernel(x, y, z, nx, ny, nz, ends[1, 0], ends[1, 1], ends[1, 2], also)
            seen &= also
    elif which == MASK and count == marks.shape[0]:
        seen = marks[p:q]
    elif which == MASK:
        for i in range(q - p):
            seen[i] = marks[np.uint32(numbers[p + i])]
    if exponent != 0:
        if two:
            _squared_ratios_between(x, y, z, ends, reference, weight)
        else:
            _squared_ratios(away[p:q], distances[0], reference, weight)
        raise_to(weight, exponent, spare)
    if weighting == AREA:
        spare[:] = areas[own + p : own + q]
    elif weighting == PROJECTED:
        vector = vectors[3 * own : 3 * (own + count)].reshape((3, count))
        ax, ay, az = vector[0][p:q], vector[1][p:q], vector[2][p:q]
        _projected(x, y, z, ax, ay, az, sx, sy, sz, spare)
        if two:
            turned = np.empty_like(spare)
            _projected(x, y, z, ax, ay, az, ends[1, 0], ends[1, 1], ends[1, 2], turned)
            for i in range(q - p):
                spare[i] = np.float32(0.5) * (spare[i] + turned[i])
    elif weighting == MULTIPLICITY:
        spare[:] = multiplicity[p:q]
    axes, across, up = beam
    if weighting == ONE and exponent == 0 and across.shape[0] > 0:
        weight[:] = 1
    elif weighting != ONE and exponent != 0:
        for i in range(q - p):
            weight[i] *= spare[i]
    elif weighting != ONE:
        weight[:] = spare
    if across.shape[0] > 0 and not two:
        weigh_by_beam(x, y, z, sx, sy, sz, axes[0], across, up, weight)
    elif across.shape[0] > 0:
        gain = np.ones(q - p, np.float32)  # of two passages at each end
        for end in range(2):
            ex, ey, ez = ends[end, 0], ends[end, 1], ends[end, 2]
            weigh_by_beam(x, y, z, ex, ey, ez, axes[end], across, up, gain)
        for i in range(q - p):
            weight[i] *= np.sqrt(gain[i])
    return seen


@compiled
def _add(slot, weight, row, place, sums):  # type: ignore[no-untyped-def]
    """Add the weights to their slots of the tables' rows; ``place`` is work space."""
    for i in range(slot.shape[0]):
        place[i] = row[i] + np.uint32(slot[i])
    whole = slot.shape[0] // TABLES * TABLES
    for first in range(0, whole, TABLES):
        for i in range(first, first + TABLES):
            sums[place[i]] += np.float64(weight[i])
    for i in range(whole, slot.shape[0]):
        sums[place[i]] += np.float64(weight[i])


@compiled
def _add_in_turn(slot, weight, tables):  # type: ignore[no-untyped-def]
    """Add the weights of a run of all vertices as :func:`_add` does, without a row for each."""
    whole = slot.shape[0] // TABLES * TABLES
    for first in range(0, whole, TABLES):
        for table in range(TABLES):
            tables[table, slot[first + table]] += np.float64(weight[first + table])
    for i in range(whole, slot.shape[0]):
        tables[0, slot[i]] += np.float64(weight[i])


@compiled
def _total(sums, total):  # type: ignore[no-untyped-def]
    """Sum of the tables, each place in the order of the tables."""
    total[:] = 0
    for table in range(TABLES):
        first = table * total.shape[0]
        for place in range(total.shape[0]):
            total[place] += sums[first + place]


@compiled
def count_kernel(  # type: ignore[no-untyped-def]
    paths, start, scale, scatterers, ends, law, histogram, visible, outside
):
    """Compiled form of :func:`sd2core.doppler.histogram.count`.

    Vertices go to several tables in turn, so that equal slots do not wait for one another: by
    their numbers, so that all vertices and those that move are added up in the same order.

    Parameters
    ----------
    paths, scatterers, law : tuple
        See the head of this module. The mask is of the n frames alone.
    start : int
        First of the n frames in the paths.
    scale : (n, samples)
        Bins per metre of range change; 0 where there is nothing to measure.
    ends : (1 or 2, 3)
        The sensor, and its image behind a wall, in the frame and the precision of the positions.
    histogram : float64 (n, parts, bins)
        Written.
    visible, outside : float64 (n,)
        Written: number of visible vertices, and of those of them beyond the axis.
    """
    vertex, first, places, centre, before, after, group_frames, vertices = paths
    normals, mask, areas, vectors, every, part, which, weighting, beam = scatterers
    bins, beyond, exponent, reference = law
    samples, most = scale.shape[1], most_in_a_group(first)
    offset, distances = np.float32(0.5 * bins), distances_of(ends)
    ranges, held = np.empty((samples + 2, most), places.dtype), np.empty(samples + 2, np.int64)
    f, slot = np.empty(min(most, RUN), places.dtype), np.empty(min(most, RUN), np.uint8)
    weight, spare = np.ones(min(most, RUN), np.float32), np.empty(min(most, RUN), np.float32)
    seen = np.ones(min(most, RUN), np.uint8)
    # Places without a sign are not looked at for being negative.
    row, place = np.empty(most, np.uint32), np.empty(min(most, RUN), np.uint32)
    multiplicity = np.ones(most, np.float32)
    parts, width = histogram.shape[1], bins + 2
    sums, total = np.zeros(TABLES * parts * width), np.empty(parts * width)
    tables, slots = sums.reshape((TABLES, parts * width)), np.int32(parts * width)
    split, grouped = part.shape[0] > 0, every.shape[0] > 0
    whole = np.int32(vertices // TABLES * TABLES)
    group = start // group_frames - 1
    numbers, here, count = vertex, places[:0].reshape((0, 0)), 0
    marks = np.empty(0, np.uint8)
    for t in range(scale.shape[0]):
        frame = start + t
        if frame // group_frames != group:
            group = frame // group_frames
            numbers, here = group_of(vertex, first, places, group)
            count = numbers.shape[0]
            held[:] = -1
            for i in range(count):
                v = numbers[i]
                row[i] = (v & np.int32(TABLES - 1)) * slots if v < whole else np.int32(0)
            if split:
                for i in range(count):
                    row[i] += np.uint32(part[numbers[i]]) * np.uint32(width)
            if grouped:
                for i in range(count):
                    multiplicity[i] = every[numbers[i]]
        own = group_frames * first[group] + (frame - group * group_frames) * count
        if which == MASK:
            marks = mask[t]
        sums[:] = 0
        seen_count = outside_count = np.int64(0)
        measured = 0
        for sample in range(samples):
            if scale[t, sample] > 0:
                measured += 1
        measured = max(measured, 1)
        knot, p = centre[frame], 0
        while p < count:
            q = run_end(numbers, p)
            n = q - p
            away = ranges_at(here, knot, ends, distances, ranges, held)
            sight = weigh_run(
                p, q, own, here[3 * knot : 3 * knot + 3], away, numbers, multiplicity, normals,
                marks, areas, vectors, which, weighting, beam, ends, distances, exponent,
                reference, seen[:n], weight[:n], spare[:n],
            )  # fmt: skip
            if grouped:
                seen_count += multiplicity_seen(sight, multiplicity[p:q])
            else:
                for i in range(n):
                    seen_count += np.int64(sight[i])
            for sample in range(samples):
                if scale[t, sample] <= 0:
                    continue
                a = ranges_at(here, before[frame, sample], ends, distances, ranges, held)
                b = ranges_at(here, after[frame, sample], ends, distances, ranges, held)
                axis_positions(a[p:q], b[p:q], scale[t, sample], offset, f[:n])
                if grouped:
                    outside_count += multiplicity_beyond(f[:n], sight, multiplicity[p:q], bins)
                    _slots_of(f[:n], sight, bins, beyond, slot[:n])
                else:
                    outside_count += _slots_of(f[:n], sight, bins, beyond, slot[:n])
                if count == vertices and not split:
                    _add_in_turn(slot[:n], weight[:n], tables)
                else:
                    _add(slot[:n], weight[:n], row[p:q], place[:n], sums)
            p = q
        _total(sums, total)
        for number in range(parts):
            for bin_number in range(bins):
                histogram[t, number, bin_number] = total[number * width + bin_number] / measured
        visible[t] = seen_count
        outside[t] = outside_count / measured


@compiled
def needed_kernel(  # type: ignore[no-untyped-def]
    paths, start, scale, ends, law, live, needed
) -> None:
    """Compiled :func:`sd2core.doppler.histogram.mark_needed`.

    Parameters
    ----------
    paths, start, scale, ends, law
        As for :func:`count_kernel`.
    live : uint8 (bins + 1,)
        1 for bins that are kept; the last entry is for velocities beyond the axis.
    needed : uint8 (n, V)
        Written; zero at first.
    """
    vertex, first, places, _, before, after, group_frames, _ = paths
    bins, beyond, _, _ = law
    samples, most = scale.shape[1], most_in_a_group(first)
    offset, distances = np.float32(0.5 * bins), distances_of(ends)
    ranges, held = np.empty((samples + 2, most), places.dtype), np.empty(samples + 2, np.int64)
    f, seen, slot = np.empty(most, places.dtype), np.ones(most, np.uint8), np.empty(most, np.uint8)
    group = start // group_frames - 1
    numbers, here = vertex, places[:0].reshape((0, 0))
    for t in range(scale.shape[0]):
        frame = start + t
        if frame // group_frames != group:
            group = frame // group_frames
            numbers, here = group_of(vertex, first, places, group)
            held[:] = -1
        n = numbers.shape[0]
        for sample in range(samples):
            if scale[t, sample] <= 0:
                continue
            a = ranges_at(here, before[frame, sample], ends, distances, ranges, held)
            b = ranges_at(here, after[frame, sample], ends, distances, ranges, held)
            axis_positions(a, b, scale[t, sample], offset, f[:n])
            _slots_of(f[:n], seen[:n], bins, beyond, slot[:n])
            for i in range(n):
                needed[t, numbers[i]] |= live[slot[i]]
