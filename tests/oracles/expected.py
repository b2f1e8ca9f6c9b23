"""Expected maps in NumPy, every vertex by itself, as :mod:`sd2core.doppler.expected` counts."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from oracles.counting import count, places
from sd2core.doppler.expected import spread_over_bins
from sd2core.doppler.histogram import Counting, Counts, Frames, Scatterers


def count_expected(
    frames: Frames,
    ends: NDArray[np.float64],
    counting: Counting,
    scatterers: Scatterers,
    sigma_bins: NDArray[np.float64],
    vertex_limb: NDArray[np.uint8],
    into: Counts,
) -> None:
    """Count as :func:`sd2core.doppler.expected.count_expected` does, every vertex by itself."""
    sigma = sigma_bins[:, vertex_limb]  # (n, V)
    count(frames, ends, counting, scatterers, into)
    part = scatterers.parts
    part = np.zeros(sigma.shape[1], np.uint8) if part is None else part
    for t, knot in enumerate(frames.centre):
        points = frames.positions[knot]
        seen = scatterers.seen(t, points, ends)
        weight = seen * scatterers.weights(t, points, ends, counting)
        samples = np.flatnonzero(frames.duration_s[t] > 0).tolist()
        into.histogram[t] = 0
        for sample in samples:
            place = places(frames, t, sample, ends, counting)
            for number in range(into.histogram.shape[1]):
                own = part == number
                into.histogram[t, number] += spread_over_bins(
                    place[own], weight[own] / len(samples), sigma[t, own], counting
                )
