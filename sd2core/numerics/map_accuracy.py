"""How far a synthetic map may be from the truth: one figure, of the body and of the arithmetic."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

_MIN_PERCENT = 1e-3


@dataclass(frozen=True)
class MapAccuracy:
    """Relative L1 of a smoothed synthetic map: as text ``±38 % (body 37, arithmetic 7.5)``.

    Parameters
    ----------
    body : float, optional
        Expected error that follows from how badly the mesh says its velocities to be known, as a
        share. None: it says nothing, or that they are exact.
    arithmetic : float, optional
        Error of the plan by which the map was counted, against exact counting, as a share.
        None: it was not measured.

    Examples
    --------
    >>> from sd2core.numerics.map_accuracy import MapAccuracy
    >>> print(MapAccuracy(body=0.37, arithmetic=0.075))
    ±38 % (body 37, arithmetic 7.5)
    """

    body: float | None = None
    arithmetic: float | None = None

    @classmethod
    def of(cls, meta: Mapping[str, Any]) -> MapAccuracy:
        """Accuracy that a map's metadata state."""
        return cls(meta.get("body_error_l1"), meta.get("plan_error_l1"))

    @property
    def total(self) -> float | None:
        """Root of the sum of the squares of both; None if neither is known."""
        known = [part for part in (self.body, self.arithmetic) if part is not None]
        return math.hypot(*known) if known else None

    def __str__(self) -> str:
        if self.total is None:
            return ""
        words = percent(self.total)
        words = words if words.startswith("<") else f"±{words}"
        if self.body is None:
            return words
        parts = {"body": self.body, "arithmetic": self.arithmetic}
        details = [f"{name} {percent(of)[:-2]}" for name, of in parts.items() if of is not None]
        return f"{words} ({', '.join(details)})"


def percent(share: float) -> str:
    """A share with two figures; whole above 10 %, and not more than a map can tell below.

    It is infinite where an empty map changes.
    """
    value = 100 * share
    if value == 0:
        return "0 %"
    if value == float("inf"):
        return "∞ %"
    if value < _MIN_PERCENT:
        return f"<{_MIN_PERCENT:g} %"
    return f"{value:.0f} %" if value >= 9.95 else f"{value:.2g} %"


def relative_l1(values: NDArray[np.float64], reference: NDArray[np.float64]) -> float:
    """Sum of absolute differences over the sum of the reference.

    0 when both are empty, infinite when only the reference is.
    """
    difference, total = float(np.abs(values - reference).sum()), float(reference.sum())
    if total > 0:
        return difference / total
    return 0.0 if difference == 0 else float("inf")
