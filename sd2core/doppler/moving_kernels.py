"""Compiled inner loops over the vertices that move: :mod:`sd2core.doppler.moving`."""

from __future__ import annotations

import numpy as np

from sd2core.doppler.kernels import (
    ALL,
    AREA,
    DROP,
    FACING,
    HEADS,
    MASK,
    PROJECTED,
    RUN,
    TABLES,
    axis_positions,
    distance_of,
    heads_beyond,
    heads_seen,
    projected,
    raise_to,
    relative_ranges,
    slots_of,
    squared_ratios,
)
from sd2core.numerics.compiled import compiled
from sd2core.scattering.visibility import facing_kernel


@compiled
def moving_kernel(positions, before, after, limit_m, marks):  # type: ignore[no-untyped-def]
    """Mark the vertices (n, V) that move ``limit_m`` (n, samples) or more in any sample."""
    for t in range(marks.shape[0]):
        for sample in range(before.shape[1]):
            limit = limit_m[t, sample] * limit_m[t, sample]
            a, b = positions[before[t, sample]], positions[after[t, sample]]
            for v in range(marks.shape[1]):
                dx = np.float64(a[0, v]) - np.float64(b[0, v])
                dy = np.float64(a[1, v]) - np.float64(b[1, v])
                dz = np.float64(a[2, v]) - np.float64(b[2, v])
                marks[t, v] |= dx * dx + dy * dy + dz * dz >= limit


@compiled
def places_kernel(positions, centre, before, after, vertex, first, places):  # type: ignore[no-untyped-def]
    """Write the places of the pairs as :class:`sd2core.doppler.moving.MovingPairs` has them."""
    at = 0
    for t in range(centre.shape[0]):
        for knot_number in range(1 + 2 * before.shape[1]):
            knot = centre[t]
            if knot_number > 0:
                sample = (knot_number - 1) // 2
                knot = before[t, sample] if knot_number % 2 == 1 else after[t, sample]
            for axis in range(3):
                for p in range(first[t], first[t + 1]):
                    places[at] = positions[knot, axis, vertex[p]]
                    at += 1


@compiled
def _add(slot, weight, row, sums):  # type: ignore[no-untyped-def]
    for i in range(slot.shape[0]):
        sums[row[i] + np.int32(slot[i])] += np.float64(weight[i])


@compiled
def _total(sums, total):  # type: ignore[no-untyped-def]
    """Sum of the tables, each place in the order of the tables."""
    total[:] = 0
    for table in range(TABLES):
        first = table * total.shape[0]
        for place in range(total.shape[0]):
            total[place] += sums[first + place]


@compiled
def add_moving_kernel(  # type: ignore[no-untyped-def]
    vertex, first, places, scale, normals, mask, areas, vectors, heads, part,
    vertices, sensor, which, weighting, bins, beyond, exponent, reference, histogram, outside,
):  # fmt: skip
    """Count pairs as :func:`sd2core.doppler.kernels.count_kernel` counts all vertices.

    Each goes to the table that it has there, run by run, so that the sums have the same order.
    """
    samples = scale.shape[1]
    sx, sy, sz = sensor[0], sensor[1], sensor[2]
    offset, distance = np.float32(0.5 * bins), distance_of(sensor)
    f = np.empty(RUN, places.dtype)
    near, far = np.empty(RUN, places.dtype), np.empty(RUN, places.dtype)
    weight, spare = np.ones(RUN, np.float32), np.empty(RUN, np.float32)
    own, seen = np.ones(RUN, np.float32), np.ones(RUN, np.uint8)
    slot, row = np.empty(RUN, np.uint8), np.empty(RUN, np.int32)
    parts, width = histogram.shape[1], bins + 2
    sums, total = np.zeros(TABLES * parts * width), np.empty(parts * width)
    slots = np.int32(parts * width)
    split, grouped = part.shape[0] > 0, heads.shape[0] > 0
    weighted = weighting != HEADS or grouped
    whole = np.int32(vertices // TABLES * TABLES)
    for t in range(first.shape[0] - 1):
        sums[:] = 0
        outside_count = np.int64(0)
        measured = 0
        for sample in range(samples):
            if scale[t, sample] > 0:
                measured += 1
        measured = max(measured, 1)
        p, pairs = first[t], first[t + 1] - first[t]
        stretch = 3 * (1 + 2 * samples)
        here = places[stretch * first[t] : stretch * first[t + 1]].reshape((stretch, pairs))
        while p < first[t + 1]:
            end = (vertex[p] // RUN + 1) * RUN
            q = first[t + 1]
            if vertex[q - 1] >= end:
                q = p
                while vertex[q] < end:
                    q += 1
            n = q - p
            i0, i1 = p - first[t], q - first[t]
            x, y, z = here[0, i0:i1], here[1, i0:i1], here[2, i0:i1]
            for i in range(n):
                v = vertex[p + i]
                row[i] = (v & np.int32(TABLES - 1)) * slots if v < whole else np.int32(0)
            if split:
                for i in range(n):
                    row[i] += np.int32(part[vertex[p + i]]) * np.int32(width)
            if which == FACING:
                facing_kernel(
                    x, y, z, normals[0, p:q], normals[1, p:q], normals[2, p:q],
                    sx, sy, sz, seen[:n],
                )  # fmt: skip
            elif which == MASK:
                for i in range(n):
                    seen[i] = mask[t, vertex[p + i]]
            if exponent != 0:
                relative_ranges(x, y, z, sx, sy, sz, distance, near[:n])
                squared_ratios(near[:n], distance, reference, weight[:n])
                raise_to(weight[:n], exponent, spare[:n])
            if grouped:
                for i in range(n):
                    own[i] = heads[vertex[p + i]]
            if weighted:
                if weighting == AREA:
                    for i in range(n):
                        spare[i] = areas[p + i]
                elif weighting == PROJECTED:
                    projected(
                        x, y, z, vectors[0, p:q], vectors[1, p:q], vectors[2, p:q],
                        sx, sy, sz, spare[:n],
                    )  # fmt: skip
                else:
                    for i in range(n):
                        spare[i] = own[i]
                if exponent != 0:
                    for i in range(n):
                        weight[i] *= spare[i]
                else:
                    for i in range(n):
                        weight[i] = spare[i]
            for sample in range(samples):
                if scale[t, sample] <= 0:
                    continue
                a, b = here[3 + 6 * sample :], here[6 + 6 * sample :]
                relative_ranges(
                    a[0, i0:i1], a[1, i0:i1], a[2, i0:i1], sx, sy, sz, distance, near[:n]
                )
                relative_ranges(
                    b[0, i0:i1], b[1, i0:i1], b[2, i0:i1], sx, sy, sz, distance, far[:n]
                )
                axis_positions(near[:n], far[:n], scale[t, sample], offset, f[:n])
                if grouped:
                    outside_count += heads_beyond(f[:n], seen[:n], own[:n], bins)
                    slots_of(f[:n], seen[:n], bins, beyond, slot[:n])
                else:
                    outside_count += slots_of(f[:n], seen[:n], bins, beyond, slot[:n])
                _add(slot[:n], weight[:n], row[:n], sums)
            p = q
        _total(sums, total)
        for number in range(parts):
            for bin_number in range(bins):
                histogram[t, number, bin_number] = total[number * width + bin_number] / measured
        outside[t] = outside_count / measured


@compiled
def needed_moving_kernel(  # type: ignore[no-untyped-def]
    vertex, first, places, scale, sensor, bins, beyond, live, needed
):
    """Mark what :func:`sd2core.doppler.kernels.needed_kernel` marks, of the pairs."""
    samples = scale.shape[1]
    sx, sy, sz = sensor[0], sensor[1], sensor[2]
    offset, distance = np.float32(0.5 * bins), distance_of(sensor)
    f = np.empty(RUN, places.dtype)
    near, far = np.empty(RUN, places.dtype), np.empty(RUN, places.dtype)
    seen, slot = np.ones(RUN, np.uint8), np.empty(RUN, np.uint8)
    for t in range(first.shape[0] - 1):
        pairs = first[t + 1] - first[t]
        stretch = 3 * (1 + 2 * samples)
        here = places[stretch * first[t] : stretch * first[t + 1]].reshape((stretch, pairs))
        for sample in range(samples):
            if scale[t, sample] <= 0:
                continue
            a, b = here[3 + 6 * sample :], here[6 + 6 * sample :]
            for p in range(0, pairs, RUN):
                q = min(p + RUN, pairs)
                n = q - p
                relative_ranges(a[0, p:q], a[1, p:q], a[2, p:q], sx, sy, sz, distance, near[:n])
                relative_ranges(b[0, p:q], b[1, p:q], b[2, p:q], sx, sy, sz, distance, far[:n])
                axis_positions(near[:n], far[:n], scale[t, sample], offset, f[:n])
                slots_of(f[:n], seen[:n], bins, beyond, slot[:n])
                for i in range(n):
                    needed[t, vertex[first[t] + p + i]] |= live[slot[i]]


@compiled
def facing_counts_kernel(points, normals, heads, sensor, visible):  # type: ignore[no-untyped-def]
    """Number of vertices that face the sensor in each frame, or of those that they stand for."""
    seen = np.empty(points.shape[2], np.uint8)
    for t in range(points.shape[0]):
        x, y, z = points[t, 0], points[t, 1], points[t, 2]
        facing_kernel(
            x, y, z, normals[t, 0], normals[t, 1], normals[t, 2],
            sensor[0], sensor[1], sensor[2], seen,
        )  # fmt: skip
        total = np.int64(0)
        if heads.shape[0] > 0:
            total += heads_seen(seen, heads)
        else:
            for v in range(seen.shape[0]):
                total += np.int64(seen[v])
        visible[t] = total


def compile_kernels() -> None:
    """Call every kernel of this module once in single and once in double precision."""
    knots, first = np.zeros((1, 1), np.int64), np.array([0, 4])
    normals, marks = np.zeros((3, 4), np.int8), np.zeros((1, 4), np.bool_)
    vectors, heads = np.ones((3, 4), np.float32), np.ones(4, np.float32)
    vertex, part = np.arange(4, dtype=np.int32), np.zeros(4, np.uint8)
    for precision in (np.float32, np.float64):
        positions = np.ones((1, 3, 4), precision)
        moving_kernel(positions, knots, knots, np.ones((1, 1)), marks)
        places_kernel(positions, knots[0], knots, knots, vertex, first, np.empty(36, precision))
        add_moving_kernel(
            vertex, first, np.ones(36, precision), np.ones((1, 1), precision), normals,
            np.zeros((1, 4), np.uint8), heads, vectors, heads, part, 4,
            np.zeros(3, precision), ALL, HEADS, 32, DROP, 4.0, np.float32(2.2),
            np.zeros((1, 1, 32)), np.zeros(1),
        )  # fmt: skip
        needed_moving_kernel(
            vertex, first, np.ones(36, precision), np.ones((1, 1), precision),
            np.zeros(3, precision), 32, DROP, np.ones(33, np.uint8), np.zeros((1, 4), np.uint8),
        )  # fmt: skip
        facing_counts_kernel(
            np.ones((1, 3, 4), precision), normals[None], heads,
            np.zeros(3, precision), np.zeros(1),
        )  # fmt: skip
