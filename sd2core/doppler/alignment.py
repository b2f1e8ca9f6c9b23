"""Offset of a radar's clock, from what its Doppler map and a synthetic one have in common."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.maps import DopplerMap
from sd2core.options.bounds import RADAR_SEARCH_S

Floats = NDArray[np.float64]

WITHIN_S = 5.0
"""How far to look for an offset, either way: usually, and at least, as a peak stands out only
among others."""
MIN_CONFIDENCE = 0.9
"""Chosen on takes of one person, judged on another's: docs/decisions/0056-alignment.md."""

_STEP_S = 1.0 / 30.0
_SMOOTH_S = 0.1
"""Standard deviation of the smoothing: what changes faster is noise."""
_MOMENT_S = 2.0 * math.sqrt(math.pi) * _SMOOTH_S
"""White noise that was smoothed has one independent value in so long."""
_ONE_SIDED = 0.01
"""Share of the energy on one side of 0 m/s below which a map does not tell the sign."""
_MIN_OVERLAP_S = 3.0
_RIVAL_OVERLAP_S = 1.5
"""So much at an offset is too little to choose it, and enough to doubt another."""
_MIN_HALF_WIDTH_S = 0.2
_ALIKE = 0.99
"""Correlation of a mesh and a radar at best; nearer to 1, differences would mean too much."""
_STILL_MPS = 1e-6
_MOVES = "a recording in which somebody moves"


@dataclass(frozen=True, eq=False)
class Alignment:
    """Offset of a radar's clock, and how well all the others fit that were tried."""

    offset_s: float  # the best one, between two of the tried
    confidence: float
    """That this is it rather than the next best, from 0 to 1; 0.5 if they are alike."""
    offsets_s: Floats  # (N,) tried
    correlation: Floats  # (N,) of the two maps, 0 to 1; time without an overlap counts as 0
    other_s: float | None  # next best, beyond the peak; None if there is nothing else
    peak: float  # correlation at the best
    end: Literal["", "search", "overlap"]
    """What ends at the best, which may lie beyond: the search, or an overlap of 3 s."""

    @property
    def problem(self) -> str:
        """Reason not to trust the offset; empty if it is clear."""
        if self.peak <= 0:
            return "The mesh and the radar have nothing in common at any offset."
        if self.end:
            where = f"The mesh and the radar fit best at {self.offset_s:+.2f} s, where"
            if self.end == "search":
                return f"{where} the search ends. Search farther."
            return f"{where} they overlap by {_MIN_OVERLAP_S:g} s. Take longer recordings."
        if self.confidence >= MIN_CONFIDENCE:
            return ""
        return (
            f"No offset stands out: {self.offset_s:+.2f} s and {self.other_s:+.2f} s fit nearly"
            " alike. The motion repeats itself, or is not the same in both."
        )

    def checked(self) -> Alignment:
        """Return the alignment itself; Sd2Error if there is no clear peak."""
        if self.problem:
            sentence, _, more = self.problem.rstrip(".").partition(". ")
            raise Sd2Error(sentence, "one clear peak", more or "Align by hand")
        return self


def align(
    synthetic: DopplerMap, radar: DopplerMap, *, around_s: float = 0.0, within_s: float = WITHIN_S
) -> Alignment:
    """Find what to add to a radar's times for its map to fit a synthetic one.

    Two series of either map are compared: its mean velocity per frame, and its motion, the root
    of energy times velocity squared, in which noise adds what is constant and no sign is needed;
    a map with echoes on one side of 0 m/s only has motion alone. Where n independent moments
    overlap and the series correlate with r₁ and r₂ (0 if negative), that both show one motion is
    likelier than that they do not by −n/2 · log((1 − r₁²)(1 − r₂²)). The offset is where this
    is greatest, of those with an overlap of 3 s. Offsets beyond that peak, with an overlap of
    1.5 s, have less by d: in all, or per moment times the moments of the shorter overlap,
    whichever is less. The least 1 / (1 + exp(−d)) is the confidence.

    Parameters
    ----------
    synthetic : DopplerMap
        Map of the mesh.
    radar : DopplerMap
        Map of the radar, on its own clock.
    around_s, within_s : float
        Offsets are tried up to ``within_s`` from ``around_s``, two seconds at least.

    Raises
    ------
    Sd2Error
        When nothing moves in a map, or they cannot overlap by three seconds. That no offset is
        clear is no error until :meth:`Alignment.checked`.

    Examples
    --------
    >>> import numpy as np
    >>> import sd2core as sd2
    >>> from sd2core.doppler.alignment import align
    >>> values = np.random.default_rng(0).random((32, 300), dtype=np.float32)
    >>> times = sd2.Timebase.regular(frames=300, frames_per_s=30)
    >>> seen = sd2.DopplerMap(values, sd2.VelocityAxis(), times, kind="synthetic")
    >>> align(seen, seen.shifted(-1.2)).checked().offset_s
    1.2
    """
    if within_s not in RADAR_SEARCH_S or not math.isfinite(within_s + around_s):
        raise Sd2Error(
            f"The search goes {within_s:g} s from {around_s:g} s",
            f"{RADAR_SEARCH_S.low:g} s or more",
        )
    (ours, start_s), (theirs, their_start_s) = _series(synthetic), _series(radar)
    for name, values in (("map of the mesh", ours), ("radar's map", theirs)):
        if np.ptp(values, axis=1).max() < _STILL_MPS:
            raise Sd2Error(f"Nothing moves in the {name}", _MOVES)
    # A shift of so many steps is an offset of 0.
    unmoved = (their_start_s - start_s) / _STEP_S
    low, high = (unmoved + (around_s + end_s) / _STEP_S for end_s in (-within_s, within_s))
    least, rival = (math.ceil(one / _STEP_S) for one in (_MIN_OVERLAP_S, _RIVAL_OVERLAP_S))
    shifts = np.arange(
        max(math.ceil(low), rival - theirs.shape[1]),
        min(math.floor(high), ours.shape[1] - rival) + 1,
    )
    longest = min(ours.shape[1], theirs.shape[1])
    steps = np.minimum(ours.shape[1], theirs.shape[1] + shifts) - np.maximum(0, shifts)
    may_be = np.flatnonzero(steps >= least)
    if len(may_be) < 3:
        raise Sd2Error(
            f"The mesh and the radar do not overlap by {_MIN_OVERLAP_S:g} s at offsets up to"
            f" {within_s:g} s from {around_s:g} s",
            "two recordings of the same time",
            "Take longer recordings" if longest < least else "Search farther",
        )
    evidence = np.array([_evidence(ours, theirs, int(shift)) for shift in shifts])
    offsets_s = (shifts - unmoved) * _STEP_S
    return _best_of(offsets_s, evidence, _moments(steps), _moments(longest), may_be)


def _best_of(
    offsets_s: Floats,
    evidence: Floats,
    moments: Floats,
    longest: float,
    may_be: NDArray[np.int64],
) -> Alignment:
    """Alignment from evidence and overlap at each offset; ``longest`` is the longest overlap.

    ``may_be`` are those of the offsets that can be chosen.
    """
    best = int(may_be[evidence[may_be].argmax()])
    # In all, and over the time that both have: of a motion that repeats itself the longest overlap
    # explains most, and tells nothing.
    rates = evidence / moments
    shared = np.minimum(moments, moments[best]) * (rates[best] - rates)
    margins = np.minimum(evidence[best] - evidence, shared)
    margins[slice(*_own_width(evidence, best))] = np.inf
    other = int(margins.argmin())
    end: Literal["", "search", "overlap"] = ""
    if best in (may_be[0], may_be[-1]):
        end = "search" if best in (0, len(evidence) - 1) else "overlap"
    offset_s = float(offsets_s[best])
    if not end:
        before, here, after = evidence[best - 1 : best + 2]
        bend = before - 2.0 * here + after
        offset_s += _STEP_S * 0.5 * (before - after) / bend if bend < 0 else 0.0
    correlation = np.sqrt(1.0 - np.exp(-2.0 * evidence / longest))
    return Alignment(
        offset_s=round(float(offset_s), 3) + 0.0,  # not -0.0
        confidence=float(1.0 / (1.0 + np.exp(-margins[other]))),
        offsets_s=offsets_s,
        correlation=correlation,
        peak=float(correlation[best]),
        other_s=round(float(offsets_s[other]), 3) if np.isfinite(margins[other]) else None,
        end=end,
    )


def _series(doppler: DopplerMap) -> tuple[Floats, float]:
    """Mean velocity and motion in even steps, (2, N), smoothed; and the start."""
    from scipy.ndimage import gaussian_filter1d

    values = doppler.values.astype(np.float64)
    if doppler.present is not None:
        values *= doppler.present
    velocity_mps, total = doppler.axis.centres_mps, values.sum(axis=0)
    # In a frame without an echo nothing moves. In one with noise alone the share has no end of
    # motion, so motion is of the energy itself.
    share = np.divide(values, total, out=np.zeros_like(values), where=total > 0)
    even = _in_steps(doppler.times_s, np.stack([velocity_mps @ share, velocity_mps**2 @ values]))
    even[1] = np.sqrt(even[1])
    approaching = share[velocity_mps > 0].sum() / max(share.sum(), 1.0)
    if not _ONE_SIDED <= approaching <= 1.0 - _ONE_SIDED:
        even[0] = 0.0  # coming and going may look alike, and a mean be that of speeds
    smooth = gaussian_filter1d(even, _SMOOTH_S / _STEP_S, mode="nearest")
    return smooth, doppler.timebase.start_s


def _in_steps(times_s: Floats, series: Floats) -> Floats:
    """Means over even steps around times from the first on, of lines between the frames."""
    if len(times_s) < 2:
        return series
    middles_s = np.arange(times_s[0], times_s[-1] + 1e-9, _STEP_S)
    edges_s = np.append(middles_s - 0.5 * _STEP_S, middles_s[-1] + 0.5 * _STEP_S)
    fine_s = np.unique(np.concatenate([times_s, edges_s]))
    steps = []
    for row in series:
        line = np.interp(fine_s, times_s, row)
        area = np.append(0.0, np.cumsum(0.5 * (line[1:] + line[:-1]) * np.diff(fine_s)))
        steps.append(np.diff(area[np.searchsorted(fine_s, edges_s)]) / _STEP_S)
    return np.stack(steps)


def _evidence(ours: Floats, theirs: Floats, shift: int) -> float:
    """Log-likelihood that two series are of one motion, over that of two."""
    begin, end = max(0, shift), min(ours.shape[1], theirs.shape[1] + shift)
    one, other = (
        part - part.mean(axis=1, keepdims=True)
        for part in (ours[:, begin:end], theirs[:, begin - shift : end - shift])
    )
    norm = np.sqrt((one**2).sum(axis=1) * (other**2).sum(axis=1))
    agreed = np.divide((one * other).sum(axis=1), norm, out=np.zeros(2), where=norm > 0)
    agreed = _ALIKE * agreed.clip(0.0, 1.0)
    return float(-0.5 * _moments(end - begin) * np.log(1.0 - agreed**2).sum())


def _moments(steps: Any) -> Any:
    """Numbers of independent values in so many steps."""
    return steps * _STEP_S / _MOMENT_S


def _own_width(evidence: Floats, best: int) -> tuple[int, int]:
    """Range of the peak: down on both sides until the curve rises again."""
    least = round(_MIN_HALF_WIDTH_S / _STEP_S)
    begin, end = max(best - least, 0), min(best + least + 1, len(evidence))
    while begin > 0 and 0 < evidence[begin - 1] <= evidence[begin]:
        begin -= 1
    while end < len(evidence) and 0 < evidence[end] <= evidence[end - 1]:
        end += 1
    return begin, end
