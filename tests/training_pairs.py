"""Small sets of pairs to train on."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import numpy as np

from sd2core.pairs.store import PairWriter, Take
from sd2core.sensor import VelocityAxis


def write_pairs(
    path: Path, *, subjects: int = 6, takes: int = 1, frames: int = 300, bins: int = 32
) -> Path:
    """A blob that wanders over the bins; the radar sees it fainter, and noise besides."""
    rng = np.random.default_rng(5)
    writer = PairWriter(
        path,
        kind="simulated",
        axis=VelocityAxis(bins, 2.0),
        null_bins=(14, 15, 16) if bins == 32 else (),
        frame_rate_hz=30.0,
        labels=("background", "swipe"),
        provenance={"seed": 5},
    )
    times_s = np.arange(frames) / 30.0
    for subject, number in product(range(subjects), range(takes)):
        centre = bins * (0.5 + 0.4 * np.sin(2.0 * times_s + subject + number))  # (frames,)
        blob = np.exp(-0.5 * ((np.arange(bins) - centre[:, None]) / 1.5) ** 2)  # (frames, bins)
        noise = rng.random((2, frames, bins)) * 0.1
        writer.append(
            Take(
                subject=f"s{subject}",
                name=f"take-{number}",
                synthetic=(0.02 * (blob + noise[0])).astype(np.float32),
                radar=(3e-3 * (0.5 * blob + noise[1])).astype(np.float32),
                times_s=times_s,
                label=np.zeros(frames, np.int8),
                sensor_position_m=np.zeros(3),
            )
        )
    return path
