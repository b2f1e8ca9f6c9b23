"""Compiled inner loops of counting limb by limb, on a fine axis or spread over the bins.

:mod:`sd2core.doppler.limb_histograms` and :mod:`sd2core.doppler.expected` explain the numbers.
"""

from __future__ import annotations

import math

import numpy as np

from sd2core.doppler.kernels import (
    DROP,
    MASK,
    RUN,
    WRAP,
    axis_positions,
    distances_of,
    group_of,
    multiplicity_beyond,
    multiplicity_seen,
    ranges_at,
    weigh_run,
)
from sd2core.numerics.compiled import compiled

PARTS = 8
"""Number of parts of the fine axis per bin."""

REACH = 4
"""Half width at which the normal distribution is cut, in standard deviations."""

SPREAD_AT_ONCE = 0.05
"""Deviation in bins below which each vertex is spread by itself: parts would be too coarse."""

_STEPS = 256
"""Entries of the table of that distribution per standard deviation; right to 1e-6 in between."""

_AT = np.linspace(-REACH, REACH, 2 * REACH * _STEPS + 1) / math.sqrt(2)
_TABLE = np.array([math.erf(at) for at in _AT.tolist()])
_TABLE = (_TABLE - _TABLE[0]) / (_TABLE[-1] - _TABLE[0])


@compiled
def fine_kernel(  # type: ignore[no-untyped-def]
    paths, scale, scatterers, ends, law, limb, room, sigma, part, fine, histogram, visible,
    outside,
) -> None:  # fmt: skip
    """Count every limb on a fine axis, and spread its parts over the bins.

    Each part is spread from the mean place of what lies in it, by what deviation that has itself
    and by that of its limb.

    Parameters
    ----------
    paths, scale, scatterers, ends, law
        As for :func:`~sd2core.doppler.kernels.count_kernel`; the paths are those of all vertices.
    limb : intp (V,)
        Limb of each vertex, which takes the place of the scatterers' part.
    room : int
        Bins beyond each end of the axis.
    sigma : float64 (n, limbs)
        Deviation of each limb in bins; of those below ``SPREAD_AT_ONCE`` that are not 0 each
        vertex is spread by itself.
    part : intp (limbs,)
        Part of the body of each limb.
    fine : float64 (n, limbs, parts)
        Sum of the weights in each part of the axis; what is written here is not spread. Of no
        frames, it only says how many parts there are. This and what follows is written, and zero
        at first.
    histogram : float64 (n, body parts, bins)
        Of what is spread.
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
    number, within = np.empty(min(most, RUN), np.int32), np.empty(min(most, RUN), places.dtype)
    parts, spreads, grouped = fine.shape[2], fine.shape[0] == 0, multiplicity.shape[0] > 0
    table = np.zeros((sigma.shape[1] * parts, 3))
    row = (limb * parts).astype(np.uint32)
    for t in range(scale.shape[0]):
        if which == MASK:
            marks = mask[t]
        measured = 0
        for sample in range(samples):
            measured += scale[t, sample] > 0
        share = 1.0 / max(measured, 1)
        knot = centre[t]
        low, high = parts, 0
        for p in range(0, most, RUN):
            q = min(p + RUN, most)
            n = q - p
            away = ranges_at(here, knot, ends, distances, ranges, held)
            sight = weigh_run(
                p, q, most * t, here[3 * knot : 3 * knot + 3], away, numbers, multiplicity, normals,
                marks, areas, vectors, which, weighting, beam, ends, distances, exponent,
                reference, seen[:n], weight[:n], spare[:n],
            )  # fmt: skip
            if grouped:
                visible[t] += multiplicity_seen(sight, multiplicity[p:q])
            else:
                visible[t] += sight.sum()
            for sample in range(samples):
                if scale[t, sample] <= 0:
                    continue
                a = ranges_at(here, before[t, sample], ends, distances, ranges, held)
                b = ranges_at(here, after[t, sample], ends, distances, ranges, held)
                axis_positions(a[p:q], b[p:q], scale[t, sample], offset, f[:n])
                if grouped:
                    outside[t] += share * multiplicity_beyond(f[:n], sight, multiplicity[p:q], bins)
                else:
                    outside[t] += share * _number_beyond(f[:n], sight, bins)
                least, last = _find_parts(f[:n], bins, room, beyond, parts, number[:n], within[:n])
                low, high = min(low, least), max(high, last + 1)
                if spreads:
                    _spread_alone(
                        number[:n], within[:n], sight, weight[:n], share, limb[p:q], sigma[t], part,
                        bins, room, beyond, histogram[t],
                    )  # fmt: skip
                _add_parts(number[:n], within[:n], sight, weight[:n], row[p:q], table)
        if spreads:
            _spread_parts(table, low, high, share, sigma[t], part, bins, room, beyond, histogram[t])
        else:
            fine[t] = share * table[:, 0].copy().reshape(fine.shape[1:])
            table[:] = 0


@compiled
def _number_beyond(f, seen, bins):  # type: ignore[no-untyped-def]
    """Return the number of visible vertices beyond the axis."""
    outside, zero, end = np.int32(0), np.float32(0), np.float32(bins)
    for v in range(f.shape[0]):
        inside = (f[v] >= zero) & (f[v] <= end)
        outside += np.int32((not inside) & (seen[v] != 0))
    return outside


@compiled
def _find_parts(f, bins, room, beyond, parts, number, within):  # type: ignore[no-untyped-def]
    """Set the part of the axis that each vertex lies in (-1: nowhere), and its place within it.

    Returns the first and the last of these parts. ``f``, places in bins, is work space.
    """
    zero, end = np.float32(0), np.float32(bins)
    least, most = np.float32(-room - 1), np.float32(bins + room + 1)
    # The axis is closed at both ends.
    inner, last = end - np.float32(1e-3), np.float32(parts - 1)
    if beyond == WRAP:
        for v in range(f.shape[0]):
            x = f[v]
            y = x - end * np.floor(x / end)
            f[v] = x if (x >= zero) & (x <= end) else y
    low, high = np.int32(parts - 1), np.int32(0)
    for v in range(f.shape[0]):
        x = f[v]
        x = inner if (x > inner) & (x <= end) else x
        x = x if x > least else least
        x = x if x < most else most
        x = (x + np.float32(room)) * np.float32(PARTS)
        place = x if x > zero else zero
        place = place if place < last else last
        whole = np.int32(place)
        number[v] = whole if f[v] == f[v] else np.int32(-1)
        within[v] = x - np.float32(whole)
        low, high = min(low, whole), max(high, whole)
    return low, high


@compiled
def _spread_alone(  # type: ignore[no-untyped-def]
    number, within, seen, weight, share, limb, sigma, part, bins, room, beyond, histogram
):
    """Spread each vertex of limbs with a small deviation, which then are nowhere."""
    for one in range(sigma.shape[0]):
        if not 0 < sigma[one] < SPREAD_AT_ONCE:
            continue
        for v in range(limb.shape[0]):
            if limb[v] == one and number[v] >= 0:
                if seen[v] != 0:
                    place = np.float64(number[v] + within[v]) / PARTS - room
                    amount = share * weight[v]
                    _spread(place, amount, sigma[one], bins, beyond, histogram[part[one]])
                number[v] = -1


@compiled
def _add_parts(number, within, seen, weight, row, table):  # type: ignore[no-untyped-def]
    """Add weights, and their first and second moments within a part, to the row of its limb."""
    for v in range(number.shape[0]):
        if seen[v] != 0 and number[v] >= 0:
            at = row[v] + np.uint32(number[v])
            amount, place = np.float64(weight[v]), np.float64(within[v])
            table[at, 0] += amount
            table[at, 1] += amount * place
            table[at, 2] += amount * place * place


@compiled
def _spread_parts(  # type: ignore[no-untyped-def]
    table, low, high, share, sigma, part, bins, room, beyond, histogram
):
    """Move what :func:`_add_parts` has gathered in some parts of the axis to the bins, spread."""
    parts = table.shape[0] // sigma.shape[0]
    for limb in range(sigma.shape[0]):
        for number in range(low, high):
            weight, first, second = row = table[limb * parts + number]
            if weight == 0:
                continue
            row[:] = 0
            place, deviation = first / weight, 0.0
            if sigma[limb] > 0:
                variance = max(second / weight - place * place, 0.0) / PARTS**2
                deviation = np.sqrt(sigma[limb] ** 2 + variance)
            at = (number + place) / PARTS - room
            _spread(at, share * weight, deviation, bins, beyond, histogram[part[limb]])


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
