"""A radar's place beside a skeleton's camera, and its clock, from what both saw.

Range does not change when the scene turns about the radar, so what its Doppler tells of its
mounting is where it stands. Its distance in the direction of view hardly changes velocities and is
left at the camera's.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.optimize import minimize

Floats = NDArray[np.float64]

_FARTHEST_M = (0.6, 1.2)
"""Right or left of the camera, above or below it."""
_LATEST_S = 0.2
_MIN_CORRELATION = 0.3
"""Below it motion and radar have too little in common to tell anything."""
_STARTS_M = ((0.0, 0.0), (0.2, 0.4), (-0.2, 0.4))


@dataclass(frozen=True)
class RadarPlace:
    """Place of a radar, and the offset of its clock."""

    position_m: tuple[float, float, float] = (0.0, 0.0, 0.0)  # in the camera frame
    offset_s: float = 0.0
    """What the radar shows at a time is the motion that much later."""
    correlation: float | None = None  # of mean velocities there; None: it was given
    correlation_before: float | None = None  # at the camera, without an offset


@dataclass(frozen=True, eq=False)
class Seen:
    """One stretch of motion, and the mean velocity that the radar measured of it."""

    times_s: Floats  # (T,)
    points_m: Floats  # (T, P, 3) evenly from the body's surface, in the camera frame
    velocity_mps: Floats  # (T,); NaN in frames without an echo


def estimate_place(seen: Sequence[Seen]) -> RadarPlace:
    """Find the place and the clock with which motion and radar agree best.

    They agree as their mean velocities per frame correlate. Where they hardly do, the radar is
    taken to be at the camera.
    """
    before = _correlation(seen, np.zeros(3))
    steps = np.vstack([np.zeros(3), np.diag([0.1, 0.15, 0.03])])
    best = min(
        (
            minimize(
                lambda place: -_correlation(seen, place),
                [*start_m, 0.0],
                method="Nelder-Mead",
                options={
                    "xatol": 2e-3,
                    "fatol": 1e-5,
                    "initial_simplex": np.add(steps, (*start_m, 0.0)),
                },
            )
            for start_m in _STARTS_M
        ),
        key=lambda minimum: float(minimum.fun),
    )
    if not -best.fun >= _MIN_CORRELATION:
        return RadarPlace(correlation=before, correlation_before=before)
    x, y, offset_s = (round(float(value), 3) for value in best.x)
    return RadarPlace((x, y, 0.0), offset_s, -float(best.fun), before)


def _correlation(seen: Sequence[Seen], place: Floats) -> float:
    """Correlation of mean velocities for a radar at (x, y) with an offset; −1 if out of reach."""
    if (np.abs(place) > [*_FARTHEST_M, _LATEST_S]).any():
        return -1.0
    position_m = np.array([place[0], place[1], 0.0])
    body_mps, truth = [], []
    for one in seen:
        if len(one.times_s) < 4:
            continue
        range_m = np.linalg.norm(one.points_m - position_m, axis=-1).mean(axis=1)
        # As a synthetic map takes it: the change of range from the frame before to the one after.
        step_s = float(np.diff(one.times_s).mean())
        moved_s = one.times_s + place[2]
        curve = CubicSpline(one.times_s, range_m)
        known = np.isfinite(one.velocity_mps)
        known &= (moved_s - step_s >= one.times_s[0]) & (moved_s + step_s <= one.times_s[-1])
        moved_s = moved_s[known]
        body_mps.append((curve(moved_s - step_s) - curve(moved_s + step_s)) / (2.0 * step_s))
        truth.append(one.velocity_mps[known])
    if sum(map(len, body_mps)) < 3:
        return -1.0
    both = np.concatenate(body_mps), np.concatenate(truth)
    if min(float(np.ptp(values)) for values in both) < 1e-9:
        return -1.0
    return float(np.corrcoef(*both)[0, 1])
