"""Split of people into training, validation and test by their names."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence

from sd2core.datasets.layout import SPLITS
from sd2core.train.data import Split, split_subjects

RULE = (
    "Each person's number, from 0 to 1, is the first eight bytes of the SHA-256 of their name:"
    " below a sixth they test, below a third they validate, otherwise they train. So adding a"
    " person moves no one else. But at least one person tests (where there are three) and one"
    " validates, and at most a third of all each: where the numbers alone would give another"
    " split, the people with the nearest numbers are moved."
)

_SHARE = 1 / 6


def split_people(
    subjects: Sequence[str],
    validation: Sequence[str] | None = None,
    test: Sequence[str] | None = None,
) -> Split:
    """Split people into training, validation and test; those not named by :data:`RULE`."""
    free = [name for name in subjects if name not in {*(validation or ()), *(test or ())}]
    most = max(1, len(subjects) // 3)
    if test is None:
        # Two people are needed to learn and to choose.
        spare = len(free) - (2 if validation is None else 1)
        test = _chosen(free, lambda number: (_SHARE - number) % 1.0, min(most, spare))
        free = [name for name in free if name not in test]
    if validation is None:
        validation = _chosen(free, lambda number: (number - _SHARE) % 1.0, min(most, len(free) - 1))
    return split_subjects(subjects, validation, test)


def named_splits(split: Split) -> dict[str, tuple[str, ...]]:
    """People of every split by its name in a data set."""
    return dict(zip(SPLITS, (split.training, split.validation, split.test), strict=True))


def reassigned(splits: Mapping[str, Sequence[str]]) -> list[str]:
    """Return the people that the rule alone would put elsewhere, in its order."""
    own = {name: [one for one in names if _own(one) == name] for name, names in splits.items()}
    return sorted(
        (one for name, names in splits.items() for one in names if one not in own[name]),
        key=number_of,
    )


def number_of(name: str) -> float:
    """Hash a person's name to a number from 0 to 1."""
    digest = hashlib.sha256(name.encode("utf-8")).digest()
    return int.from_bytes(digest[:8], "big") / 2.0**64


def _own(name: str) -> str:
    number = number_of(name)
    if number < _SHARE:
        return "test"
    return "validation" if number < 2 * _SHARE else "train"


def _chosen(people: Sequence[str], away: Callable[[float], float], most: int) -> list[str]:
    """Choose those within a sixth: at least the nearest one, at most the ``most`` nearest."""
    far = {name: away(number_of(name)) for name in people}
    count = max(sum(one < _SHARE for one in far.values()), 1)
    chosen = sorted(people, key=far.__getitem__)[: max(0, min(count, most))]
    return [name for name in people if name in chosen]
