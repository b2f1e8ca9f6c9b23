"""Movements that a model has learnt from, and what becomes of others."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.maps import mean_velocity_mps, peak_velocity_mps
from sd2core.sensor import VelocityAxis

_RARE = 0.001
"""Share of the frames learnt from that are rarer than what counts as known."""
_MARGIN_MPS = 0.15
"""Distance from what is known at which a frame is wholly strange."""
_TRUSTS = (0.0, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875, 1.0)
_HARM = 2.0
"""How much more it counts that a segment is made worse than that it is made better."""


@dataclass(frozen=True)
class KnownMovements:
    """Velocities of the input maps that a model has learnt from, frame by frame.

    A network answers anything with what it knows: who walks at 1.8 m/s became one who gestures.
    """

    slowest_mps: float  # Least and greatest mean velocity of a frame.
    fastest_mps: float
    spread_mps: float  # Greatest standard deviation of the velocities of a frame.
    gain: float  # Energy of the radar's maps over that of the input.
    # Share of the network in the amplitudes of an answer; the rest is the synthetic map's.
    trust: float = 1.0

    def __post_init__(self) -> None:
        ordered = self.slowest_mps <= self.fastest_mps and self.spread_mps >= 0 and self.gain > 0
        if not (ordered and 0 <= self.trust <= 1):
            raise Sd2Error(
                f"A model knows movements {asdict(self)}",
                "ranges, a gain above 0, a trust of 0 to 1",
            )

    @classmethod
    def of(
        cls, pairs: Iterable[tuple[NDArray[np.float32], NDArray[np.float32]]], axis: VelocityAxis
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
        """Movements known to a model that learnt from both, from these last."""
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

    def mixed(
        self,
        answer: NDArray[np.float32],
        energies: NDArray[np.float32],
        axis: VelocityAxis,
        floor: float = 0.0,
    ) -> NDArray[np.float32]:
        """Answers of a network with what they were made of, as trust says, (…, bins).

        What is strange is the synthetic map's alone.

        Parameters
        ----------
        answer : float32 ndarray, (…, bins)
            Energies that the network answers, in the unit of the radar's maps.
        energies : float32 ndarray, (…, bins)
            Those of the synthetic map.
        axis : VelocityAxis
            Of both.
        floor : float
            Energy below which cells are empty, in frames that the network has a share in.
        """
        share = (self.trust * (1.0 - self.strangeness(energies, axis)))[..., None]
        amplitude = share * np.sqrt(answer)
        amplitude += (1.0 - share) * np.sqrt(np.float32(self.gain) * energies)
        mixed = np.square(amplitude)
        mixed[(mixed < floor) & (share > 0)] = 0.0
        return np.asarray(mixed, dtype=np.float32)

    def trusting(
        self,
        answers: NDArray[np.float32],
        energies: NDArray[np.float32],
        radar: NDArray[np.float32],
        moving: NDArray[np.bool_],
        axis: VelocityAxis,
    ) -> KnownMovements:
        """Copy with the trust that does best on maps that the network did not learn from.

        Peak, mean and cells (L1) count alike; what a segment is made worse by than the synthetic
        map counts twice (docs/decisions/0074).

        Parameters
        ----------
        answers, energies, radar : float32 ndarray, (segments, frames, bins)
            Energies that the network answers, those of the synthetic map, and the radar's.
        moving : bool ndarray, (segments, frames)
            Frames whose velocities count; without any the trust stays.
        axis : VelocityAxis
            Of all of them.
        """
        if not moving.any():
            return self

        seen = _velocities(radar, axis)

        def errors(trust: float) -> NDArray[np.float64]:
            """Of every segment: cells, and velocities in frames that move, (3, segments)."""
            mixed = replace(self, trust=trust).mixed(answers, energies, axis)
            cells = np.abs(mixed - radar).sum(axis=(1, 2), dtype=np.float64)
            off = np.abs(_velocities(mixed, axis) - seen) * moving
            return np.stack([cells, *off.sum(axis=2)])

        by_trust = {trust: errors(trust) for trust in _TRUSTS}
        none = by_trust[0.0]

        def loss(trust: float) -> float:
            change = by_trust[trust] - none
            counted = np.where(change > 0.0, _HARM * change, change).sum(axis=1)
            return float((counted / np.maximum(none.sum(axis=1), 1e-12)).sum())

        return replace(self, trust=min(_TRUSTS, key=loss))

    @property
    def words(self) -> str:
        """Ranges and trust in words."""
        return f"{self._ranges}; its amplitudes are {self.trust:.0%} the network's"

    @property
    def _ranges(self) -> str:
        return (
            f"mean velocities of {self.slowest_mps:.2f} to {self.fastest_mps:.2f} m/s,"
            f" spread up to {self.spread_mps:.2f} m/s"
        )

    def note(self, strange: NDArray[np.bool_]) -> str | None:
        """Sentence on the frames of a map that are :meth:`strange`; None if none is."""
        if not strange.any():
            return None
        return (
            f"{np.count_nonzero(strange):,} of {len(strange):,} frames move otherwise than what"
            f" the model learnt from ({self._ranges}): they are the synthetic map's"
        )

    @classmethod
    def from_json(cls, content: Mapping[str, Any] | None) -> KnownMovements | None:
        """Read from a model file; models of before there were ranges have none."""
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


def _velocities(energies: NDArray[np.float32], axis: VelocityAxis) -> NDArray[np.float64]:
    """Peak and mean velocity of every frame (segments, frames, bins), (2, segments, frames).

    They are 0 where the frame is empty.
    """
    frames = energies.reshape(-1, axis.bins)
    velocities = [np.nan_to_num(of(frames, axis)) for of in (peak_velocity_mps, mean_velocity_mps)]
    return np.stack(velocities).reshape(2, *energies.shape[:-1])
