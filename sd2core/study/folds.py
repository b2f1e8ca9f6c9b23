"""Folds of a study: who is judged, of whom there is only video, and whose radar is there.

Every ordered pair of people is a fold: one is judged, of the other there is only video, and of
all others there are maps of the radar. Of these a share is taken, equally much of every class.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import permutations

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.pairs.store import PairSet, Take

_LEAST_PEOPLE = 3
UNKNOWN = -1
"""Of a frame whose label is of no class."""


@dataclass(frozen=True)
class Fold:
    """Division of people."""

    judged: str
    video: str  # Person whose radar is not looked at, but for the yardstick.
    real: tuple[str, ...]

    @property
    def title(self) -> str:
        """Name for messages and files."""
        return f"{self.judged}-judged-{self.video}-on-video"


@dataclass(frozen=True, eq=False)
class Labelled:
    """Take with the class of every frame."""

    take: Take
    classes: NDArray[np.int64]  # Index, or UNKNOWN.

    @property
    def title(self) -> str:
        """Name in results."""
        return f"{self.take.subject}/{self.take.name}"

    def at_speed(self, speed: float) -> Labelled:
        """Return the classes as of a map that is played faster; its own maps stay as they are."""
        frames = np.arange(0.0, len(self.classes) - 0.5, speed).astype(int)
        return Labelled(self.take, self.classes[frames])

    def part(self, frames: slice) -> Labelled:
        """Return some of its frames."""
        return Labelled(self.take.part(frames), self.classes[frames])


def folds_of(people: Sequence[str]) -> list[Fold]:
    """Return all folds of some people."""
    if len(people) < _LEAST_PEOPLE:
        raise Sd2Error(
            f"The study has {len(people)} people: {', '.join(people)}",
            "three or more: one is judged, one is filmed only, of the others there is a radar",
        )
    return [
        Fold(judged, video, tuple(one for one in people if one not in (judged, video)))
        for judged, video in permutations(people, 2)
    ]


def labelled_takes(
    pairs: PairSet, classes: Mapping[str, str]
) -> tuple[tuple[str, ...], list[Labelled]]:
    """Return the classes and all takes with a frame of one, as seen by their own sensor.

    ``classes`` gives the class of labels; empty: each label is one, but for the background.
    """
    unknown = [label for label in classes if label not in pairs.labels]
    if unknown:
        raise Sd2Error(
            f"No frame is labelled {', '.join(unknown)}", f"some of {', '.join(pairs.labels)}"
        )
    named = dict(classes) or {label: label for label in pairs.labels[1:]}
    there = {pairs.labels[number] for take in pairs.takes for number in np.unique(take.label)}
    names = tuple(dict.fromkeys(named[label] for label in pairs.labels if label in named and
                                label in there))  # fmt: skip
    if len(names) < 2:
        raise Sd2Error(
            f"The pairs hold the classes {', '.join(names) or 'none'}",
            "two or more",
            "Label them with `sd2 pairs label`",
        )
    table = np.array(
        [names.index(named[one]) if named.get(one) in names else UNKNOWN for one in pairs.labels]
    )
    found = [Labelled(take, table[take.label]) for take in pairs.placements(first_only=True).takes]
    return names, [one for one in found if (one.classes != UNKNOWN).any()]


def share_of(takes: Sequence[Labelled], share: float, seed: int) -> list[Labelled]:
    """Draw a share of the frames of every class: whole runs in random order, the last cut short.

    A larger share of the same seed includes a smaller one.
    """
    runs: dict[int, list[Labelled]] = {}
    for take in takes:
        edges = np.flatnonzero(np.diff(take.classes)) + 1
        for start, stop in zip([0, *edges], [*edges, len(take.classes)], strict=True):
            number = int(take.classes[start])
            if number != UNKNOWN:
                runs.setdefault(number, []).append(take.part(slice(int(start), int(stop))))
    found = []
    for number, own in sorted(runs.items()):
        order = np.random.default_rng([seed, number]).permutation(len(own))
        left = max(1, round(share * sum(len(one.classes) for one in own)))
        for one in (own[place] for place in order):
            if left <= 0:
                break
            found.append(one if len(one.classes) <= left else one.part(slice(left)))
            left -= len(found[-1].classes)
    return found
