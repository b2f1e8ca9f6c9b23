"""What a radar makes of an echo of constant velocity, from its window and clutter filter alone."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sd2core.fmcw.chain import FrameChain, ProcessingOptions, clutter_courses, taper
from sd2core.fmcw.processing import rebinning
from sd2core.radar_config import RadarConfig
from sd2core.sensor import VelocityAxis


def velocity_response(
    config: RadarConfig, velocity_mps: ArrayLike, processing: ProcessingOptions
) -> NDArray[np.float64]:
    """Power per bin, (bins, n), of echoes of some velocities, positive when approaching.

    A histogram over fine bins, multiplied by this, is what the radar would show of it if
    powers added up. Without a filter columns add up to 1, less what is beyond the axis.
    """
    chirps = config.chirps_per_frame
    doppler_bins = FrameChain(config, processing).doppler_bins
    turns = -2.0 / config.wavelength_m * np.asarray(velocity_mps, dtype=np.float64)
    signal = np.exp(2j * np.pi * config.chirp_repetition_s * np.outer(turns, np.arange(chirps)))
    if (courses := clutter_courses(processing.clutter, chirps)) is not None:
        signal -= (signal @ courses) @ courses.T
    window = taper(processing.window, chirps).astype(np.float64)
    power = np.abs(np.fft.fft(signal * window, n=doppler_bins, axis=1)) ** 2
    power /= doppler_bins * (window**2).sum()
    shown: NDArray[np.float64] = rebinning(config, VelocityAxis(), doppler_bins) @ power.T
    return shown
