"""Errors of a denoised map against the radar's map.

All functions take energies as (frames, bins), NumPy arrays of equal shape.

**Peak velocity.** The centre of the strongest bin of a frame (of several equal ones the
lowest). Bins that are zero on purpose are zero in both maps and never the strongest. A
frame without any energy has no peak velocity.

**Error.** e = v̂ − v for every frame in which the target has a peak velocity v. Where the
estimate has none there, it says that nothing moves: v̂ = 0. Leaving hard frames empty
therefore does not pay, and how many there are is counted. Frames in which the target has
no peak velocity cannot be judged; they are counted and left out. MAE is the mean of |e|,
σ the standard deviation of e about its mean. So MAE ≤ √(σ² + bias²). The standard
deviation of |e| is given as well, for comparison with tables that mean that one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sd2core.denoise.scaling import Compression
from sd2core.errors import Sd2Error
from sd2core.maps import mean_velocity_mps, peak_velocity_mps
from sd2core.numerics.map_accuracy import relative_l1
from sd2core.sensor import VelocityAxis


@dataclass(frozen=True)
class VelocityError:
    """Error e of one velocity per frame; the velocities are NaN if no frame can be judged."""

    mae_mps: float  # Mean of |e|.
    sd_mps: float  # Standard deviation σ of e about its mean.
    sd_absolute_mps: float  # Standard deviation of |e|.
    bias_mps: float  # Mean of e.
    rmse_mps: float
    correlation: float  # Pearson correlation; NaN if the estimate or the target does not vary.
    frames: int  # Frames that were judged.
    empty_target: int  # Frames left out because the target is empty.
    empty_estimate: int  # Judged frames in which the estimate is empty and counts as 0 m/s.


@dataclass(frozen=True)
class MapError:
    """Error of whole maps."""

    # Σ|x̂ − x| / Σx of the energies; 0 when both are empty, infinite when only the estimate is not.
    relative_l1: float
    shape_l1: float  # The same with the estimate brought to the target's energy: its gain is free.
    # Root mean square error of compressed values, over the bins that are not nulled; 1 for an empty
    # estimate of maps like those of the training.
    rmse_compressed: float
    # Pearson's, of compressed values over all these cells; NaN where one of the maps does not vary.
    correlation: float


def velocity_error(
    estimate_mps: NDArray[np.float64],
    target_mps: NDArray[np.float64],
    frames: NDArray[np.bool_] | None = None,
) -> VelocityError:
    """Compare velocities frame by frame; the definition is at the head of this module.

    A velocity is NaN where its frame is empty. ``frames`` limits it to some frames, e.g. those of
    one gesture.
    """
    if estimate_mps.shape != target_mps.shape:
        raise Sd2Error(
            f"The estimate has {estimate_mps.shape} frames, the target {target_mps.shape}",
            "the same",
        )
    if frames is not None:
        estimate_mps, target_mps = estimate_mps[frames], target_mps[frames]
    judged = ~np.isnan(target_mps)
    target = target_mps[judged]
    estimate = estimate_mps[judged]
    empty = np.isnan(estimate)
    estimate = np.where(empty, 0.0, estimate)
    error = estimate - target
    if not len(error):
        nan = float("nan")
        return VelocityError(nan, nan, nan, nan, nan, nan, 0, int((~judged).sum()), 0)
    return VelocityError(
        mae_mps=float(np.abs(error).mean()),
        sd_mps=float(error.std()),
        sd_absolute_mps=float(np.abs(error).std()),
        bias_mps=float(error.mean()),
        rmse_mps=float(np.sqrt((error**2).mean())),
        correlation=_correlation(estimate, target),
        frames=len(error),
        empty_target=int((~judged).sum()),
        empty_estimate=int(empty.sum()),
    )


def peak_error(
    estimate: NDArray[np.floating],
    target: NDArray[np.floating],
    axis: VelocityAxis,
    frames: NDArray[np.bool_] | None = None,
) -> VelocityError:
    """Error of the peak velocity (the paper's Table 1).

    Parameters
    ----------
    estimate, target : ndarray, (frames, bins)
        Energies.
    axis : VelocityAxis
        Of both.
    frames : bool ndarray, (frames,), optional
        Limits it to some frames; by default all count.
    """
    return velocity_error(
        peak_velocity_mps(estimate, axis), peak_velocity_mps(target, axis), frames
    )


def mean_velocity_error(
    estimate: NDArray[np.floating],
    target: NDArray[np.floating],
    axis: VelocityAxis,
    frames: NDArray[np.bool_] | None = None,
) -> VelocityError:
    """Error of the energy-weighted mean velocity.

    Parameters
    ----------
    estimate, target, axis, frames
        As for :func:`peak_error`.
    """
    return velocity_error(
        mean_velocity_mps(estimate, axis), mean_velocity_mps(target, axis), frames
    )


def map_error(
    estimate: NDArray[np.floating],
    target: NDArray[np.floating],
    compression: Compression,
    null_bins: tuple[int, ...] = (),
) -> MapError:
    """Error of all cells of two maps.

    Parameters
    ----------
    estimate, target : ndarray, (frames, bins)
        Energies, in the unit of the target; Sd2Error for different shapes.
    compression : Compression
        That of the model's targets.
    null_bins : tuple of int
        Bins that are ignored.
    """
    if estimate.shape != target.shape:
        raise Sd2Error(f"The maps are of shape {estimate.shape} and {target.shape}", "the same")
    answer, wanted = (
        np.delete(values, list(null_bins), axis=1).astype(np.float64)
        for values in (estimate, target)
    )
    total, energy = float(wanted.sum()), float(answer.sum())
    relative = shape = relative_l1(answer, wanted)
    if energy > 0 and total > 0:
        shape = relative_l1(answer * (total / energy), wanted)
    answer, wanted = compression.compress(answer), compression.compress(wanted)
    rmse = float(np.sqrt(((answer - wanted) ** 2).mean())) if answer.size else float("nan")
    return MapError(relative, shape, rmse, _correlation(answer.ravel(), wanted.ravel()))


def stands_out(
    energies: NDArray[np.floating], null_bins: tuple[int, ...] = ()
) -> NDArray[np.bool_]:
    """Mask of the frames whose strongest bin lies above the noise, (frames,).

    A radar's map is never empty: where nothing moves, its strongest bin is that of the
    noise, and its velocity says nothing. The noise is the median of all cells of the
    take, which holds as long as movement fills less than half of them.

    ``energies``, (frames, bins), are those of one take; ``null_bins`` are ignored. What is above
    the noise is 10 dB above it.
    """
    counted = np.delete(energies, list(null_bins), axis=1)
    if not counted.size:
        return np.zeros(len(energies), bool)
    return counted.max(axis=1) > 10.0 * np.median(counted)


def _correlation(one: NDArray[np.float64], other: NDArray[np.float64]) -> float:
    if len(one) < 2 or one.std() == 0 or other.std() == 0:
        return float("nan")
    return float(np.corrcoef(one, other)[0, 1])
