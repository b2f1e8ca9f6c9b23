"""Gaussian smoothing of a Doppler map on velocity and on time."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from sd2core.doppler.options import SynthesisOptions
from sd2core.mesh.presence import Presence
from sd2core.scattering.trajectory import REACH, SLACK_S


def smooth(
    raw: NDArray[np.float64],
    times_s: NDArray[np.float64],
    first: int,
    start: int,
    stop: int,
    options: SynthesisOptions,
    presence: Presence | None = None,
) -> NDArray[np.float64]:
    """Smooth frames of a map along velocity and time, (..., bins, stop - start).

    Parameters
    ----------
    raw : float64 ndarray, (..., bins, n)
        Frames that :func:`frames_within_reach` names, with nulled bins emptied.
    times_s : float64 ndarray, (T,)
        Times of all frames.
    first : int
        First frame of ``raw``.
    start, stop : int
        Half-open range of frames that are smoothed.
    options : SynthesisOptions
        Widths, and the bins that are emptied again afterwards.
    presence : Presence, optional
        Of all frames; nothing is smoothed across frames without a person.
    """
    values = velocity_kernel(options.axis.bins, options.velocity_sigma_bins) @ raw
    values = smooth_time(values, times_s, first, start, stop, options.time_sigma_s, presence)
    if options.null_after_smoothing:
        values[..., list(options.null_bins), :] = 0
    return values


@lru_cache(maxsize=8)
def velocity_kernel(bins: int, sigma_bins: float) -> NDArray[np.float64]:
    """Smoothing matrix along velocity, (bins, bins), reflecting at the axis's ends."""
    kernel: NDArray[np.float64] = np.eye(bins)
    if sigma_bins > 0:
        reach = int(REACH * sigma_bins + 0.5)
        bell = np.exp(-0.5 / (sigma_bins * sigma_bins) * np.arange(-reach, reach + 1) ** 2)
        bell /= bell.sum()
        around = np.pad(kernel, ((reach, reach), (0, 0)), "symmetric")
        kernel *= bell[reach]
        for away in range(reach, 0, -1):
            sides = around[reach - away :][:bins] + around[reach + away :][:bins]
            kernel += bell[reach + away] * sides
    kernel.flags.writeable = False
    return kernel


def frames_within_reach(
    times_s: NDArray[np.float64], start: int, stop: int, sigma_s: float
) -> tuple[int, int]:
    """Half-open range of frames that the smoothing of some frames needs.

    Parameters
    ----------
    times_s : float64 ndarray, (T,)
        Times of all frames.
    start, stop : int
        Half-open range of frames that are smoothed.
    sigma_s : float
        Of the Gaussian on time, which is cut at four of it; 0: only the frames themselves.
    """
    if sigma_s == 0:
        return start, stop
    reach = REACH * sigma_s + 2 * SLACK_S
    first = int(np.searchsorted(times_s, times_s[start] - reach))
    last = int(np.searchsorted(times_s, times_s[stop - 1] + reach, side="right"))
    return first, last


def smooth_time(
    values: NDArray[np.float64],
    times_s: NDArray[np.float64],
    first: int,
    start: int,
    stop: int,
    sigma_s: float,
    presence: Presence | None = None,
) -> NDArray[np.float64]:
    """Gaussian mean over real times, (..., stop - start).

    Parameters
    ----------
    values : float64 ndarray, (..., n)
        Frames that :func:`frames_within_reach` names.
    times_s : float64 ndarray, (T,)
        Times of all frames, so that the result does not depend on how a recording is cut.
    first : int
        First frame of ``values``.
    start, stop : int
        Half-open range of frames that are smoothed.
    sigma_s : float
        Of the Gaussian; 0: none.
    presence : Presence, optional
        Of all frames; the mean does not cross frames without a person.
    """
    if sigma_s == 0:
        return values[..., start - first : stop - first].copy()
    last = first + values.shape[-1]
    frames = np.arange(start, stop)
    centres = times_s[frames]
    reach = REACH * sigma_s + SLACK_S
    slack = reach + SLACK_S
    before = int((frames - np.searchsorted(times_s, centres - slack)).max())
    after = int((np.searchsorted(times_s, centres + slack, side="right") - frames).max())
    total, weights = np.zeros((*values.shape[:-1], len(frames))), np.zeros(len(frames))
    occupied = values.any(axis=-1)
    some, sums = values[occupied], total[occupied]
    for offset in range(-before, after):
        inside = slice(max(0, first - start - offset), min(len(frames), last - start - offset))
        neighbour = frames[inside] + offset
        distance = times_s[neighbour] - centres[inside]
        bell = np.exp(-0.5 * (distance / sigma_s) ** 2)
        bell[np.abs(distance) > reach] = 0
        if presence is not None and not presence.whole:
            bell[presence.first[neighbour] != presence.first[frames[inside]]] = 0
        from_frame = inside.start + start + offset - first
        sums[..., inside] += bell * some[..., from_frame : from_frame + len(bell)]
        weights[inside] += bell
    sums /= weights
    total[occupied] = sums
    return total
