"""Where to look in every frame, from where the person was seen in some of them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sd2core.body.roi import Floats, Roi
from sd2core.mesh.presence import runs

_CENTRE_S = 0.2
_SIZE_S = 0.5
_ANGLE_S = 0.5


@dataclass(frozen=True, eq=False)
class Sightings:
    """Frames in which the person was looked for.

    Parameters
    ----------
    frames : intp array, shape (N,)
        Ascending.
    rois : float64 array, shape (N, 4)
        Centre x and y, size and angle of the square around the person; NaN where
        the person was not found.
    confidence : float64 array, shape (N,)
    """

    frames: NDArray[np.intp]
    rois: Floats
    confidence: Floats


def roi_numbers(roi: Roi) -> Floats:
    """A row of :attr:`Sightings.rois`."""
    return np.array([roi.centre_x_px, roi.centre_y_px, roi.size_px, roi.angle_rad])


def roi_of(row: Floats) -> Roi | None:
    """The square of such a row; None where it is NaN."""
    if np.isnan(row[0]):
        return None
    return Roi(*(float(number) for number in row))


def roi_path(sightings: Sightings, times_s: Floats) -> Floats:
    """A smooth path of the square through every frame, without lag.

    Parameters
    ----------
    sightings : Sightings
    times_s : float64 array, shape (T,)
        Of all frames.

    Returns
    -------
    float64 array, shape (T, 4)
        Squares as rows, see :func:`roi_of`; NaN where the person was not found in the
        sightings before and after.
    """
    path = np.full((len(times_s), 4), np.nan)
    found = np.isfinite(sightings.rois[:, 0])
    # Stretches of sightings in which the person was never lost.
    for start, stop in runs(found):
        frames = sightings.frames[start:stop]
        times = times_s[frames]
        rois = sightings.rois[start:stop].copy()
        rois[:, 2] = np.log(rois[:, 2])
        rois[:, 3] = np.unwrap(rois[:, 3])
        smooth = np.concatenate(
            [
                smoothed(times, rois[:, :2], _CENTRE_S),
                smoothed(times, rois[:, 2:3], _SIZE_S),
                smoothed(times, rois[:, 3:], _ANGLE_S),
            ],
            axis=1,
        )
        inside = np.arange(frames[0], frames[-1] + 1)
        for number, column in enumerate(smooth.T):
            path[inside, number] = np.interp(times_s[inside], times, column)
        for frame in inside:
            path[frame, 2] = math.exp(path[frame, 2])
            path[frame, 3] = math.remainder(path[frame, 3], math.tau)
    return path


def smoothed(times_s: Floats, values: Floats, sigma_s: float) -> Floats:
    """Smooth values (N, K) by a line fitted around each time with Gaussian weights.

    Straight lines stay as they are, to the very ends; times may be uneven.
    """
    ahead = np.searchsorted(times_s, times_s + 3.0 * sigma_s) - np.arange(len(times_s))
    reach = min(int(ahead.max(initial=0)), len(times_s) - 1)
    rows = np.arange(len(times_s))
    sums = np.zeros((3, len(times_s)))  # of the weights times 1, t and t²
    products = np.zeros((2, *values.shape))
    for step in range(-reach, reach + 1):
        other = np.clip(rows + step, 0, len(rows) - 1)
        t = times_s[other] - times_s
        weights = np.where(rows + step == other, np.exp(-0.5 * (t / sigma_s) ** 2), 0.0)
        for power in range(3):
            sums[power] += weights * t**power
        for power in range(2):
            products[power] += (weights * t**power)[:, None] * values[other]
    spread = sums[0] * sums[2] - sums[1] ** 2
    line = spread > 1e-9 * sums[0] ** 2 * sigma_s**2
    mean = products[0] / sums[0][:, None]
    fitted = (sums[2][:, None] * products[0] - sums[1][:, None] * products[1]) / np.where(
        line, spread, 1.0
    )[:, None]
    return np.where(line[:, None], fitted, mean)
