"""Compiled inner loops of counting limb by limb, on a fine axis or spread over the bins.

:mod:`sd2core.doppler.limb_histograms` and :mod:`sd2core.doppler.expected` explain the numbers.
"""

from __future__ import annotations

import numpy as np
from scipy.special import ndtr

from sd2core.doppler.kernels import (
    ALL,
    DROP,
    MASK,
    ONE,
    RUN,
    WRAP,
    axis_positions,
    distances_of,
    group_of,
    ranges_at,
    weigh_run,
)
from sd2core.numerics.compiled import compiled
from sd2core.scattering.beam_kernels import beam_tables

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
    paths, scale, scatterers, ends, law, limb, room, sigma, part, fine, histogram, visible,
    outside,
) -> None:  # fmt: skip
    """Count every limb on a fine axis, or spread its vertices at once.

    Parameters
    ----------
    paths, scale, scatterers, ends, law
        As for :func:`~sd2core.doppler.kernels.count_kernel`; the paths are those of all vertices.
    limb : intp (V,)
        Limb of each vertex, which takes the place of the scatterers' part.
    room : int
        Bins beyond each end of the axis.
    sigma : float64 (n, limbs)
        Deviation of each limb in bins: of those below ``SPREAD_AT_ONCE`` the vertices go to
        ``histogram``, spread, all others to ``fine``.
    part : intp (limbs,)
        Part of the body of each limb.
    fine : float64 (n, limbs, parts, 2)
        Sum of the weights in a part, and that of weights times the place within the part. This
        and what follows is written, and zero at first.
    histogram : float64 (n, body parts, bins)
        Of what is spread at once.
    visible, outside : float64 (n,)
        Number of visible vertices, and of those of them beyond the axis.
    """
    vertex, first, places, centre, before, after, _, _ = paths
    normals, mask, areas, vectors, multiplicity, _, which, weighting, beam = scatterers
    bins, beyond, exponent, reference = law
    numbers, here = group_of(vertex, first, places, 0)
    marks = np.empty(0, np.uint8)
    samples, most = scale.shape[1], numbers.shape[0]
    offset, distances = np.float32(0.5 * bins), distances_of(ends)
    ranges, held = np.empty((samples + 2, most), places.dtype), np.full(samples + 2, -1)
    f, seen = np.empty(min(most, RUN), places.dtype), np.ones(min(most, RUN), np.uint8)
    weight, spare = np.ones(min(most, RUN), np.float32), np.empty(min(most, RUN), np.float32)
    for t in range(scale.shape[0]):
        if which == MASK:
            marks = mask[t]
        measured = 0
        for sample in range(samples):
            measured += scale[t, sample] > 0
        share = 1.0 / max(measured, 1)
        knot = centre[t]
        for p in range(0, most, RUN):
            q = min(p + RUN, most)
            n = q - p
            away = ranges_at(here, knot, ends, distances, ranges, held)
            sight = weigh_run(
                p, q, most * t, here[3 * knot : 3 * knot + 3], away, numbers, multiplicity, normals,
                marks, areas, vectors, which, weighting, beam, ends, distances, exponent,
                reference, seen[:n], weight[:n], spare[:n],
            )  # fmt: skip
            for i in range(n):
                if sight[i] != 0:
                    visible[t] += multiplicity[p + i] if multiplicity.shape[0] > 0 else 1.0
            for sample in range(samples):
                if scale[t, sample] <= 0:
                    continue
                a = ranges_at(here, before[t, sample], ends, distances, ranges, held)
                b = ranges_at(here, after[t, sample], ends, distances, ranges, held)
                axis_positions(a[p:q], b[p:q], scale[t, sample], offset, f[:n])
                outside[t] += share * _tally(
                    f[:n], sight, weight[:n], share, limb[p:q], multiplicity[p:q], bins, room,
                    beyond, sigma[t], part, fine[t], histogram[t],
                )  # fmt: skip


@compiled
def _tally(  # type: ignore[no-untyped-def]
    f, sight, weight, share, limb, multiplicity, bins, room, beyond, sigma, part, fine, histogram
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
            outside += multiplicity[v] if multiplicity.shape[0] > 0 else 1.0
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
    """Add the fine histograms of :func:`fine_kernel` to coarse ones, spread.

    Each part is spread from the mean place of what lies in it.

    Parameters
    ----------
    fine, sigma, part, room
        As for :func:`fine_kernel`.
    bins, beyond : int
        Those of the axis.
    histogram : float64 (n, body parts, bins)
        Added to.
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
    knots, first, numbers = np.zeros((1, 1), np.int64), np.array([0, 4]), np.arange(4, dtype="i4")
    marks, areas = np.zeros((1, 4), np.uint8), np.ones(12, np.float32)
    tables = beam_tables(None)
    beam = (tables.axes[None], tables.across, tables.up)
    scatterers = (np.zeros(12, np.int8), marks, areas, areas, areas[:4], marks[0], ALL, ONE, beam)
    sigma, part = np.ones((1, 1)), np.zeros(1, np.intp)
    fine, coarse = np.zeros((1, 1, 256, 2)), np.zeros((1, 1, 32))
    for precision in (np.float32, np.float64):
        paths = (numbers, first, np.ones(12, precision), knots[0], knots, knots, 1, 4)
        fine_kernel(
            paths, np.ones((1, 1), precision), scatterers, np.zeros((1, 3), precision),
            (32, DROP, 4.0, np.float32(2.2)), part[[0, 0, 0, 0]], 0, sigma, part, fine, coarse,
            np.zeros(1), np.zeros(1),
        )  # fmt: skip
    spread_kernel(fine, sigma, part, 32, 0, DROP, coarse)
