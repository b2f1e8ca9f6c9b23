"""Candidate spans of motion, from the energy of a Doppler map.

Every bin is measured against its own quiet level and against the sidelobe of what is at
zero velocity, so that what stands still counts as quiet in all bins, also while its
strength changes. Two thresholds (hysteresis, as for the edges of J. Canny, "A computational
approach to edge detection", IEEE TPAMI 8(6), 1986) separate motion from it. For the choice
of values see docs/decisions/0032 and 0051.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.labels.spans import Span
from sd2core.maps import DopplerMap
from sd2core.mesh.presence import Presence, runs
from sd2core.options.suggesting import SuggestOptions
from sd2core.plausibility.clock import ROUNDING_S
from sd2core.timebase import Timebase

TRACK = "Suggestions"
"""Name of the track that suggestions stand on."""
LABEL = "gesture"
"""Label of suggestions: energy shows that something moves, not what."""

_QUIET_SHARE = 0.25
"""Share of the frames in which a bin does not exceed its quiet level."""
_FLOOR = 1e-3
"""Share of the strongest frame below which nothing is told apart from nothing."""
_HIGHEST_SIDELOBE = 0.0472
"""Of the main lobe's power: the rectangular window's, sinc²(1.43); other windows' are lower."""
_SMOOTHING_S = 0.1
_PAUSE_FRAMES, _PAUSE_S = 3.0, 0.2
"""A step of more typical frame durations and of more time is a pause in the recording."""
_ROUNDING_S = 1e-6


def motion_energy_db(doppler: DopplerMap) -> NDArray[np.float64]:
    """Compute the energy of every frame over the map's own quiet level, in dB, (frames,).

    A bin's quiet level is what it does not exceed in a quarter of the frames, but at
    least 30 dB below the strongest frame, and in each frame no less than the sidelobe of
    what is at zero velocity then. A frame's energy is the mean of its bins in units of
    their quiet levels; its own quiet level, the same quarter, is 0 dB, and so is what lies
    below. Emptied and unseen bins, and those that are always zero, are left out. Energy is
    averaged over a tenth of a second, never across a pause or a gap without a person.

    From 0 on; NaN in frames without a person. Raises Sd2Error when the map holds NaN, infinity or
    negative values.
    """
    values = doppler.values.astype(np.float64)  # (bins, T)
    good = np.isfinite(values) & (values >= 0)
    if not good.all():
        bin_, frame = np.argwhere(~good)[0]
        raise Sd2Error(
            f"The Doppler map holds {values[bin_, frame]} in bin {bin_} of frame {frame}",
            "finite values from 0 on",
        )
    present = doppler.present_mask
    energy_db = np.where(present, 0.0, np.nan)
    seen = _smoothed(values, doppler.timebase, present)[:, present]
    known_bins = np.asarray(seen.any(axis=1))  # (bins,)
    known_bins[[*doppler.null_bins, *doppler.unseen_bins]] = False
    if not known_bins.any():
        return energy_db
    seen = seen[known_bins] / seen[known_bins].sum(axis=0).max()
    quiet = np.maximum(np.quantile(seen, _QUIET_SHARE, axis=1), _FLOOR / len(seen))
    # Zero velocity is in the middle of a bin, or between two.
    still = np.abs(doppler.axis.centres_mps[known_bins]) < 0.75 * doppler.axis.bin_width_mps
    energy = (seen / np.maximum(quiet[:, None], _leaked(seen, still))).mean(axis=0)
    energy /= max(float(np.quantile(energy, _QUIET_SHARE)), 1.0)
    energy_db[present] = 10.0 * np.log10(np.maximum(energy, 1.0))
    return energy_db


def _leaked(seen: NDArray[np.float64], still: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Sidelobes of what is in the bins at zero velocity, (bins, T)."""
    if not seen[still].any():
        return np.zeros_like(seen)
    echo = seen[still].mean(axis=0)
    # The strongest frames, with three quarters of the energy: where an echo is weak, noise
    # hides its sidelobes.
    falling = np.sort(echo)[::-1]
    held = np.cumsum(falling)
    strong = echo >= falling[np.searchsorted(held, (1.0 - _QUIET_SHARE) * held[-1])]
    shares = np.quantile(seen[:, strong] / echo[strong], _QUIET_SHARE, axis=1)
    # More than any sidelobe holds is the main lobe, in which slow motion is as well.
    return np.asarray(np.minimum(shares, _HIGHEST_SIDELOBE)[:, None] * echo)


def suggest_spans(
    doppler: DopplerMap, options: SuggestOptions | None = None, *, label: str = LABEL
) -> tuple[Span, ...]:
    """Find spans in which something moves, in order; edges are those of frames.

    Parameters
    ----------
    doppler : DopplerMap
        Synthetic, denoised, simulated or real. At least a quarter of its frames with a
        person must be quiet: what moves all the time is not told from what never does.
    label : str
        The same for all spans.

    Returns
    -------
    tuple of Span
        Of origin ``"suggestion"``; they do not overlap. The confidence ranks them by the
        share of their peak, in dB, that is above ``high_db``: 0 where a span only just
        reaches it, and below 1 however loud it is. It is no probability. The note says how
        loud the span is.
    """
    options = options or SuggestOptions()
    energy_db = motion_energy_db(doppler)
    first, last = stretches(doppler.timebase, ~np.isnan(energy_db))
    ends_s = frame_ends_s(doppler.timebase, last)
    starts_s = doppler.times_s
    spans: list[tuple[int, int]] = []
    for start, stop in _loud(energy_db, options.low_db, first):
        same = spans and first[spans[-1][1] - 1] == first[start]
        if same and starts_s[start] - ends_s[spans[-1][1] - 1] <= options.merge_gap_s + _ROUNDING_S:
            spans[-1] = (spans[-1][0], stop)
        else:
            spans.append((start, stop))
    peaks_db = [float(np.max(energy_db[start:stop])) for start, stop in spans]
    kept = [
        (frames, peak_db)
        for frames, peak_db in zip(spans, peaks_db, strict=True)
        if peak_db >= options.high_db
        and ends_s[frames[1] - 1] - starts_s[frames[0]] >= options.min_duration_s - _ROUNDING_S
    ]
    wider = _with_margins(
        [frames for frames, _ in kept], doppler.timebase, ends_s, first, last, options
    )
    return tuple(
        Span(
            id=number,
            track=TRACK,
            start_s=float(starts_s[start]),
            end_s=float(ends_s[stop - 1]),
            label=label,
            note=f"up to {peak_db:.0f} dB over the quiet level",
            confidence=1.0 - options.high_db / peak_db,
            origin="suggestion",
        )
        for number, ((start, stop), (_, peak_db)) in enumerate(
            zip(wider, kept, strict=True), start=1
        )
    )


def stretches(
    timebase: Timebase, present: NDArray[np.bool_]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return first and last frame of the uninterrupted part that each frame is in.

    Parts end at pauses of the recording and where no person is present.
    """
    presence = Presence.of(present, len(timebase))
    longest_s = max(_PAUSE_FRAMES * timebase.frame_duration_s, _PAUSE_S)
    begins = presence.first == np.arange(len(timebase))
    begins[1:] |= np.diff(timebase.times_s) > longest_s + ROUNDING_S
    starts = np.flatnonzero(begins)
    stretch = np.cumsum(begins) - 1
    return starts[stretch], np.append(starts[1:], len(timebase))[stretch] - 1


def frame_ends_s(timebase: Timebase, last: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return the end of each frame, (T,): the next one, or its usual duration before a pause."""
    ends_s, usual_s = timebase.edges_s[1:], timebase.times_s + timebase.frame_duration_s
    before_a_break = last == np.arange(len(timebase))
    return np.where(before_a_break, np.minimum(ends_s, usual_s), ends_s)


def _smoothed(
    values: NDArray[np.float64], timebase: Timebase, present: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Mean over a tenth of a second within the same stretch, (bins, T)."""
    first, last = stretches(timebase, present)
    times_s, half_s = timebase.times_s, 0.5 * _SMOOTHING_S + _ROUNDING_S
    start = np.maximum(np.searchsorted(times_s, times_s - half_s), first)
    stop = np.minimum(np.searchsorted(times_s, times_s + half_s, side="right"), last + 1)
    sums = np.zeros((values.shape[0], values.shape[1] + 1))
    np.cumsum(values, axis=1, out=sums[:, 1:])
    # Differences of sums may fall below 0 by rounding.
    return np.maximum(sums[:, stop] - sums[:, start], 0.0) / (stop - start)


def _loud(
    energy_db: NDArray[np.float64], low_db: float, first: NDArray[np.int64]
) -> list[tuple[int, int]]:
    """Half-open runs of frames from the low threshold on, each within one stretch."""
    loud_runs: list[tuple[int, int]] = []
    with np.errstate(invalid="ignore"):
        loud = energy_db >= low_db
    for start, stop in runs(loud):
        cuts = [at for at in range(start + 1, stop) if first[at] == at]
        loud_runs += zip([start, *cuts], [*cuts, stop], strict=True)
    return loud_runs


def _with_margins(
    spans: list[tuple[int, int]],
    timebase: Timebase,
    ends_s: NDArray[np.float64],
    first: NDArray[np.int64],
    last: NDArray[np.int64],
    options: SuggestOptions,
) -> list[tuple[int, int]]:
    """Widen runs of frames; a third of the quiet between neighbours stays."""
    if not spans:
        return []
    times_s = timebase.times_s
    gaps_s = [times_s[after[0]] - ends_s[one[1] - 1] for one, after in pairwise(spans)]
    room_s = [math.inf, *(gap_s / 3 for gap_s in gaps_s), math.inf]
    wider = []
    for (start, stop), before_s, after_s in zip(spans, room_s[:-1], room_s[1:], strict=True):
        from_s = times_s[start] - min(options.margin_s, before_s) - _ROUNDING_S
        to_s = ends_s[stop - 1] + min(options.margin_s + options.hold_s, after_s) + _ROUNDING_S
        begin = max(int(np.searchsorted(times_s, from_s)), int(first[start]))
        end = min(int(np.searchsorted(ends_s, to_s, side="right")), int(last[stop - 1]) + 1)
        wider.append((begin, end))
    return wider
