"""Classifier of a study: ridge regression on what a window of a map shows.

In closed form, so that hundreds of trainings take minutes and differ by their data alone. Of few
seconds of real data a network learns less.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from sd2core.classify.data import UNKNOWN, Clip
from sd2core.errors import Sd2Error
from sd2core.maps import mean_velocity_mps, peak_velocity_mps
from sd2core.sensor import VelocityAxis

RIDGE = 0.3
"""Penalty on standardised features, of frames whose weights add up to 1. Real maps alone do about
as well from 0.1 to 1."""
_HARMONICS = 8
_LAGS_S = (0.2, 0.4, 0.6, 0.8, 1.0, 1.2)
_QUANTILES = (0.05, 0.25, 0.75, 0.95)
_TOGETHER = 256
"""Windows that are described at once."""

Features = NDArray[np.float64]
"""(frames, numbers)."""


def window_features(
    energies: NDArray[np.float32], axis: VelocityAxis, frame_rate_hz: float, window_s: float
) -> Features:
    """Describe the window around every frame of one take.

    Of the mean velocity, the spread, the speed and the peak: mean and deviation; of the mean
    velocity also quantiles, spectrum and autocorrelation; of the share of each bin: root of the
    mean, and deviation. All are free of the map's gain.

    Parameters
    ----------
    energies : float32 array, shape (frames, bins)
    axis : VelocityAxis
    frame_rate_hz : float
    window_s : float
        Length of the window, which is cut at both ends of the take.

    Returns
    -------
    float64 array, shape (frames, numbers)
    """
    rate = axis.v_max_mps
    mean = np.nan_to_num(mean_velocity_mps(energies, axis)) / rate
    peak = np.nan_to_num(peak_velocity_mps(energies, axis)) / rate
    total = energies.sum(axis=1, keepdims=True, dtype=np.float64)
    share = energies / np.where(total > 0, total, 1.0)
    square = share @ (axis.centres_mps / rate) ** 2
    spread = np.sqrt(np.maximum(square - mean**2, 0.0))
    series = np.column_stack([mean, spread, np.abs(mean), peak, share])
    half = half_window(frame_rate_hz, window_s)
    lags = [max(1, round(lag_s * frame_rate_hz)) for lag_s in _LAGS_S]
    frames = len(series)
    # Windows that are cut stand alone, the others are described together.
    windows = [series[None, : frame + half] for frame in range(min(half, frames))]
    if frames >= 2 * half:
        whole = np.moveaxis(sliding_window_view(series, 2 * half, axis=0), 2, 1)
        windows += [whole[k : k + _TOGETHER] for k in range(0, len(whole), _TOGETHER)]
    cut = range(max(frames - half + 1, half), frames)
    windows += [series[None, frame - half :] for frame in cut]
    return np.concatenate([_described(one, half, lags) for one in windows])


def half_window(frame_rate_hz: float, window_s: float) -> int:
    """Count the frames of a window from the one on that it is around."""
    return max(1, round(0.5 * window_s * frame_rate_hz))


def _described(windows: Features, half: int, lags: Sequence[int]) -> Features:
    """Describe windows (n, frames, mean velocity, three others and shares), (n, numbers)."""
    base, columns, moves = windows[..., :4], windows[..., 4:], windows[..., 0]
    spectrum = np.zeros((len(windows), _HARMONICS))
    magnitudes = np.abs(np.fft.rfft(moves, 2 * half, axis=1))[:, :_HARMONICS]
    spectrum[:, : magnitudes.shape[1]] = magnitudes / np.sqrt(2 * half)
    alike = np.zeros((len(windows), len(lags)))
    for number, lag in enumerate(lags):
        if moves.shape[1] > lag:
            alike[:, number] = (moves[:, lag:] * moves[:, :-lag]).mean(axis=1)
    return np.concatenate(
        [
            base.mean(axis=1),
            base.std(axis=1),
            np.quantile(moves, _QUANTILES, axis=1).T,
            np.sqrt(columns.mean(axis=1)),
            columns.std(axis=1),
            spectrum,
            alike,
        ],
        axis=1,
    )


def at_speed(
    energies: NDArray[np.float32], axis: VelocityAxis, speed: float
) -> NDArray[np.float32]:
    """Play a map faster or slower, (frames, bins) → (frames / speed, bins).

    Velocities grow by the same factor; what passes the end of the axis is lost.
    """
    frames = np.arange(0.0, len(energies) - 0.5, speed)
    before = frames.astype(int)
    after = np.minimum(before + 1, len(energies) - 1)
    part = (frames - before)[:, None]
    played = (1.0 - part) * energies[before] + part * energies[after]
    inside = axis.centres_mps / speed
    moved = [np.interp(inside, axis.centres_mps, row, left=0.0, right=0.0) for row in played]
    return (np.array(moved) / speed).astype(np.float32)


@dataclass(frozen=True, eq=False)
class Ridge:
    """Linear scores of classes from features."""

    mean: Features
    scale: Features
    weights: Features  # (numbers + 1, classes)

    @classmethod
    def fitted(
        cls,
        clips: Sequence[Clip],
        weights: Sequence[float],
        classes: int,
        describe: Callable[[Clip], Features],
    ) -> Ridge:
        """Fit to clips; every class counts the same where it occurs.

        Parameters
        ----------
        clips : sequence of Clip
            Frames without a class are left out.
        weights : sequence of float
            Of every frame of each clip.
        classes : int
            Number of classes.
        describe : callable
            Features of a clip, (frames, numbers).

        Raises
        ------
        Sd2Error
            Without a labelled frame.
        """
        known = [clip.label != UNKNOWN for clip in clips]
        if not any(one.any() for one in known):
            raise Sd2Error("There is no labelled frame to learn from", "one at least")
        x, y, w = (
            np.concatenate(parts)
            for parts in zip(
                *(
                    (describe(clip)[own], clip.label[own], np.full(int(own.sum()), weight))
                    for clip, own, weight in zip(clips, known, weights, strict=True)
                ),
                strict=True,
            )
        )
        w = w / np.maximum(np.bincount(y, w, classes), 1e-12)[y]
        w /= w.sum()
        mean = w @ x
        scale = np.sqrt(w @ (x - mean) ** 2) + 1e-6
        rows = np.c_[(x - mean) / scale, np.ones(len(x))]
        normal = (rows * w[:, None]).T @ rows + RIDGE * np.eye(rows.shape[1])
        wanted = (rows * w[:, None]).T @ np.eye(classes)[y]
        return cls(mean, scale, np.linalg.solve(normal, wanted))

    def scores(self, features: Features) -> Features:
        """Return the scores of the classes, (frames, classes)."""
        rows = np.c_[(features - self.mean) / self.scale, np.ones(len(features))]
        return np.asarray(rows @ self.weights)
