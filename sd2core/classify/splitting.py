"""Split of clips by people: training, validation and test."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sd2core.classify.data import Clip, ClipSet, frame_counts, seen_first
from sd2core.errors import Sd2Error
from sd2core.train.data import split_subjects

Movement = tuple[str, str]
"""Subject and name of a movement, see :attr:`~sd2core.classify.data.Clip.key`."""

_LEAST_SUBJECTS = 3
"""To learn, to choose and to judge."""


@dataclass(frozen=True, eq=False)
class Parts:
    """Clips of training, validation and test; no movement is in two parts."""

    training: tuple[Clip, ...]
    validation: tuple[Clip, ...]
    test: tuple[Clip, ...]
    by_movement: bool
    """True with one subject or the same people: movements are kept apart, not people, and the
    score says nothing about other people."""

    def to_json(self) -> dict[str, Any]:
        """Return the subjects of each part."""
        return {
            "by_movement": self.by_movement,
            **{
                name: list(dict.fromkeys(clip.subject for clip in getattr(self, name)))
                for name in ("training", "validation", "test")
            },
        }


def split_clips(
    known: ClipSet,
    validation: Sequence[str] | None = None,
    test: Sequence[str] | None = None,
    *,
    first_only: bool = False,
) -> Parts:
    """Split by subject, or with one subject by movement.

    ``validation`` and ``test`` are subjects, see :func:`sd2core.train.data.split_subjects`.
    With ``first_only`` the training part, too, holds only what each movement's own sensor
    saw, or the first one where it was not its own; validation and test always do.
    """
    split = split_subjects(known.subjects, validation, test)
    parts = {name: known.of(getattr(split, name)) for name in ("training", "validation", "test")}
    if split.by_take:
        kept = _kept_movements(known, parts["training"], fold=0, share=0.2)
        parts["training"], parts["validation"] = _apart(parts["training"], kept)
    for name, clips in parts.items():
        if first_only or name != "training":
            parts[name] = tuple(filter(seen_first(clips), clips))
    return Parts(**parts, by_movement=split.by_take)


def fold(known: ClipSet, number: int, *, same_people: bool = False) -> Parts:
    """Split for one fold of a cross-validation, so that everyone is tested in turn.

    With three subjects or more the list of subjects is turned by ``number``, and split as
    by default. With two, one is learnt from and one judged. With one, every class gives
    half of its movements to the test, in the next fold the others: halves that every pair
    of folds draws anew. With ``same_people`` every class gives a sixth of its movements to
    validation and as many to the test, as six people would, drawn anew by every fold.
    """
    if same_people:
        drawn = _shuffled(known.clips, number)
        rest, test = _apart(known.clips, _kept_movements(known, drawn, 0, share=1 / 6))
        kept = {clip.key for clip in rest}
        drawn = [clip for clip in drawn if clip.key in kept]
        return Parts(*_apart(rest, _kept_movements(known, drawn, 0, share=1 / 5)), test, True)
    subjects = list(known.subjects)
    turned = number % len(subjects)
    subjects = [*subjects[turned:], *subjects[:turned]]
    if len(subjects) >= _LEAST_SUBJECTS:
        split = split_subjects(subjects)
        return Parts(
            known.of(split.training), known.of(split.validation), known.of(split.test), False
        )
    if len(subjects) > 1:
        return Parts(known.of(subjects[:1]), (), known.of(subjects[1:]), False)
    drawn = _shuffled(known.clips, number // 2)
    training, test = _apart(known.clips, _kept_movements(known, drawn, number % 2, share=0.5))
    return Parts(training, (), test, True)


def movements(clips: Sequence[Clip]) -> list[Movement]:
    """Return the movements of clips, each once, in order."""
    return list(dict.fromkeys(clip.key for clip in clips))


def _shuffled(clips: Sequence[Clip], seed: int) -> list[Clip]:
    return [clips[at] for at in np.random.default_rng(seed).permutation(len(clips))]


def _apart(clips: Sequence[Clip], kept: set[Movement]) -> tuple[tuple[Clip, ...], tuple[Clip, ...]]:
    return (
        tuple(clip for clip in clips if clip.key not in kept),
        tuple(clip for clip in clips if clip.key in kept),
    )


def _kept_movements(
    known: ClipSet, clips: Sequence[Clip], fold: int, share: float
) -> set[Movement]:
    """Choose a share of the movements of every class that has two or more, at least one.

    A movement counts as one of the rarest class that it holds.
    """
    groups: dict[int, list[Movement]] = {}
    for key, label in _rarest(known, clips).items():
        groups.setdefault(label, []).append(key)
    kept: set[Movement] = set()
    for keys in groups.values():
        if len(keys) > 1:
            count = max(1, int(share * len(keys)))
            kept |= {keys[(fold + step * len(keys) // count) % len(keys)] for step in range(count)}
    if not kept:
        raise Sd2Error(
            "There is one subject, and no class of which there are two movements",
            "two subjects, or two movements of a class",
        )
    return kept


def _rarest(known: ClipSet, clips: Sequence[Clip]) -> dict[Movement, int]:
    """Return the rarest class that every movement holds."""
    total = frame_counts(clips, len(known.classes))
    own: dict[Movement, Any] = {}
    for clip in clips:
        own[clip.key] = own.get(clip.key, 0) + frame_counts([clip], len(known.classes))
    return {
        key: int(np.where(counts > 0, total, np.iinfo(np.int64).max).argmin())
        for key, counts in own.items()
    }
