"""Movements that a model has learnt from, and what becomes of others."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.sensor import VelocityAxis

_RARE = 0.001
"""Share of the frames learnt from that are rarer than what counts as known."""
_MARGIN_MPS = 0.15
"""Distance from what is known at which a frame is wholly strange."""


@dataclass(frozen=True)
class KnownMovements:
    """Velocities of the input maps that a model has learnt from, frame by frame.

    A network answers anything with what it knows: who walks at 1.8 m/s became one who gestures.
    """

    slowest_mps: float  # Least and greatest mean velocity of a frame.
    fastest_mps: float
    spread_mps: float  # Greatest standard deviation of the velocities of a frame.
    gain: float  # Energy of the radar's maps over that of the input.

    def __post_init__(self) -> None:
        if not (self.slowest_mps <= self.fastest_mps and self.spread_mps >= 0 and self.gain > 0):
            raise Sd2Error(f"A model knows movements {asdict(self)}", "ranges, and a gain above 0")

    @classmethod
    def of(
        cls,
        pairs: Iterable[tuple[NDArray[np.float32], NDArray[np.float32]]],
        axis: VelocityAxis,
    ) -> KnownMovements | None:
        """From maps to learn from and the radar's, (frames, bins) each; None if nothing moves."""
        inputs, targets = (np.concatenate(each) for each in zip(*pairs, strict=True))
        moving = inputs.any(axis=1)
        if not moving.any() or not targets[moving].any():
            return None
        mean, spread = _moments(inputs[moving], axis)
        slowest, fastest = np.quantile(mean, [_RARE, 1.0 - _RARE])
        gain = targets[moving].sum(dtype=np.float64) / inputs[moving].sum(dtype=np.float64)
        most = float(np.quantile(spread, 1.0 - _RARE))
        return cls(float(slowest), float(fastest), most, float(gain))

    def together(self, other: KnownMovements | None) -> KnownMovements:
        """What a model knows that learnt from both, from these last."""
        if other is None:
            return self
        return replace(
            self,
            slowest_mps=min(self.slowest_mps, other.slowest_mps),
            fastest_mps=max(self.fastest_mps, other.fastest_mps),
            spread_mps=max(self.spread_mps, other.spread_mps),
        )

    def strangeness(self, energies: NDArray[np.float32], axis: VelocityAxis) -> NDArray[np.float32]:
        """How far each frame (…, bins) is from what is known, from 0 to 1, (…,)."""
        mean, spread = _moments(energies, axis)
        beyond = np.maximum(mean - self.fastest_mps, self.slowest_mps - mean)
        beyond = np.maximum(beyond, spread - self.spread_mps)
        return np.clip(beyond / _MARGIN_MPS, 0.0, 1.0).astype(np.float32)

    def strange(self, energies: NDArray[np.float32], axis: VelocityAxis) -> NDArray[np.bool_]:
        """Frames (…, bins) that are rather the synthetic map's than the model's, (…,)."""
        return np.asarray(self.strangeness(energies, axis) > 0.5)

    def passed_through(
        self, answer: NDArray[np.float32], energies: NDArray[np.float32], axis: VelocityAxis
    ) -> NDArray[np.float32]:
        """Answers (…, bins), but what they were made of (…, bins) where that is strange."""
        share = self.strangeness(energies, axis)[..., None]
        return np.asarray((1.0 - share) * answer + share * np.float32(self.gain) * energies)

    @property
    def words(self) -> str:
        """Ranges in words."""
        return (
            f"mean velocities of {self.slowest_mps:.2f} to {self.fastest_mps:.2f} m/s,"
            f" spread up to {self.spread_mps:.2f} m/s"
        )

    def note(self, energies: NDArray[np.float32], axis: VelocityAxis) -> str | None:
        """Sentence on the frames (frames, bins) that are passed through; None if none is."""
        strange = int(np.count_nonzero(self.strange(energies, axis)))
        if not strange:
            return None
        return (
            f"{strange:,} of {len(energies):,} frames move otherwise than what the model learnt"
            f" from ({self.words}): they are the synthetic map's"
        )

    @classmethod
    def from_json(cls, content: Mapping[str, Any] | None) -> KnownMovements | None:
        """From the dictionary of its fields; models of before there were ranges have none."""
        return None if content is None else cls(**{name: float(content[name]) for name in content})


def _moments(
    energies: NDArray[np.float32], axis: VelocityAxis
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Mean and standard deviation of the velocity of each frame (…, bins); 0 where it is empty."""
    values = energies.astype(np.float64)
    total = values.sum(axis=-1)
    total = np.where(total > 0, total, 1.0)
    mean = values @ axis.centres_mps / total
    square = values @ axis.centres_mps**2 / total
    return mean, np.sqrt(np.maximum(square - mean**2, 0.0))
