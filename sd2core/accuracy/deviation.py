"""How far one Doppler map is from another, in units a radar person reads."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sd2core.accuracy.results import Errors, Spread
from sd2core.sensor import VelocityAxis

_MOVING = 0.1
"""Frames with less than this share of the mean frame's energy have no figures of their own."""


def relative_l1(values: NDArray[np.float64], reference: NDArray[np.float64]) -> float:
    """Sum of absolute differences over the sum of the reference.

    0 when both are empty, infinite when only the reference is.
    """
    difference, total = float(np.abs(values - reference).sum()), float(reference.sum())
    if total > 0:
        return difference / total
    return 0.0 if difference == 0 else float("inf")


def errors(
    raw: NDArray[np.float64],
    reference_raw: NDArray[np.float64],
    smooth: NDArray[np.float64],
    reference_smooth: NDArray[np.float64],
    axis: VelocityAxis,
) -> Errors:
    """Compare a map with its reference, before and after smoothing.

    Parameters
    ----------
    raw, reference_raw, smooth, reference_smooth : float64 arrays, shape (bins, n)
        Not negative.

    Returns
    -------
    Errors
        A frame that is empty in the map but not in the reference has peak and
        mean velocity 0, and all its energy in wrong bins.
    """
    energy = reference_smooth.sum(axis=0)
    moving = (energy > 0) & (energy >= _MOVING * energy.mean())
    a, b = smooth[:, moving], reference_smooth[:, moving]  # (bins, k)
    share_a, share_b = _shares(a), _shares(b)
    centres_mps = axis.centres_mps
    mean_mps = np.abs(centres_mps @ share_a - centres_mps @ share_b)
    peak_mps = np.abs(_peaks(a, centres_mps) - _peaks(b, centres_mps))
    wrong = np.where(a.sum(axis=0) > 0, 0.5 * np.abs(share_a - share_b).sum(axis=0), 1.0)
    return Errors(
        l1=relative_l1(smooth, reference_smooth),
        l1_raw=relative_l1(raw, reference_raw),
        l1_frames=_per_frame(smooth, reference_smooth, moving),
        l1_raw_frames=_per_frame(raw, reference_raw, moving),
        peak_mps=spread(peak_mps),
        mean_mps=spread(mean_mps),
        wrong_bins=spread(wrong),
        frames=raw.shape[1],
    )


def spread(values: NDArray[np.float64]) -> Spread:
    """Median and 95th percentile; 0 of nothing."""
    if not values.size:
        return Spread(0.0, 0.0)
    return Spread(float(np.median(values)), float(np.percentile(values, 95)))


def _per_frame(
    values: NDArray[np.float64], reference: NDArray[np.float64], moving: NDArray[np.bool_]
) -> Spread:
    total = reference[:, moving].sum(axis=0)
    difference = np.abs(values - reference)[:, moving].sum(axis=0)
    # Smoothing may bring energy into a frame that has none of its own.
    return spread(difference[total > 0] / total[total > 0])


def _shares(values: NDArray[np.float64]) -> NDArray[np.float64]:
    total = values.sum(axis=0)
    return np.divide(values, total, out=np.zeros_like(values), where=total > 0)


def _peaks(values: NDArray[np.float64], centres_mps: NDArray[np.float64]) -> NDArray[np.float64]:
    peaks: NDArray[np.float64] = centres_mps[values.argmax(axis=0)]
    return np.where(values.sum(axis=0) > 0, peaks, 0.0)
