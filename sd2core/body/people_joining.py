"""Whose the stretches of :mod:`sd2core.body.people_following` are."""

from __future__ import annotations

from bisect import bisect
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from sd2core.body.identity import Trail
from sd2core.body.people_following import (
    MIN_LOOKS,
    UNLIKE,
    Doubt,
    Sight,
    Stretch,
    against,
    assigned,
)
from sd2core.body.roi import Floats, Roi, roi_of

_LEFT = 1.0
_VANISHED = 8.0
"""How much speaks against somebody coming or going at an edge of the picture, or inside it."""
_EDGE = 0.3
"""Distance in squares from the left or right edge up to which people leave the picture."""
_LONG_S = 1.5
"""Gap from which on every second more speaks against one person by one."""
_SURE = 2.2
"""How much worse every other way to join has to be (logarithm of odds: 90 %)."""
_NEVER = 1e3
"""Cost of what cannot be."""


@dataclass(eq=False)
class Somebody:
    """A person: their stretches in order."""

    stretches: list[Stretch]
    certainty: float = 1.0  # probability that all stretches are of one person
    may_be: Somebody | None = None  # who was seen before and may be the same

    @property
    def seen_s(self) -> float:
        """Time for which they are seen."""
        return sum(each.times_s[-1] - each.times_s[0] for each in self.stretches)

    @property
    def score(self) -> float:
        """Best score of the detector."""
        return max(each.score for each in self.stretches)


def joined(stretches: list[Stretch], width: int) -> list[Somebody]:
    """People of the stretches, in the order in which they appear.

    Stretches are joined where every other way to join them is much less likely. Where one is
    not, the later one is another person, who may be the earlier.
    """
    long = [each for each in stretches if len(each.numbers) >= MIN_LOOKS]
    people: list[Somebody] = []
    whose: dict[int, Somebody] = {}
    before = {later: (earlier, odds) for earlier, later, odds in _joins(long, width)}
    for number, stretch in enumerate(long):
        earlier, odds = before.get(number, (-1, 0.0))
        known = whose.get(earlier)
        if known is not None and odds >= _SURE:
            known.stretches.append(stretch)
            known.certainty *= 1.0 / (1.0 + float(np.exp(-odds)))
            whose[number] = known
        else:
            whose[number] = Somebody([stretch], may_be=known)
            people.append(whose[number])
    return people


def cleared(
    doubts: Sequence[Doubt], people: Sequence[Somebody]
) -> Iterator[tuple[int, int, Sight]]:
    """Looks whose person is sure once it is known where everybody was before and after.

    Yields row of the person, number of the picture, and the body.
    """
    for doubt in doubts:
        costs = np.array(
            [[_against_between(one, each, doubt) for each in doubt.sights] for one in people]
        ).reshape(len(people), len(doubt.sights))
        rows = np.flatnonzero(costs[:, 0] < _NEVER)
        order, doubtful = assigned(costs[rows])
        for row, column in order.items():
            stretches = people[rows[row]].stretches
            inside = stretches[0].numbers[0] < doubt.number < stretches[-1].numbers[-1]
            if inside and row not in doubtful:
                yield int(rows[row]), doubt.number, doubt.sights[column]


def _against_between(person: Somebody, sight: Sight, doubt: Doubt) -> float:
    """How much speaks against a body being somebody who was seen before, after, or both."""
    if any(doubt.number in each.numbers for each in person.stretches):
        return _NEVER
    likeness = max(each.appearance.likeness(sight.signature) for each in person.stretches)
    cost, gap_s = (1.0 - likeness) / UNLIKE, np.inf
    trails = []
    before = [each for each in person.stretches if each.numbers[0] < doubt.number]
    if before:
        trails.append((before[-1].trail_to(bisect(before[-1].numbers, doubt.number) - 1), 1.0))
    after = [each for each in person.stretches if each.numbers[-1] > doubt.number]
    if after:
        trails.append((after[0].trail_from(bisect(after[0].numbers, doubt.number)), -1.0))
    for trail, sense in trails:
        cost += against(trail, sight.roi, sense * doubt.time_s, 1.0)
        gap_s = min(gap_s, sense * doubt.time_s - trail.time_s)
    return cost if len(trails) == 2 or gap_s <= _LONG_S else _NEVER


def _joins(stretches: list[Stretch], width: int) -> list[tuple[int, int, float]]:
    """Best way to go on: earlier stretch, later one, odds against the next best way."""
    from scipy.optimize import linear_sum_assignment

    count = len(stretches)
    if not count:
        return []
    costs = np.full((2 * count, 2 * count), _NEVER)
    starts = [each.trail_from(0) for each in stretches]
    last_s = max(each.times_s[-1] for each in stretches)
    first_s = min(each.times_s[0] for each in stretches)
    for one, earlier in enumerate(stretches):
        for two, later in enumerate(stretches):
            if earlier.times_s[-1] < later.times_s[0]:
                costs[one, two] = _against(earlier, later, starts[two])
        ends, begins = earlier.times_s[-1] == last_s, earlier.times_s[0] == first_s
        costs[one, count + one] = 0.0 if ends else _leaving(earlier.trail, width)
        costs[count + one, one] = 0.0 if begins else _leaving(starts[one], width)
    costs[count:, count:] = 0.0
    chosen = linear_sum_assignment(costs)[1].tolist()
    return [
        (one, chosen[one], _next_best(costs, chosen, one, count) - costs[one, chosen[one]])
        for one in range(count)
        if chosen[one] < count
    ]


def _next_best(costs: Floats, chosen: list[int], one: int, count: int) -> float:
    """Cost of the cheapest way without a join, beyond that of all others that change."""
    two = chosen[one]
    ends, begins = costs[one, count + one], costs[count + two, two]
    best = ends + begins
    for other in range(count):
        place = chosen[other]
        if other != one:  # it goes on as the later one instead, and this as that did, or ends
            instead = costs[one, place] if place < count else ends
            best = min(best, instead + costs[other, two] - costs[other, place])
        if chosen[count + other] == other:  # this one goes on as somebody who came from nowhere
            best = min(best, costs[one, other] + begins - costs[count + other, other])
    return float(best)


def _against(earlier: Stretch, later: Stretch, start: Trail) -> float:
    """How much speaks against two stretches being of one person."""
    gap_s = later.times_s[0] - earlier.times_s[-1]
    new = later.appearance
    likeness = max(earlier.appearance.likeness(each) for each in (new.recent, *new.kept))
    ahead = against(earlier.trail, _roi(later, 0), later.times_s[0], likeness)
    back = against(start, _roi(earlier, -1), -earlier.times_s[-1], likeness)
    return 0.5 * (ahead + back) + max(gap_s - _LONG_S, 0.0)


def _leaving(trail: Trail, width: int) -> float:
    """How much speaks against somebody leaving the picture from a place."""
    x, size = trail.roi.centre_x_px, trail.roi.size_px
    away_px = min(x, width - x)
    outwards = (1.0 if x > width / 2 else -1.0) * trail.velocity[0]
    near = away_px - 0.5 * max(outwards, 0.0) < _EDGE * size
    return _LEFT if near else _VANISHED


def _roi(stretch: Stretch, number: int) -> Roi:
    roi = roi_of(stretch.rois[number])
    assert roi is not None
    return roi
