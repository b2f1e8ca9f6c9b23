"""Samples over time as lines of a plot; no widget."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sd2core.imu.signals import InertialSignals

Line = tuple[NDArray[np.float64], NDArray[np.float64]]
"""Pixels and values of the points of a line, (n,) each."""

_SAMPLES_PER_COLUMN = 2.0
"""Beyond as many only the least and the largest of every pixel column are drawn."""
_STEPS = (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0)
_CLOSE = 0.15
"""Share of a lane's extent within which nothing but zero is marked."""
_ROOM = 0.06
"""Room above and below the lines, as a share of their extent."""


def curve_lines(
    times_s: NDArray[np.float64],
    values: NDArray[np.float64],
    start_s: float,
    end_s: float,
    width_px: float,
) -> list[list[Line]]:
    """Lines of every axis of values (N, 3) from ``start_s`` to ``end_s``, and just beyond.

    Pixels count from 0 at ``start_s`` to ``width_px`` at ``end_s``. Nothing is drawn through
    samples that are not known. Where many share a pixel column, the line goes through their
    extremes, so that no peak is lost.
    """
    first = max(int(np.searchsorted(times_s, start_s)) - 1, 0)
    last = min(int(np.searchsorted(times_s, end_s, side="right")) + 1, len(times_s))
    x_px = (times_s[first:last] - start_s) * (width_px / (end_s - start_s))
    values = values[first:last]
    if len(values) > _SAMPLES_PER_COLUMN * width_px:
        column = np.floor(x_px)
        starts = np.flatnonzero(np.diff(column, prepend=column[0] - 1))
        least, largest = (
            extreme.reduceat(values, starts, axis=0) for extreme in (np.fmin, np.fmax)
        )
        values = np.stack([least, largest], axis=1).reshape(-1, values.shape[1])
        x_px = np.repeat(column[starts] + 0.5, 2)
    return [_unbroken(x_px, axis) for axis in values.T]


def _unbroken(x_px: NDArray[np.float64], values: NDArray[np.float64]) -> list[Line]:
    """Lines between what is not known."""
    known = np.concatenate([[False], np.isfinite(values), [False]])
    edges = np.flatnonzero(known[1:] != known[:-1]).reshape(-1, 2)
    return [(x_px[start:stop], values[start:stop]) for start, stop in edges.tolist()]


def extent(signals: list[InertialSignals], name: str) -> tuple[float, float]:
    """Limits of a lane that holds all values of a quantity, and zero."""
    found = [getattr(one, name) for one in signals]
    known = np.concatenate([values[np.isfinite(values)] for values in found] or [np.zeros(0)])
    low, high = float(known.min(initial=0.0)), float(known.max(initial=0.0))
    room = _ROOM * (high - low) or 1.0
    if math.isinf(room):  # of a damaged file
        return -1.0, 1.0
    return low - room, high + room


def scale_marks(low: float, high: float) -> tuple[float, ...]:
    """Round numbers near the limits of a lane to be written at its scale, the upper one first.

    Zero in place of one that is close to it.
    """
    near = _CLOSE * (high - low)
    marks = (_rounded_inwards(value) if abs(value) > near else 0.0 for value in (high, low))
    return tuple(dict.fromkeys(marks))


def _rounded_inwards(value: float) -> float:
    """Largest of the usual steps times a power of ten that is not beyond a value."""
    power = 10.0 ** math.floor(math.log10(abs(value)))
    step = max(step for step in _STEPS if step * power <= abs(value) * (1.0 + 1e-9))
    return math.copysign(step * power, value)
