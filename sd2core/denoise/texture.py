"""Texture of a radar's map: how it scatters about the mean that a network predicts.

A cell of a Doppler map shows an echo in a part of the frames only, and with a power that
fluctuates as that of many scatterers does (speckle; F. T. Ulaby et al., "Microwave Remote
Sensing", vol. II, section 7-2): gamma distributed, with as many looks as were averaged. A model's
answer is the mean over all of that, smoother than any radar's map.
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.maps import DopplerMap

Energies = NDArray[np.float32]

_BLOCK = 512
_GROUPS = 24
_ROUNDS = 30
_MIN_SHOWN = 50
_APART = 3
"""Frames apart at which a cell's fluctuations are taken as independent, its mean as the same."""


@dataclass(frozen=True)
class Texture:
    """Law of the power of a cell, given its mean m.

    It shows with a probability that is logistic in log m, with the power
    (floor + gain · m) · G, where G is gamma distributed with mean 1 and ``looks`` as its shape.
    Neighbouring frames are correlated, bins are not.
    """

    half: float  # Mean at which a cell shows in half of the frames.
    slope: float  # Of the logistic law, per unit of log m.
    floor: float  # Mean power of what shows of the weakest cells.
    gain: float
    looks: float
    persistence: float  # Correlation of the normal process from frame to frame, 0 to below 1.

    def __post_init__(self) -> None:
        positive = min(self.half, self.slope, self.looks, self.floor + self.gain)
        if not (positive > 0 and min(self.floor, self.gain) >= 0 and 0 <= self.persistence < 1):
            raise Sd2Error(f"A texture is {self}", "numbers above 0, a persistence below 1")

    @classmethod
    def fitted(cls, means: Energies, radar: Energies) -> Texture | None:
        """Fit it to a model's answers and a radar's maps, (…, frames, bins); None of too few."""
        shows = radar > 0
        if min(shows.sum(), (~shows & (means > 0)).sum()) < _MIN_SHOWN:
            return None
        known = means > 0
        half, slope = _logistic(np.log(means[known], dtype=np.float64), shows[known])
        mean, power = (values[shows & known].astype(np.float64) for values in (means, radar))
        groups = np.array_split(np.argsort(mean), _GROUPS)
        level = np.array([mean[one].mean() for one in groups])
        powers = np.array([power[one].mean() for one in groups])
        # Relative errors count.
        rows = np.stack([np.ones_like(level), level], axis=1) / powers[:, None]
        floor, gain = np.linalg.lstsq(rows, np.ones_like(powers))[0].clip(min=0.0).tolist()
        near, far = _change(radar, 1), _change(radar, _APART)
        if not (floor + gain > 0 and slope > 0 and 0 < far < 1):
            return None
        looks = 0.5 * (1.0 / far - 1.0)
        # Powers are alike by about the square of what they are made of.
        persistence = float(np.sqrt(np.clip(1.0 - near / far, 0.0, 0.98)))
        return cls(half, slope, floor, gain, looks, persistence)

    def mean_that_shows(self, share: float) -> float:
        """Mean of a cell that shows in this share of the frames, 0 to 1 both excluded."""
        return float(self.half * (share / (1.0 - share)) ** (1.0 / self.slope))

    def drawn(self, energies: Energies, seed: Sequence[int], first: int = 0) -> Energies:
        """A realisation of frames (frames, bins) whose mean is given, from frame ``first`` on.

        It depends on the seed and on the number of each frame, not on where a stretch begins.
        """
        from scipy.special import expit, gammaincinv, ndtr

        mean = energies.astype(np.float64)
        with np.errstate(divide="ignore"):
            shown = expit(self.slope * (np.log(mean) - np.log(self.half)))
        frames, bins = energies.shape
        rank = ndtr(_fluctuations(seed, first, frames, bins, self.persistence))
        above = np.clip((rank - (1.0 - shown)) / np.maximum(shown, 1e-12), 0.0, 1.0 - 1e-9)
        power = (self.floor + self.gain * mean) * gammaincinv(self.looks, above) / self.looks
        return np.where(rank > 1.0 - shown, power, 0.0).astype(np.float32)

    def on(self, doppler: DopplerMap, seed: int) -> DopplerMap:
        """A denoised map as the radar would show it; other maps get other fluctuations.

        The same ``seed`` draws the same map again.
        """
        note = f"drawn as the radar would show it (seed {seed}): it scatters about the mean"
        notes = [*doppler.meta.get("notes", []), note]
        meta = {**doppler.meta, "texture": {"seed": seed}, "notes": notes}
        content = zlib.crc32(doppler.values.tobytes())
        drawn = self.drawn(np.ascontiguousarray(doppler.values.T), (seed, content))
        return replace(doppler, values=drawn.T, meta=meta)

    @classmethod
    def from_json(cls, content: Mapping[str, Any] | None) -> Texture | None:
        """Read from a model file; models of before there were textures have none."""
        return None if content is None else cls(**{name: float(content[name]) for name in content})


def _change(radar: Energies, apart: int) -> float:
    """Mean of ((x − y) / (x + y))² of a cell's powers some frames apart, where both show.

    Of independent powers with the same gamma distribution it is 1 / (2 looks + 1), whatever their
    mean is.
    """
    one, other = radar[..., :-apart, :], radar[..., apart:, :]
    both = (one > 0) & (other > 0)
    if both.sum() < _MIN_SHOWN:
        return 0.0
    x, y = one[both].astype(np.float64), other[both].astype(np.float64)
    return float((((x - y) / (x + y)) ** 2).mean())


def _fluctuations(
    seed: Sequence[int], first: int, frames: int, bins: int, persistence: float
) -> NDArray[np.float64]:
    """Normal numbers (frames, bins), correlated from frame to frame, anew in every block."""
    blocks = []
    for block in range(first // _BLOCK, -(-(first + frames) // _BLOCK)):
        rng = np.random.default_rng([*seed, block])
        rows = min(_BLOCK, first + frames - block * _BLOCK)
        values = rng.standard_normal((rows, bins))
        values[1:] *= np.sqrt(1.0 - persistence**2)
        for frame in range(1, rows):
            values[frame] += persistence * values[frame - 1]
        blocks.append(values)
    start = first % _BLOCK
    return np.concatenate(blocks)[start : start + frames] if blocks else np.zeros((0, bins))


def _logistic(levels: NDArray[np.float64], shows: NDArray[np.bool_]) -> tuple[float, float]:
    """Level at which half shows, as an energy, and slope: maximum likelihood, by Newton's steps."""
    from scipy.special import expit

    middle, spread = levels.mean(), levels.std() + 1e-9
    rows = np.stack([np.ones_like(levels), (levels - middle) / spread])
    weights = np.zeros(2)
    for _ in range(_ROUNDS):
        chance = expit(weights @ rows)
        curvature = (rows * (chance * (1 - chance) + 1e-6)) @ rows.T
        weights += np.linalg.solve(curvature + 1e-6 * np.eye(2), rows @ (shows - chance))
    slope = float(weights[1] / spread)
    return float(np.exp(middle - weights[0] / slope)) if slope > 0 else 1.0, slope
