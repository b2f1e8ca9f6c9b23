"""Measures of a comparison: distances, velocities along the line of sight, jitter.

Pure functions of arrays. Velocities are what the Doppler chain takes them to be: the
exact change of range over the central difference, one-sided at the two ends.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sd2core.mesh.presence import Presence
from sd2core.scattering.velocity import moments, radial_velocity

Floats = NDArray[np.float64]

EDGE_FRAMES = 5
"""Frames at each end of a clip that count as its edge."""


def line_of_sight_velocity(
    positions_m: NDArray[Any],
    times_s: Floats,
    sensor_m: ArrayLike = (0.0, 0.0, 0.0),
    presence: Presence | None = None,
) -> Floats:
    """Velocity towards a sensor.

    Parameters
    ----------
    positions_m : float array, shape (T, N, 3)
        T of 2 at least.
    times_s : float64 array, shape (T,)
    sensor_m : array_like, shape (3,)
    presence : Presence, optional
        Nothing is measured from one stretch with a person to another.

    Returns
    -------
    float64 array, shape (T, N)
        m/s, positive when approaching; 0 where nothing can be measured.
    """
    stencil = moments(times_s, np.arange(len(times_s)), 1, presence)
    paths = np.ascontiguousarray(np.swapaxes(positions_m, 1, 2), dtype=np.float64)  # (T, 3, N)
    velocity: Floats = radial_velocity(
        paths[stencil.before[:, 0]], paths[stencil.after[:, 0]], sensor_m, stencil.duration_s
    )
    return velocity


def rms(values: NDArray[Any]) -> float:
    """Root of the mean square; 0 of nothing."""
    return float(np.sqrt(np.mean(np.square(values, dtype=np.float64)))) if np.size(values) else 0.0


def correlation(values: NDArray[Any], truth: NDArray[Any]) -> float:
    """Pearson's correlation over all elements; 1 for equals, NaN where either is constant."""
    if not np.size(values):
        return float("nan")
    a, b = (np.asarray(one, np.float64).ravel() for one in (values, truth))
    if np.array_equal(a, b):
        return 1.0
    a, b = a - a.mean(), b - b.mean()
    norm = float(np.sqrt((a @ a) * (b @ b)))
    return float(a @ b) / norm if norm > 0 else float("nan")


def peak_kept(values: NDArray[Any], truth: NDArray[Any]) -> float:
    """Largest magnitude of one over that of the other; NaN when the truth has none."""
    peak = float(np.abs(truth).max(initial=0.0))
    return float(np.abs(values).max(initial=0.0)) / peak if peak > 0 else float("nan")


def speed_mps(positions_m: NDArray[Any], times_s: Floats) -> Floats:
    """Magnitude of the velocity, (T, N) for positions (T, N, 3)."""
    stencil = moments(times_s, np.arange(len(times_s)), 1)
    step = positions_m[stencil.after[:, 0]] - positions_m[stencil.before[:, 0]]
    return np.asarray(np.linalg.norm(step, axis=-1) / stencil.duration_s)


def jitter(positions_m: NDArray[Any], times_s: Floats, presence: Presence | None = None) -> Floats:
    """RMS over time of the third difference of the path, per joint.

    Parameters
    ----------
    positions_m : float array, shape (T, N, 3)
    times_s : float64 array, shape (T,)
    presence : Presence, optional
        No difference reaches from one stretch with a person to another.

    Returns
    -------
    float64 array, shape (N,)
        Metres per frame cubed, times the cube of the typical frame rate: m/s³ of
        evenly timed frames. 0 for fewer than four frames.
    """
    third = np.diff(positions_m, 3, axis=0) / np.median(np.diff(times_s)) ** 3
    if presence is not None:
        third = third[(presence.first[3:] == presence.first[:-3]) & presence.there[3:]]
    if not len(third):
        return np.zeros(positions_m.shape[1])
    return np.asarray(np.sqrt((third**2).sum(axis=-1).mean(axis=0)))


def edge_ratio(errors: NDArray[Any], edge: int = EDGE_FRAMES) -> float:
    """RMS error of the first and last frames over that of the frames between.

    Parameters
    ----------
    errors : array, shape (T, ...)

    Returns
    -------
    float
        NaN when there is no frame between; 1 when there is no error anywhere.
    """
    if len(errors) <= 2 * edge:
        return float("nan")
    ends = rms(np.concatenate([errors[:edge], errors[-edge:]]))
    middle = rms(errors[edge:-edge])
    if middle == 0:
        return 1.0 if ends == 0 else float("inf")
    return ends / middle


def coverage(errors: NDArray[Any], sigma: NDArray[Any]) -> float:
    """Share of errors no larger than their standard deviation (0.683 when it is right)."""
    known = np.isfinite(errors) & np.isfinite(sigma)
    if not known.any():
        return float("nan")
    return float((np.abs(errors[known]) <= sigma[known]).mean())
