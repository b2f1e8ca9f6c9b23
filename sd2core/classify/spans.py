"""Spans of predicted gestures, offered like other suggestions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.labels.per_frame import BACKGROUND
from sd2core.labels.spans import Span
from sd2core.labels.suggest import TRACK, frame_ends_s, stretches
from sd2core.mesh.presence import checked
from sd2core.options.suggesting import PredictedSpans
from sd2core.timebase import Timebase

_ROUNDING_S = 1e-6


def predicted_spans(
    probabilities: NDArray[np.floating],
    timebase: Timebase,
    classes: Sequence[str],
    options: PredictedSpans | None = None,
    *,
    present: NDArray[np.bool_] | None = None,
) -> tuple[Span, ...]:
    """Find the runs of frames whose most probable class is a gesture.

    Parameters
    ----------
    probabilities : float array, shape (frames, classes)
        Rows add up to 1.
    classes : sequence of str
        Names of the columns; they become labels.
    present : bool array, shape (frames,), optional
        False in frames without a person: no span reaches across them, nor across a
        pause of the recording.

    Returns
    -------
    tuple of Span
        Of origin ``"suggestion"``; they do not overlap. The confidence is the mean
        probability of the span's class over its frames.
    """
    options = options or PredictedSpans()
    least = options.min_confidence or 0.0
    values = _checked(probabilities, len(timebase), len(classes))
    mask = np.ones(len(timebase), bool) if present is None else checked(present, len(timebase))
    first, last = stretches(timebase, mask)
    starts_s, ends_s = timebase.times_s, frame_ends_s(timebase, last)
    winner = np.where(mask, values.argmax(axis=1), -1)
    runs = [
        (start, stop, number)
        for start, stop, number in _runs(winner, first)
        if number >= 0 and classes[number] != BACKGROUND
    ]
    joined: list[tuple[int, int, int]] = []
    for start, stop, number in runs:
        # What is merged across is short, so few runs are looked at.
        for place in range(len(joined) - 1, -1, -1):
            begin, end, same = joined[place]
            gap_s = starts_s[start] - ends_s[end - 1]
            if gap_s > options.merge_gap_s + _ROUNDING_S or first[start] != first[end - 1]:
                joined.append((start, stop, number))
                break
            if same == number:
                joined[place:] = [(begin, stop, number)]
                break
        else:
            joined.append((start, stop, number))
    spans: list[Span] = []
    for start, stop, number in joined:
        start_s, end_s = float(starts_s[start]), float(ends_s[stop - 1])
        sure = min(float(values[start:stop, number].mean()), 1.0)
        if end_s - start_s < options.min_duration_s - _ROUNDING_S or sure < least:
            continue
        spans.append(
            Span(
                id=1 + len(spans),
                track=TRACK,
                start_s=start_s,
                end_s=end_s,
                label=classes[number],
                note=f"classified as {classes[number]}, {sure:.0%} on average",
                confidence=sure,
                origin="suggestion",
            )
        )
    return tuple(spans)


def _runs(winner: NDArray[np.int64], first: NDArray[np.int64]) -> list[tuple[int, int, int]]:
    """Find half-open runs of frames of one class within one clip."""
    begins = np.ones(len(winner), bool)
    begins[1:] = (winner[1:] != winner[:-1]) | (first[1:] != first[:-1])
    starts = np.flatnonzero(begins)
    stops = np.append(starts[1:], len(winner))
    return [
        (int(start), int(stop), int(winner[start]))
        for start, stop in zip(starts, stops, strict=True)
    ]


def _checked(probabilities: NDArray[np.floating], frames: int, classes: int) -> NDArray[np.float64]:
    values = np.asarray(probabilities, np.float64)
    if values.shape != (frames, classes):
        raise Sd2Error(
            f"The probabilities are of shape {values.shape}",
            f"({frames} frames, {classes} classes)",
        )
    if not (np.isfinite(values).all() and (values >= 0).all()):
        raise Sd2Error("The probabilities hold negative or no numbers", "numbers from 0 to 1")
    return values
