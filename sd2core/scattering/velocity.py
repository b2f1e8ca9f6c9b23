"""Radial velocity from the exact change of range."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sd2core.mesh.presence import Presence


def radial_velocity(
    before: NDArray[Any], after: NDArray[Any], sensor: ArrayLike, duration_s: ArrayLike
) -> NDArray[Any]:
    """Mean radial velocity of points that moved from ``before`` to ``after``.

    With a = before − s and b = after − s the change of range is
    |b| − |a| = Δp·(a + b) / (|a| + |b|): exact, and free of the cancellation
    that spoils |b| − |a| for a far sensor in single precision.

    Parameters
    ----------
    before, after : float array, shape (..., 3, V)
        Metres. Take the origin near the points.
    sensor : array_like, shape (3,)
        In the same frame.
    duration_s : array_like, shape broadcasting with (..., V)
        Time between the two; 0 gives velocity 0.

    Returns
    -------
    float array, shape (..., V)
        m/s in the precision of ``before``; positive when approaching.
    """
    precision = before.dtype.type
    place = np.asarray(sensor, dtype=precision)[:, None]
    a, b = before - place, after - place
    step, middle = after - before, a + b
    ranges = np.sqrt(_dot(a, a)) + np.sqrt(_dot(b, b))
    # Both ends on the sensor: nothing moved, and the velocity is 0 instead of 0/0.
    ranges = np.maximum(ranges, precision(1e-30))
    duration = np.asarray(duration_s, dtype=precision)
    rate = np.divide(1, duration, out=np.zeros_like(duration), where=duration > 0)
    return -_dot(step, middle) / ranges * rate


def _dot(a: NDArray[Any], b: NDArray[Any]) -> NDArray[Any]:
    product: NDArray[Any] = a[..., 0, :] * b[..., 0, :]
    for axis in (1, 2):
        product = product + a[..., axis, :] * b[..., axis, :]
    return product


@dataclass(frozen=True, eq=False)
class Stencil:
    """Knots of a trajectory between which velocities are measured, shape (n, moments)."""

    before: NDArray[np.int64]
    after: NDArray[np.int64]
    duration_s: NDArray[np.float64]  # 0 where there is nothing to measure


def moments(
    times_s: NDArray[np.float64],
    centres: NDArray[np.int64],
    oversampling: int,
    presence: Presence | None = None,
) -> Stencil:
    """Knots between which the velocities of each frame are measured, on real times.

    The moments of a frame are spread evenly and symmetrically around it. An odd number are
    knots, each measured between its neighbours (one-sided at the two ends of the clip, and
    next to frames without a person); an even number lie midway between two knots, which
    they are measured between.

    Parameters
    ----------
    times_s : float64 array, shape (knots,)
    centres : int64 array, shape (n,)
        Knots of the frames.
    oversampling : int
        Knots per frame, and moments of each.
    presence : Presence, optional
        Of all frames; by default there is a person in every one.

    Returns
    -------
    Stencil
        Shape (n, oversampling). Where a moment lies outside the clip, or outside the frame's
        stretch, both knots are its end, with a duration of 0.
    """
    half, odd = oversampling // 2, oversampling % 2
    begin = np.zeros((len(centres), 1), np.int64)
    end = np.full((len(centres), 1), len(times_s) - 1)
    if presence is not None and not presence.whole:
        frames = centres // oversampling
        begin = (presence.first[frames] * oversampling)[:, None]
        end = (presence.last[frames] * oversampling)[:, None]
    first = centres[:, None] + np.arange(-half, half + odd)
    last = first + 1 - odd
    within = (first >= begin) & (last <= end)
    before = np.clip(np.where(within, first - odd, first), begin, end)
    after = np.clip(np.where(within, last + odd, last), begin, end)
    duration_s = np.where(within, times_s[after] - times_s[before], 0.0)
    return Stencil(before, after, duration_s)
