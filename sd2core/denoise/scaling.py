"""Compression between energies and the numbers that a network works with.

Fixed per model and the same for every cell, so that live and batch agree and the
strongest bin of a frame stays the strongest (docs/decisions/0024).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error

Values = TypeVar("Values")
"""A NumPy array or a torch tensor."""

EXPONENT = 0.5
"""Amplitude instead of power."""


def null_columns(null_bins: Iterable[int], bins: int, parts: int) -> list[int]:
    """Columns of emptied bins in inputs of ``parts`` maps, one map after the other."""
    emptied = list(null_bins)
    return [part * bins + number for part in range(parts) for number in emptied]


def whole_map(energies: NDArray[np.float32], bins: int) -> NDArray[np.float32]:
    """Sum (…, bins) of maps that follow one another, (…, maps · bins)."""
    maps = energies.reshape(*energies.shape[:-1], -1, bins)
    return np.asarray(maps.sum(axis=-2))


@dataclass(frozen=True)
class Compression:
    """Compression of energies, y = (x / reference)^exponent, and its inverse."""

    reference: float  # Energy that becomes 1.
    exponent: float = EXPONENT  # Above 0, up to 1. 1/2 turns power into amplitude.

    def __post_init__(self) -> None:
        if not (math.isfinite(self.reference) and self.reference > 0):
            raise Sd2Error(f"The reference energy is {self.reference}", "a finite number above 0")
        if not 0 < self.exponent <= 1:
            raise Sd2Error(f"The exponent is {self.exponent}", "above 0, up to 1")

    @classmethod
    def fitted(
        cls,
        stretches: Iterable[NDArray[np.float32]],
        null_bins: Sequence[int] = (),
        exponent: float = EXPONENT,
    ) -> Compression:
        """Fit the compression whose output has a root mean square of 1.

        In closed form: mean((x / r)^2p) = 1 for r = mean(x^2p)^(1/2p), which for the
        amplitude (p = 1/2) is the mean energy. So an error of 1 on compressed values is
        that of an empty result.

        ``stretches`` are energies of the training data, (frames, columns); ``null_bins``, columns
        that are always zero, are ignored. Raises Sd2Error when there is no energy at all.
        """
        total, cells = 0.0, 0
        for values in stretches:
            counted = np.delete(values, list(null_bins), axis=1).astype(np.float64)
            total += float((counted ** (2 * exponent)).sum())
            cells += counted.size
        if not total > 0:
            raise Sd2Error(
                "There is no energy in the maps to learn from", "maps in which something moves"
            )
        return cls((total / cells) ** (1 / (2 * exponent)), exponent)

    def compress(self, energy: Values) -> Values:
        """Compress energies, which are not negative."""
        scaled: Any = energy
        return (scaled / self.reference) ** self.exponent

    def expand(self, compressed: Values) -> Values:
        """Expand compressed values to energies; negative values become zero."""
        scaled: Any = compressed
        return (scaled * (scaled > 0)) ** (1 / self.exponent) * self.reference


@dataclass(frozen=True)
class Scaling:
    """Compressions of a model's input (synthetic Doppler) and target (the radar's)."""

    input: Compression
    target: Compression
    # Energy below which answers are empty. At first half the weakest energy above zero in the
    # radar's maps of the training: no such radar shows less; a training raises it to what shows in
    # enough of the frames.
    floor: float = 0.0
    more: int = 0  # Numbers in the input after the energies, which stay as they are.

    @classmethod
    def fitted(
        cls,
        inputs: Iterable[NDArray[np.float32]],
        targets: Iterable[NDArray[np.float32]],
        null_bins: Sequence[int] = (),
        *,
        parts: int = 1,
        input_exponent: float = EXPONENT,
        target_exponent: float = EXPONENT,
    ) -> Scaling:
        """Fit both on training data, so that what comes out has a root mean square of 1.

        Parameters
        ----------
        inputs : iterable of float32 ndarray, (frames, features)
            Synthetic maps; the first ``parts`` · bins features are energies, what follows is not
            compressed.
        targets : iterable of float32 ndarray, (frames, bins)
            The radar's maps.
        null_bins : sequence of int
            Bins that are always zero, which are ignored.
        parts : int
            Number of maps in an input.
        input_exponent, target_exponent : float
            Above 0, up to 1; 1/2 turns power into amplitude.

        Raises
        ------
        Sd2Error
            When there is no energy at all in the one or the other.
        """
        inputs, targets = list(inputs), list(targets)
        bins = targets[0].shape[1] if targets else 0
        maps = [values[:, : parts * bins] for values in inputs]
        return cls(
            Compression.fitted(maps, null_columns(null_bins, bins, parts), input_exponent),
            Compression.fitted(targets, null_bins, target_exponent),
            0.5 * min(float(values[values > 0].min(initial=np.inf)) for values in targets),
            inputs[0].shape[1] - parts * bins,
        )

    def compress_input(self, values: NDArray[np.float32]) -> NDArray[np.float32]:
        """Compress the energies of an input (…, features)."""
        energies, others = np.split(values, [values.shape[-1] - self.more], axis=-1)
        return np.concatenate([self.input.compress(energies), others], axis=-1)

    def to_json(self) -> dict[str, Any]:
        """Content of a model file."""
        return {
            "law": "power",
            "target_floor": self.floor,
            "input_more": self.more,
            **{
                f"{name}_{part}": getattr(getattr(self, name), part)
                for name in ("input", "target")
                for part in ("reference", "exponent")
            },
        }

    @classmethod
    def from_json(cls, content: dict[str, Any]) -> Scaling:
        """Scaling from the content of :meth:`to_json`.

        Raises KeyError, TypeError, ValueError or Sd2Error for other content.
        """
        if content["law"] != "power":
            raise ValueError(f"scaling law {content['law']!r}")
        return cls(
            Compression(float(content["input_reference"]), float(content["input_exponent"])),
            Compression(float(content["target_reference"]), float(content["target_exponent"])),
            # Files of before there was a floor have none.
            float(content.get("target_floor", 0.0)),
            int(content.get("input_more", 0)),
        )
