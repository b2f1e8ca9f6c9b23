"""Compiled inner loops of counting.

Each frame is processed in runs of vertices that stay in the second-level
cache. Each step of a run is a loop of its own with few streams, which the compiler
turns into vector instructions. :mod:`sd2core.doppler.histogram` explains the
numbers. Positions, sensor and scale are all in single precision, or all in
double: the compiler makes two forms of each loop, and constants are in single
precision, so that they do not widen the first (docs/decisions/0013).
"""

from __future__ import annotations

import numpy as np

from sd2core.numerics.compiled import compiled
from sd2core.scattering.amplitude import NEAREST_RANGE_M
from sd2core.scattering.visibility import facing_kernel

RUN = 16384
TABLES = 8
_NEAREST = np.float32(NEAREST_RANGE_M)

ALL, FACING, MASK = 0, 1, 2
"""Which vertices count: all, those facing the sensor, those marked in a mask."""

HEADS, AREA, PROJECTED = 0, 1, 2
"""What a vertex counts: the vertices it stands for, its area, that towards the sensor."""

DROP, WRAP, CLIP = 0, 1, 2
"""What happens beyond the axis."""


@compiled
def relative_ranges(x, y, z, sx, sy, sz, distance, ranges):  # type: ignore[no-untyped-def]
    """Compiled form of :func:`sd2core.doppler.histogram.relative_range` for one knot."""
    two = np.float32(2)
    for v in range(ranges.shape[0]):
        px, py, pz = x[v], y[v], z[v]
        qx, qy, qz = px - sx, py - sy, pz - sz
        away = np.sqrt(qx * qx + qy * qy + qz * qz)
        difference = px * (px - two * sx) + py * (py - two * sy) + pz * (pz - two * sz)
        ranges[v] = difference / max(away + distance, np.float32(1e-30))


@compiled
def distance_of(sensor):  # type: ignore[no-untyped-def]
    """Distance of the sensor from the origin, in the sensor's precision."""
    away = np.sqrt(
        np.float64(sensor[0]) ** 2 + np.float64(sensor[1]) ** 2 + np.float64(sensor[2]) ** 2
    )
    return sensor.dtype.type(away)


@compiled
def extend(positions, sensor, distance, known, upto, ring):  # type: ignore[no-untyped-def]
    """Compute the knots from ``known`` to ``upto``; the ring keeps the newest few."""
    for knot in range(known, upto + 1):
        points = positions[knot]
        relative_ranges(
            points[0], points[1], points[2],
            sensor[0], sensor[1], sensor[2], distance, ring[knot % ring.shape[0]],
        )  # fmt: skip
    return max(known, upto + 1)


@compiled
def axis_positions(before, after, scale, offset, f):  # type: ignore[no-untyped-def]
    """Position on the velocity axis, in bins."""
    for v in range(f.shape[0]):
        f[v] = offset + scale * (before[v] - after[v])


@compiled
def slots_of(f, seen, bins, beyond, slot):  # type: ignore[no-untyped-def]
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
def squared_ratios(ranges, distance, reference, weight):  # type: ignore[no-untyped-def]
    """Squared ratios (R_ref / R)² of a run of vertices."""
    for v in range(weight.shape[0]):
        ratio = reference / max(ranges[v] + distance, _NEAREST)
        weight[v] = ratio * ratio


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
def projected(x, y, z, ax, ay, az, sx, sy, sz, weight):  # type: ignore[no-untyped-def]
    """Compiled form of :func:`sd2core.scattering.amplitude.projected_areas`."""
    for v in range(weight.shape[0]):
        qx, qy, qz = sx - x[v], sy - y[v], sz - z[v]
        along = max(qx * ax[v] + qy * ay[v] + qz * az[v], np.float32(0))
        weight[v] = along / max(np.sqrt(qx * qx + qy * qy + qz * qz), np.float32(1e-30))


@compiled
def heads_beyond(f, seen, heads, bins):  # type: ignore[no-untyped-def]
    """Number of vertices that the visible ones beyond the axis stand for."""
    end, total = np.float32(bins), np.int32(0)
    for v in range(f.shape[0]):
        outside = (seen[v] != 0) & ((f[v] < np.float32(0)) | (f[v] > end))
        total += np.int32(heads[v]) if outside else np.int32(0)
    return total


@compiled
def heads_seen(seen, heads):  # type: ignore[no-untyped-def]
    """Number of vertices that the visible ones stand for."""
    total = np.int32(0)
    for v in range(seen.shape[0]):
        total += np.int32(heads[v]) if seen[v] != 0 else np.int32(0)
    return total


@compiled
def _tally(slot, counts):  # type: ignore[no-untyped-def]
    """Add 1 per vertex; several tables in turn, so that equal slots do not wait."""
    whole = slot.shape[0] // TABLES * TABLES
    for v in range(0, whole, TABLES):
        for table in range(TABLES):
            counts[table, slot[v + table]] += np.int32(1)
    for v in range(whole, slot.shape[0]):
        counts[0, slot[v]] += np.int32(1)


@compiled
def _tally_weights(slot, weight, sums):  # type: ignore[no-untyped-def]
    whole = slot.shape[0] // TABLES * TABLES
    for v in range(0, whole, TABLES):
        for table in range(TABLES):
            sums[table, slot[v + table]] += np.float64(weight[v + table])
    for v in range(whole, slot.shape[0]):
        sums[0, slot[v]] += np.float64(weight[v])


@compiled
def _tally_parts(slot, base, counts):  # type: ignore[no-untyped-def]
    """Add 1 per vertex; the slots of its part of the body begin at ``base``."""
    whole = slot.shape[0] // TABLES * TABLES
    for v in range(0, whole, TABLES):
        for table in range(TABLES):
            counts[table, base[v + table] + slot[v + table]] += np.int32(1)
    for v in range(whole, slot.shape[0]):
        counts[0, base[v] + slot[v]] += np.int32(1)


@compiled
def _tally_weights_of_parts(slot, weight, base, sums):  # type: ignore[no-untyped-def]
    whole = slot.shape[0] // TABLES * TABLES
    for v in range(0, whole, TABLES):
        for table in range(TABLES):
            sums[table, base[v + table] + slot[v + table]] += np.float64(weight[v + table])
    for v in range(whole, slot.shape[0]):
        sums[0, base[v] + slot[v]] += np.float64(weight[v])


@compiled
def weigh_run(  # type: ignore[no-untyped-def]
    t, v0, v1, middle, ranges, normals, mask, areas, vectors, heads, sensor, distance,
    which, weighting, exponent, reference, seen, weight, spare, turned,
):  # fmt: skip
    """Visibility of vertices ``v0`` to ``v1`` of a frame; their weights are written unless all 1.

    ``middle`` (3, V) and ``ranges`` (V,) are those of the frame; the last four are work space.
    """
    n = v1 - v0
    x, y, z = middle[0], middle[1], middle[2]
    sx, sy, sz = sensor[0], sensor[1], sensor[2]
    sight = seen[:n]
    if which == FACING:
        nx, ny, nz = normals[t, 0], normals[t, 1], normals[t, 2]
        facing_kernel(
            x[v0:v1], y[v0:v1], z[v0:v1], nx[v0:v1], ny[v0:v1], nz[v0:v1], sx, sy, sz, sight
        )
    elif which == MASK:
        marks = mask[t]
        sight = marks[v0:v1]
    if exponent != 0:
        squared_ratios(ranges[v0:v1], distance, reference, weight[:n])
        raise_to(weight[:n], exponent, spare[:n])
    if weighting != HEADS or heads.shape[0] > 0:
        own = heads[v0:v1]
        if weighting == AREA:
            own = areas[t, v0:v1]
        elif weighting == PROJECTED:
            own = turned[:n]
            ax, ay, az = vectors[t, 0], vectors[t, 1], vectors[t, 2]
            projected(
                x[v0:v1], y[v0:v1], z[v0:v1], ax[v0:v1], ay[v0:v1], az[v0:v1], sx, sy, sz, own
            )
        if exponent != 0:
            for v in range(n):
                weight[v] *= own[v]
        else:
            weight[:n] = own
    return sight


@compiled
def count_kernel(  # type: ignore[no-untyped-def]
    positions, centre, before, after, scale, normals, mask, areas, vectors, heads, part, sensor,
    which, weighting, bins, beyond, exponent, reference, histogram, visible, outside,
):  # fmt: skip
    """Compiled form of :func:`sd2core.doppler.histogram.count`; the last three are written.

    ``heads`` (V,) is the number of vertices that each stands for, and is empty if each
    stands for itself; ``part`` (V,) is empty if the body is not split. The histogram is of
    shape (n, parts, bins).
    """
    vertices = positions.shape[2]
    samples = before.shape[1]
    offset = np.float32(0.5 * bins)
    f = np.empty(RUN, positions.dtype)
    weight = np.empty(RUN, np.float32)
    spare = np.empty(RUN, np.float32)
    turned = np.empty(RUN, np.float32)
    seen = np.ones(RUN, np.uint8)
    slot = np.empty(RUN, np.uint8)
    parts, slots = histogram.shape[1], bins + 2
    split = part.shape[0] > 0
    base = part.astype(np.int32) * np.int32(slots)
    counts = np.zeros((TABLES, parts * slots), np.int32)
    sums = np.zeros((TABLES, parts * slots), np.float64)
    grouped = heads.shape[0] > 0
    weights = weighting != HEADS or grouped or exponent != 0
    distance = distance_of(sensor)
    ring = np.empty((samples + 2, vertices), positions.dtype)
    known = before[0, 0]
    for t in range(centre.shape[0]):
        known = extend(positions, sensor, distance, known, after[t, samples - 1], ring)
        if weights:
            sums[:] = 0
        else:
            counts[:] = 0
        seen_count = np.int64(0)
        outside_count = np.int64(0)
        measured = 0
        for sample in range(samples):
            if scale[t, sample] > 0:
                measured += 1
        measured = max(measured, 1)
        middle = positions[centre[t]]
        for v0 in range(0, vertices, RUN):
            v1 = min(v0 + RUN, vertices)
            n = v1 - v0
            sight = weigh_run(
                t, v0, v1, middle, ring[centre[t] % ring.shape[0]], normals, mask, areas, vectors,
                heads, sensor, distance, which, weighting, exponent, reference,
                seen, weight, spare, turned,
            )  # fmt: skip
            if grouped:
                seen_count += heads_seen(sight, heads[v0:v1])
            else:
                for v in range(n):
                    seen_count += np.int64(sight[v])
            for sample in range(samples):
                if scale[t, sample] <= 0:
                    continue
                a = ring[before[t, sample] % ring.shape[0]]
                b = ring[after[t, sample] % ring.shape[0]]
                axis_positions(a[v0:v1], b[v0:v1], scale[t, sample], offset, f[:n])
                if grouped:
                    outside_count += heads_beyond(f[:n], sight, heads[v0:v1], bins)
                    slots_of(f[:n], sight, bins, beyond, slot[:n])
                else:
                    outside_count += slots_of(f[:n], sight, bins, beyond, slot[:n])
                if split and weights:
                    _tally_weights_of_parts(slot[:n], weight[:n], base[v0:v1], sums)
                elif split:
                    _tally_parts(slot[:n], base[v0:v1], counts)
                elif weights:
                    _tally_weights(slot[:n], weight[:n], sums)
                else:
                    _tally(slot[:n], counts)
        for number in range(parts):
            for bin_number in range(bins):
                total, place = 0.0, number * slots + bin_number
                for table in range(TABLES):
                    total += sums[table, place] if weights else counts[table, place]
                histogram[t, number, bin_number] = total / measured
        visible[t] = seen_count
        outside[t] = outside_count / measured


@compiled
def needed_kernel(  # type: ignore[no-untyped-def]
    positions, before, after, scale, sensor, bins, beyond, live, needed
) -> None:
    """Compiled :func:`sd2core.doppler.histogram.mark_needed`; ``needed`` starts as zeros."""
    vertices = positions.shape[2]
    offset = np.float32(0.5 * bins)
    f = np.empty(RUN, positions.dtype)
    seen = np.ones(RUN, np.uint8)
    slot = np.empty(RUN, np.uint8)
    distance = distance_of(sensor)
    ring = np.empty((before.shape[1] + 2, vertices), positions.dtype)
    known = before[0, 0]
    for t in range(needed.shape[0]):
        known = extend(positions, sensor, distance, known, after[t, -1], ring)
        for sample in range(before.shape[1]):
            if scale[t, sample] <= 0:
                continue
            a = ring[before[t, sample] % ring.shape[0]]
            b = ring[after[t, sample] % ring.shape[0]]
            for v0 in range(0, vertices, RUN):
                v1 = min(v0 + RUN, vertices)
                n = v1 - v0
                axis_positions(a[v0:v1], b[v0:v1], scale[t, sample], offset, f[:n])
                slots_of(f[:n], seen[:n], bins, beyond, slot[:n])
                for v in range(n):
                    needed[t, v0 + v] |= live[slot[v]]


def compile_kernels() -> None:
    """Call every kernel of this module once in single and once in double precision."""
    knots = np.zeros((1, 1), np.int64)
    normals, marks = np.zeros((1, 3, 4), np.int8), np.zeros((1, 4), np.uint8)
    vectors, heads = np.ones((1, 3, 4), np.float32), np.ones(4, np.float32)
    for precision in (np.float32, np.float64):
        positions, sensor = np.ones((1, 3, 4), precision), np.zeros(3, precision)
        scale = np.ones((1, 1), precision)
        count_kernel(
            positions, knots[0], knots, knots, scale, normals, marks, heads[None],
            vectors, heads, marks[0], sensor, ALL, HEADS, 32, DROP, 4.0, np.float32(2.2),
            np.zeros((1, 1, 32)), np.zeros(1), np.zeros(1),
        )  # fmt: skip
        needed_kernel(
            positions, knots, knots, scale, sensor, 32, DROP, np.ones(33, np.uint8), marks.copy()
        )
