"""Certainty of a gain: intervals over takes and people, and a paired test.

Frames of a take are no independent samples, and people differ: takes are drawn anew within
people, and people with all their takes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

_DRAWS = 4000
_INSIDE = (2.5, 97.5)

Gains = Mapping[str, NDArray[np.float64]]
"""Of every person: gain in each of their takes, a mean over folds and seeds."""


@dataclass(frozen=True)
class Gain:
    """Mean gain over people, with 95 % intervals."""

    mean: float
    over_takes: tuple[float, float]  # Of these very people.
    over_people: tuple[float, float]  # Other people and takes.
    p: float  # Of a gain so far from 0 if signs were by chance, two-sided.

    @property
    def certain(self) -> int:
        """1 or -1 where the interval over takes excludes 0; otherwise 0."""
        low, high = self.over_takes
        return int(low > 0) - int(high < 0)


def gain_of(gains: Gains) -> Gain:
    """Estimate a gain from paired differences.

    Every person counts the same, whatever their number of takes. The test turns signs of takes by
    chance.
    """
    people = [np.asarray(values, np.float64) for values in gains.values()]
    rng = np.random.default_rng(0)
    mean = float(np.mean([own.mean() for own in people]))
    takes = np.mean([_drawn(own, _DRAWS, rng) for own in people], axis=0)
    others = np.zeros(_DRAWS)
    for _ in people:
        chosen = rng.integers(len(people), size=_DRAWS)
        for number, own in enumerate(people):
            mine = chosen == number
            others[mine] += _drawn(own, int(mine.sum()), rng) / len(people)
    turned = np.mean(
        [(own * rng.choice((-1.0, 1.0), (_DRAWS, len(own)))).mean(axis=1) for own in people], axis=0
    )
    more = int((np.abs(turned) >= abs(mean) - 1e-12).sum())
    return Gain(mean, _interval(takes), _interval(others), (more + 1) / (_DRAWS + 1))


def adjusted(values: Sequence[float]) -> list[float]:
    """Adjust p values of several tests, by Holm's method (Scand. J. Statist. 6, 1979)."""
    order = np.argsort(values)
    result = [0.0] * len(values)
    largest = 0.0
    for rank, place in enumerate(order.tolist()):
        largest = max(largest, min(1.0, (len(values) - rank) * values[place]))
        result[place] = largest
    return result


def _drawn(own: NDArray[np.float64], times: int, rng: np.random.Generator) -> NDArray[np.float64]:
    """Means of takes drawn anew, with replacement."""
    return np.asarray(own[rng.integers(len(own), size=(times, len(own)))].mean(axis=1))


def _interval(values: NDArray[np.float64]) -> tuple[float, float]:
    low, high = np.percentile(values, _INSIDE)
    return float(low), float(high)
