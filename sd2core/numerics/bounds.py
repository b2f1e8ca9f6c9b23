"""Least and greatest values of settings, stated once for library, commands, plans and window."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Bounds:
    """Bounds of a number, both included.

    Parameters
    ----------
    low, high : float
        Least and greatest value.
    whole : bool
        True if only whole numbers are allowed.
    """

    low: float
    high: float
    whole: bool = False

    def __contains__(self, value: float) -> bool:
        return self.low <= value <= self.high and (not self.whole or int(value) == value)

    def nearest(self, value: float) -> float:
        """Nearest number within the bounds."""
        return min(max(value, self.low), self.high)

    @property
    def words(self) -> str:
        """What is allowed, as ``a whole number from 1 to 100``."""
        return f"a {'whole ' if self.whole else ''}number from {self.low:g} to {self.high:g}"


STATURE_M = Bounds(0.5, 2.6)
"""Standing height of a person, from a small child on."""

FIELD_OF_VIEW_DEG = Bounds(1.0, 170.0)
"""Of a camera, across the longer side of the picture."""

EPOCHS = Bounds(1, 1_000_000, whole=True)
BATCH_SIZE = Bounds(1, 100_000, whole=True)
PATIENCE_EPOCHS = Bounds(0, 1_000_000, whole=True)
LEARNING_RATE = Bounds(1e-8, 1.0)
RANGE_FACTOR = Bounds(1.0, 4.0)
SEED = Bounds(0, 2**31 - 1, whole=True)
STEPS = Bounds(1, 1_000_000, whole=True)
"""Of the training of a classifier."""
