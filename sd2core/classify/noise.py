"""Noise floors that maps to learn from are given, so that those of any receiver are known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sd2core.classify.data import Clip

BELOW_LOUDEST_DB = (20.0, 45.0)
"""Mean power of the noise in a bin, under that of the clip's loudest cell.

A K60168A's recordings of gestures have it at 23 to 27 dB, a simulated radar by its link
budget at 36 dB (a person at 2.2 m), and synthetic maps and a campaign's targets have none.
"""
_MOST_LOOKS = 8.0
"""Noise of one look is exponential; of several, whose powers are averaged, less uneven."""


def with_noise_floor(clip: Clip, null_bins: Sequence[int], rng: np.random.Generator) -> Clip:
    """A clip as a receiver with more noise would give it.

    Parameters
    ----------
    null_bins : sequence of int
        Stay empty.
    rng : Generator
        Draws the level, how even the noise is, and the noise.
    """
    level = clip.energies.max(initial=0.0) * 10.0 ** (-rng.uniform(*BELOW_LOUDEST_DB) / 10.0)
    looks = _MOST_LOOKS ** rng.random()
    noise = rng.gamma(looks, level / looks, clip.energies.shape).astype(np.float32)
    noise[:, list(null_bins)] = 0.0
    return replace(clip, energies=clip.energies + noise)


def some_noisy(
    clips: Sequence[Clip], null_bins: Sequence[int], share: float, seed: int
) -> list[Clip]:
    """The clips, some of them with a noise floor: each with this probability."""
    rng = np.random.default_rng(seed)
    return [
        with_noise_floor(clip, null_bins, rng) if rng.random() < share else clip for clip in clips
    ]
