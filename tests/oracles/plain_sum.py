"""The direct sum in NumPy, every phase by itself."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sd2core.fmcw.sums import Echoes, turns_of
from sd2core.radar_config import RadarConfig


def plain_sum(echoes: Echoes, config: RadarConfig) -> NDArray[np.complex128]:
    """Sum echoes as :func:`sd2core.fmcw.sums.direct` does, (chirps, samples)."""
    chirps, samples = config.chirps_per_frame, config.samples_per_chirp
    m = (np.arange(chirps) - 0.5 * (chirps - 1))[:, None]
    n = np.arange(samples) - 0.5 * samples
    total = np.zeros((chirps, samples), np.complex128)
    for terms, start, chirp, sample, migration in zip(
        echoes.terms.T, *turns_of(echoes, config), strict=True
    ):
        base = start + m * chirp
        angle = 2 * np.pi * (base - np.floor(base) + n * (sample + m * migration))
        total += np.polyval(terms[::-1], m / (0.5 * chirps)) * np.exp(1j * angle)
    return total
