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
from sd2core.scattering.visibility import add_cross_product, facing_kernel, set_normal

GROUP = 4
"""Frames whose moving vertices are kept together. With more, knots are shared by more frames, but
more vertices are kept that do not move in all of them."""


@compiled
def moving_kernel(positions, before, after, limit_m, marks):  # type: ignore[no-untyped-def]
    """Mark the vertices (groups, V) that move ``limit_m`` (n, samples) or more in any sample."""
    for t in range(before.shape[0]):
        group = marks[t // GROUP]
        for sample in range(before.shape[1]):
            limit = limit_m[t, sample] * limit_m[t, sample]
            a, b = positions[before[t, sample]], positions[after[t, sample]]
            for v in range(marks.shape[1]):
                dx = np.float64(a[0, v]) - np.float64(b[0, v])
                dy = np.float64(a[1, v]) - np.float64(b[1, v])
                dz = np.float64(a[2, v]) - np.float64(b[2, v])
                group[v] |= dx * dx + dy * dy + dz * dz >= limit


@compiled
def places_kernel(positions, knots, vertex, first, places):  # type: ignore[no-untyped-def]
    """Write the places as :class:`sd2core.doppler.moving.MovingVertices` has them."""
    at = 0
    for group in range(knots.shape[0]):
        for knot in knots[group]:
            for axis in range(3):
                for p in range(first[group], first[group + 1]):
                    places[at] = positions[knot, axis, vertex[p]]
                    at += 1


@compiled
def gather_kernel(values, vertex, first, found):  # type: ignore[no-untyped-def]
    """Write the values (n, columns, V) of the vertices that move, frame after frame."""
    at = 0
    for t in range(values.shape[0]):
        group = t // GROUP
        for column in range(values.shape[1]):
            for p in range(first[group], first[group + 1]):
                found[at] = values[t, column, vertex[p]]
                at += 1


@compiled
def moving_normals_kernel(points, faces, vertex, first, normals):  # type: ignore[no-untyped-def]
    """Write the normals of the vertices that move, as :func:`gather_kernel` orders them.

    They are those of :func:`sd2core.scattering.visibility.vertex_normals_kernel`, of which only
    the triangles at these vertices are looked at.
    """
    total = np.empty((points.shape[2], 3), np.float64)
    moves = np.zeros(points.shape[2], np.bool_)
    near = np.empty(faces.shape[0], np.int64)
    for group in range(first.shape[0] - 1):
        numbers = vertex[first[group] : first[group + 1]]
        count = numbers.shape[0]
        moves[:] = False
        for v in numbers:
            moves[v] = True
        faces_near = 0
        for f in range(faces.shape[0]):
            near[faces_near] = f
            faces_near += moves[faces[f, 0]] | moves[faces[f, 1]] | moves[faces[f, 2]]
        for t in range(group * GROUP, min((group + 1) * GROUP, points.shape[0])):
            x, y, z = points[t, 0], points[t, 1], points[t, 2]
            for f in near[:faces_near]:
                for corner in range(3):
                    total[faces[f, corner]] = 0
            for v in numbers:
                total[v] = 0
            for f in near[:faces_near]:
                add_cross_product(x, y, z, faces[f], total)
            at = 3 * (GROUP * first[group] + (t - group * GROUP) * count)
            here = normals[at : at + 3 * count].reshape((3, count))
            for p in range(count):
                set_normal(total, numbers[p], here, p)


@compiled
def _ranges_at(here, knot, sx, sy, sz, distance, ranges, known):  # type: ignore[no-untyped-def]
    """Ranges of a group's vertices at one of its knots, computed when they are first asked for."""
    # Cut like this the compiler knows that they lie side by side.
    found = ranges[knot][: here.shape[1]]
    if not known[knot]:
        relative_ranges(
            here[3 * knot], here[3 * knot + 1], here[3 * knot + 2], sx, sy, sz, distance, found
        )
        known[knot] = True
    return found


@compiled
def _most(first):  # type: ignore[no-untyped-def]
    """Largest number of vertices in a group."""
    most = 0
    for group in range(first.shape[0] - 1):
        most = max(most, first[group + 1] - first[group])
    return most


@compiled
def _run_end(vertex, p, stop):  # type: ignore[no-untyped-def]
    """End of the vertices from ``p`` that lie in the same run as the first of them."""
    end = (vertex[p] // RUN + 1) * RUN
    if vertex[stop - 1] < end:
        return stop
    while vertex[p] < end:
        p += 1
    return p


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
    vertex, first, places, centre, before, after, start, scale, normals, mask, areas, vectors,
    heads, part, vertices, sensor, which, weighting, bins, beyond, exponent, reference,
    histogram, outside,
):  # fmt: skip
    """Count what moves as :func:`sd2core.doppler.kernels.count_kernel` counts all vertices.

    Each vertex goes to the table that it has there, run by run, so that the sums have the same
    order. ``scale``, ``mask`` and what is written are of the frames from ``start`` on.
    """
    samples = scale.shape[1]
    sx, sy, sz = sensor[0], sensor[1], sensor[2]
    offset, distance = np.float32(0.5 * bins), distance_of(sensor)
    knots = places.shape[0] // (3 * max(vertex.shape[0], 1))
    most = _most(first)
    ranges, known = np.empty((knots, most), places.dtype), np.zeros(knots, np.bool_)
    f = np.empty(most, places.dtype)
    weight, spare = np.ones(most, np.float32), np.empty(most, np.float32)
    own, seen = np.ones(most, np.float32), np.ones(most, np.uint8)
    slot, row = np.empty(most, np.uint8), np.empty(most, np.int32)
    parts, width = histogram.shape[1], bins + 2
    sums, total = np.zeros(TABLES * parts * width), np.empty(parts * width)
    slots = np.int32(parts * width)
    split, grouped = part.shape[0] > 0, heads.shape[0] > 0
    weighted = weighting != HEADS or grouped
    whole = np.int32(vertices // TABLES * TABLES)
    group = -1
    for t in range(scale.shape[0]):
        sums[:] = 0
        outside_count = np.int64(0)
        measured = 0
        for sample in range(samples):
            if scale[t, sample] > 0:
                measured += 1
        measured = max(measured, 1)
        frame = start + t
        g0, count = first[frame // GROUP], first[frame // GROUP + 1] - first[frame // GROUP]
        numbers = vertex[g0 : g0 + count]
        here = places[3 * knots * g0 : 3 * knots * (g0 + count)].reshape((3 * knots, count))
        if frame // GROUP != group:
            group = frame // GROUP
            known[:] = False
            for i in range(count):
                v = numbers[i]
                row[i] = (v & np.int32(TABLES - 1)) * slots if v < whole else np.int32(0)
            if split:
                for i in range(count):
                    row[i] += np.int32(part[numbers[i]]) * np.int32(width)
            if grouped:
                for i in range(count):
                    own[i] = heads[numbers[i]]
        # Values of one column of this frame, and of three.
        one = GROUP * g0 + (frame - group * GROUP) * count
        middle = 3 * centre[frame]
        x, y, z = here[middle], here[middle + 1], here[middle + 2]
        if which == FACING:
            nx, ny, nz = normals[3 * one : 3 * (one + count)].reshape((3, count))
            facing_kernel(x, y, z, nx, ny, nz, sx, sy, sz, seen[:count])
        elif which == MASK:
            marks = mask[t]
            for i in range(count):
                seen[i] = marks[numbers[i]]
        if exponent != 0:
            away = _ranges_at(here, centre[frame], sx, sy, sz, distance, ranges, known)
            squared_ratios(away, distance, reference, weight[:count])
            raise_to(weight[:count], exponent, spare[:count])
        if weighted:
            if weighting == AREA:
                spare[:count] = areas[one : one + count]
            elif weighting == PROJECTED:
                ax, ay, az = vectors[3 * one : 3 * (one + count)].reshape((3, count))
                projected(x, y, z, ax, ay, az, sx, sy, sz, spare[:count])
            else:
                spare[:count] = own[:count]
            if exponent != 0:
                for i in range(count):
                    weight[i] *= spare[i]
            else:
                weight[:count] = spare[:count]
        p = 0
        while p < count:
            q = _run_end(numbers, p, count)
            for sample in range(samples):
                if scale[t, sample] <= 0:
                    continue
                a = _ranges_at(here, before[frame, sample], sx, sy, sz, distance, ranges, known)
                b = _ranges_at(here, after[frame, sample], sx, sy, sz, distance, ranges, known)
                axis_positions(a[p:q], b[p:q], scale[t, sample], offset, f[p:q])
                if grouped:
                    outside_count += heads_beyond(f[p:q], seen[p:q], own[p:q], bins)
                    slots_of(f[p:q], seen[p:q], bins, beyond, slot[p:q])
                else:
                    outside_count += slots_of(f[p:q], seen[p:q], bins, beyond, slot[p:q])
                _add(slot[p:q], weight[p:q], row[p:q], sums)
            p = q
        _total(sums, total)
        for number in range(parts):
            for bin_number in range(bins):
                histogram[t, number, bin_number] = total[number * width + bin_number] / measured
        outside[t] = outside_count / measured


@compiled
def needed_moving_kernel(  # type: ignore[no-untyped-def]
    vertex, first, places, before, after, start, scale, sensor, bins, beyond, live, needed
):
    """Mark what :func:`sd2core.doppler.kernels.needed_kernel` marks."""
    sx, sy, sz = sensor[0], sensor[1], sensor[2]
    offset, distance = np.float32(0.5 * bins), distance_of(sensor)
    knots = places.shape[0] // (3 * max(vertex.shape[0], 1))
    most = _most(first)
    ranges, known = np.empty((knots, most), places.dtype), np.zeros(knots, np.bool_)
    f, seen = np.empty(most, places.dtype), np.ones(most, np.uint8)
    slot = np.empty(most, np.uint8)
    group = -1
    for t in range(scale.shape[0]):
        frame = start + t
        if frame // GROUP != group:
            group = frame // GROUP
            known[:] = False
        g0, count = first[group], first[group + 1] - first[group]
        here = places[3 * knots * g0 : 3 * knots * (g0 + count)].reshape((3 * knots, count))
        for sample in range(scale.shape[1]):
            if scale[t, sample] <= 0:
                continue
            a = _ranges_at(here, before[frame, sample], sx, sy, sz, distance, ranges, known)
            b = _ranges_at(here, after[frame, sample], sx, sy, sz, distance, ranges, known)
            axis_positions(a, b, scale[t, sample], offset, f[:count])
            slots_of(f[:count], seen[:count], bins, beyond, slot[:count])
            for i in range(count):
                needed[t, vertex[g0 + i]] |= live[slot[i]]


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
    normals, marks = np.zeros((1, 3, 4), np.int8), np.zeros((1, 4), np.bool_)
    vectors, heads = np.ones((1, 3, 4), np.float32), np.ones(4, np.float32)
    vertex, part = np.arange(4, dtype=np.int32), np.zeros(4, np.uint8)
    for values in (normals, vectors):
        gather_kernel(values, vertex, first, np.empty(48, values.dtype))
    few, more = np.zeros(48, np.int8), np.ones(48, np.float32)
    moving_normals_kernel(vectors, np.array([[0, 1, 2]], np.int32), vertex, first, few)
    for precision in (np.float32, np.float64):
        positions, places = np.ones((1, 3, 4), precision), np.ones(12, precision)
        scale, sensor = np.ones((1, 1), precision), np.zeros(3, precision)
        moving_kernel(positions, knots, knots, np.ones((1, 1)), marks)
        places_kernel(positions, knots, vertex, first, places)
        add_moving_kernel(
            vertex, first, places, knots[0], knots, knots, 0, scale, few,
            np.zeros((1, 4), np.uint8), more, more, heads, part, 4, sensor, ALL, HEADS, 32, DROP,
            4.0, np.float32(2.2), np.zeros((1, 1, 32)), np.zeros(1),
        )  # fmt: skip
        needed_moving_kernel(
            vertex, first, places, knots, knots, 0, scale, sensor, 32, DROP,
            np.ones(33, np.uint8), np.zeros((1, 4), np.uint8),
        )  # fmt: skip
        facing_counts_kernel(positions, normals, heads, sensor, np.zeros(1))
