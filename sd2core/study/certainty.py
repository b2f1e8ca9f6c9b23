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


def gain_of(gains: Gains, seed: int = 0) -> Gain:
    """Estimate a gain from paired differences.

    Every person counts the same, whatever their number of takes. The test turns signs of takes by
    chance.
    """
    people = [np.asarray(values, np.float64) for values in gains.values()]
    rng = np.random.default_rng(seed)
    mean = _mean(people)
    takes = [_mean([rng.choice(own, len(own)) for own in people]) for _ in range(_DRAWS)]
    others = []
    for _ in range(_DRAWS):
        drawn = [people[number] for number in rng.integers(len(people), size=len(people))]
        others.append(_mean([rng.choice(own, len(own)) for own in drawn]))
    turned = [_mean([own * rng.choice((-1.0, 1.0), len(own)) for own in people])
              for _ in range(_DRAWS)]  # fmt: skip
    more = int((np.abs(turned) >= abs(mean) - 1e-12).sum())
    return Gain(mean, _interval(takes), _interval(others), (more + 1) / (_DRAWS + 1))


def adjusted(values: Sequence[float]) -> list[float]:
    """Adjust p values of several tests, by Holm's method (Scand. J. Statist. 6, 1979)."""
    order = np.argsort(values)
    found = [0.0] * len(values)
    largest = 0.0
    for rank, place in enumerate(order.tolist()):
        largest = max(largest, min(1.0, (len(values) - rank) * values[place]))
        found[place] = largest
    return found


def _mean(people: Sequence[NDArray[np.float64]]) -> float:
    return float(np.mean([own.mean() for own in people]))


def _interval(values: Sequence[float]) -> tuple[float, float]:
    low, high = np.percentile(values, _INSIDE)
    return float(low), float(high)
