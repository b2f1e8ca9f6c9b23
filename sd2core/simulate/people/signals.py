"""Smooth random signals, of which random motion is put together."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sd2core.body.rotations import Floats
from sd2core.simulate.limbs import minimum_jerk

_WAVES = 9


class Moves(NamedTuple):
    """Moves from each pose to the next."""

    start_s: Floats
    length_s: Floats
    skew: Floats  # Place in the move where the hand is fastest: 1 in its middle, below 1 earlier.


def smooth_share(phase: Floats, skew: Floats) -> Floats:
    """Share of the way at a share of the time: a quintic of warped time, 0 and 1 outside."""
    return minimum_jerk(np.clip(phase, 0.0, 1.0) ** skew)


def follow(times_s: Floats, moves: Moves, poses: Floats) -> Floats:
    """Parameters through time: the first pose plus every move so far; moves may overlap.

    n moves and the poses, (n + 1, K), give an array of shape (T, K).
    """
    phase = (times_s[:, None] - moves.start_s) / moves.length_s
    return np.asarray(poses[0] + smooth_share(phase, moves.skew) @ np.diff(poses, axis=0))


def wander(rng: np.random.Generator, times_s: Floats, cutoff_hz: float, count: int) -> Floats:
    """Smooth noise of mean 0 and standard deviation 1, (T, count).

    A sum of sines whose frequencies spread evenly below ``cutoff_hz``, the slow
    ones larger.

    Parameters
    ----------
    rng : Generator
    times_s : float64 array, shape (T,)
    cutoff_hz : float
    count : int
        Number of independent signals.
    """
    frequency = cutoff_hz * rng.uniform(0.05, 1.0, (_WAVES, count))
    phase = rng.uniform(0.0, 2.0 * np.pi, (_WAVES, count))
    size = rng.standard_normal((_WAVES, count)) / (0.3 + frequency / cutoff_hz)
    size *= np.sqrt(2.0 / (size**2).sum(axis=0))
    angle = 2.0 * np.pi * frequency * times_s[:, None, None] + phase
    return np.asarray((size * np.sin(angle)).sum(axis=1))


def envelope(times_s: Floats, start_s: float, end_s: float, ramp_s: float) -> Floats:
    """1 from ``start_s`` to ``end_s``, 0 outside, with smooth ramps inside, (T,).

    Parameters
    ----------
    times_s : float64 array, shape (T,)
    start_s, end_s : float
    ramp_s : float
        Length of each ramp.
    """
    one = np.ones(())
    rise = smooth_share((times_s - start_s) / ramp_s, one)
    fall = smooth_share((end_s - times_s) / ramp_s, one)
    return np.asarray(rise * fall)
