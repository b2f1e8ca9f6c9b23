"""Compiled inner loops of counting limb by limb, on a fine axis or spread over the bins.

:mod:`sd2core.doppler.limb_histograms` and :mod:`sd2core.doppler.expected` explain the numbers.
"""

from __future__ import annotations

import numpy as np
from scipy.special import ndtr

from sd2core.doppler.kernels import (
    ALL,
    DROP,
    HEADS,
    RUN,
    WRAP,
    axis_positions,
    distance_of,
    extend,
    weigh_run,
)
from sd2core.numerics.compiled import compiled

PARTS = 8
"""Number of parts of the fine axis per bin."""

REACH = 4
"""Half width at which the normal distribution is cut, in standard deviations."""

SPREAD_AT_ONCE = 0.6
"""Deviation in bins below which each vertex is spread by itself: parts would be too coarse."""

_STEPS = 256
"""Entries of the table of that distribution per standard deviation; right to 1e-6 in between."""

_TABLE = ndtr(np.linspace(-REACH, REACH, 2 * REACH * _STEPS + 1))
_TABLE = (_TABLE - _TABLE[0]) / (_TABLE[-1] - _TABLE[0])


@compiled
def fine_kernel(  # type: ignore[no-untyped-def]
    positions, centre, before, after, scale, normals, mask, areas, vectors, heads, limb, sensor,
    which, weighting, bins, room, beyond, exponent, reference, sigma, part, fine, histogram,
    visible, outside,
) -> None:  # fmt: skip
    """Count every limb on a fine axis, (n, limbs, parts, 2), or spread its vertices at once.

    A part holds the sum of its weights, and that of weights times the place within the part. The
    last four are written, and zero at first. ``sigma`` (n, limbs) is that of each limb in bins: of
    those below ``SPREAD_AT_ONCE`` the vertices go to ``histogram`` (n, body parts, bins), spread;
    ``part`` (limbs,) is a limb's part of the body.
    """
    vertices, samples = positions.shape[2], before.shape[1]
    offset = np.float32(0.5 * bins)
    f = np.empty(RUN, positions.dtype)
    weight = np.ones(RUN, np.float32)
    spare = np.empty(RUN, np.float32)
    turned = np.empty(RUN, np.float32)
    seen = np.ones(RUN, np.uint8)
    distance = distance_of(sensor)
    ring = np.empty((samples + 2, vertices), positions.dtype)
    known = before[0, 0]
    for t in range(centre.shape[0]):
        known = extend(positions, sensor, distance, known, after[t, samples - 1], ring)
        measured = 0
        for sample in range(samples):
            measured += scale[t, sample] > 0
        share = 1.0 / max(measured, 1)
        for v0 in range(0, vertices, RUN):
            v1 = min(v0 + RUN, vertices)
            n = v1 - v0
            sight = weigh_run(
                t, v0, v1, positions[centre[t]], ring[centre[t] % ring.shape[0]], normals, mask,
                areas, vectors, heads, sensor, distance, which, weighting, exponent, reference,
                seen, weight, spare, turned,
            )  # fmt: skip
            for v in range(n):
                if sight[v] != 0:
                    visible[t] += heads[v0 + v] if heads.shape[0] > 0 else 1.0
            for sample in range(samples):
                if scale[t, sample] <= 0:
                    continue
                a = ring[before[t, sample] % ring.shape[0]]
                b = ring[after[t, sample] % ring.shape[0]]
                axis_positions(a[v0:v1], b[v0:v1], scale[t, sample], offset, f[:n])
                outside[t] += share * _tally(
                    f[:n], sight, weight, share, limb[v0:v1], heads[v0:v1], bins, room, beyond,
                    sigma[t], part, fine[t], histogram[t],
                )  # fmt: skip


@compiled
def _tally(  # type: ignore[no-untyped-def]
    f, sight, weight, share, limb, heads, bins, room, beyond, sigma, part, fine, histogram
):
    """Add a run of vertices; returns the number of visible ones beyond the axis."""
    parts = fine.shape[1]
    end = np.float32(bins)
    inner = end - np.float32(1e-3)
    least, most = np.float32(-room - 1), np.float32(bins + room + 1)
    outside = 0.0
    for v in range(f.shape[0]):
        if sight[v] == 0:
            continue
        x, amount, number = f[v], weight[v] * share, limb[v]
        inside = (x >= np.float32(0)) & (x <= end)
        if not inside:
            outside += heads[v] if heads.shape[0] > 0 else 1.0
            if beyond == WRAP:
                x = min(max(x - end * np.floor(x / end), np.float32(0)), end)
            else:
                x = max(min(x, most), least)
        if not np.isfinite(x):
            continue
        if sigma[number] == 0 and (inside or beyond == WRAP):
            x = min(x, inner)  # the axis is closed at both ends
        if sigma[number] < SPREAD_AT_ONCE:
            _spread(np.float64(x), amount, sigma[number], bins, beyond, histogram[part[number]])
            continue
        x *= np.float32(PARTS)
        place = min(max(int(np.floor(x)) + room * PARTS, 0), parts - 1)
        fine[number, place, 0] += amount
        fine[number, place, 1] += amount * (x - np.float32(place - room * PARTS))
    return outside


@compiled
def spread_kernel(fine, sigma, part, bins, room, beyond, histogram):  # type: ignore[no-untyped-def]
    """Add the fine histograms of :func:`fine_kernel` to coarse ones (n, body parts, bins), spread.

    Each part is spread from the mean place of what lies in it.
    """
    for t in range(fine.shape[0]):
        for limb in range(fine.shape[1]):
            if sigma[t, limb] < SPREAD_AT_ONCE:
                continue
            for number in range(fine.shape[2]):
                weight = fine[t, limb, number, 0]
                if weight != 0:
                    place = (number + fine[t, limb, number, 1] / weight) / PARTS - room
                    _spread(place, weight, sigma[t, limb], bins, beyond, histogram[t, part[limb]])


@compiled
def _spread(place, weight, sigma, bins, beyond, into):  # type: ignore[no-untyped-def]
    """Add a weight at a place of the axis to the bins, spread by a deviation in bins."""
    low, high = int(np.floor(place - REACH * sigma)), int(np.floor(place + REACH * sigma))
    first, last = low, high
    if beyond == DROP:
        low, high = max(low, 0), min(high, bins - 1)
    scale = _STEPS / sigma if sigma > 0 else 0.0
    below = 0.0 if low == first else _share_below((low - place) * scale)
    for whole in range(low, high + 1):
        above = _share_below((whole + 1 - place) * scale) if whole < last else 1.0
        number = whole % bins if beyond == WRAP else min(max(whole, 0), bins - 1)
        into[number] += weight * (above - below)
        below = above


@compiled
def _share_below(steps):  # type: ignore[no-untyped-def]
    """Normal distribution so many steps of the table from its middle."""
    at = steps + REACH * _STEPS
    if at <= 0:
        return 0.0
    if at >= 2 * REACH * _STEPS:
        return 1.0
    whole = int(at)
    return _TABLE[whole] + (at - whole) * (_TABLE[whole + 1] - _TABLE[whole])


def compile_kernels() -> None:
    """Call every kernel of this module once in single and once in double precision."""
    knots, marks = np.zeros((1, 1), np.int64), np.zeros((1, 4), np.uint8)
    normals, heads = np.zeros((1, 3, 4), np.int8), np.ones(4, np.float32)
    vectors, sigma, part = np.ones((1, 3, 4), np.float32), np.ones((1, 1)), np.zeros(1, np.intp)
    fine, coarse = np.zeros((1, 1, 256, 2)), np.zeros((1, 1, 32))
    for precision in (np.float32, np.float64):
        fine_kernel(
            np.ones((1, 3, 4), precision), knots[0], knots, knots, np.ones((1, 1), precision),
            normals, marks, heads[None], vectors, heads, part[[0, 0, 0, 0]], np.zeros(3, precision),
            ALL, HEADS, 32, 0, DROP, 4.0, np.float32(2.2), sigma, part, fine, coarse,
            np.zeros(1), np.zeros(1),
        )  # fmt: skip
    spread_kernel(fine, sigma, part, 32, 0, DROP, coarse)
