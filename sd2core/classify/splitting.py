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

    Parameters
    ----------
    known : ClipSet
        What is split.
    validation, test : sequence of str, optional
        Subjects of these parts; by default see :func:`sd2core.train.data.split_subjects`.
    first_only : bool
        True if the training part, too, holds only what each movement's own sensor saw, or the
        first one where it was not its own; validation and test always do.

    Raises
    ------
    Sd2Error
        If a subject is unknown or named twice, nobody is left to learn from, or of one subject no
        class has two movements.
    """
    if not known.clips:
        raise Sd2Error("The maps show nobody at any time", "frames with a person")
    split = split_subjects(known.subjects, validation, test)
    parts = {name: known.of(getattr(split, name)) for name in ("training", "validation", "test")}
    if split.by_take:
        kept = _kept_movements(known, parts["training"])
        parts["training"], parts["validation"] = (
            tuple(clip for clip in parts["training"] if (clip.key in kept) == checks)
            for checks in (False, True)
        )
    for name, clips in parts.items():
        if first_only or name != "training":
            parts[name] = tuple(filter(seen_first(clips), clips))
    return Parts(**parts, by_movement=split.by_take)


def dealt(known: ClipSet, clips: Sequence[Clip], parts: int, seed: int) -> dict[Movement, int]:
    """Deal the movements of every class into parts; return the part of each, 0 and up.

    A movement counts as one of the rarest class that it holds.

    Parameters
    ----------
    known : ClipSet
        Whose classes they are.
    clips : sequence of Clip
        Whose movements are dealt.
    parts : int
        Number of parts.
    seed : int
        Of the order in which the movements of a class are dealt.
    """
    part_of: dict[Movement, int] = {}
    for number, keys in by_rarest(known, clips).items():
        order = np.random.default_rng([seed, number]).permutation(len(keys))
        # The next class goes on where this one has ended, so that parts are of one size.
        part_of |= {keys[place]: (len(part_of) + at) % parts for at, place in enumerate(order)}
    return part_of


def _kept_movements(known: ClipSet, clips: Sequence[Clip]) -> set[Movement]:
    """Choose a fifth of the movements of every class that has two or more, at least one.

    A movement counts as one of the rarest class that it holds.
    """
    kept: set[Movement] = set()
    for keys in by_rarest(known, clips).values():
        if len(keys) > 1:
            count = max(1, len(keys) // 5)
            kept |= {keys[step * len(keys) // count] for step in range(count)}
    if not kept:
        alone = len(known.subjects) == 1
        whose = f"There is one subject, {known.subjects[0]}" if alone else "No subject is kept out"
        raise Sd2Error(
            f"{whose}, and no class is in two recordings or takes",
            "one to learn from and one to check with",
            "Give one more, of another subject (ben=FILE) or the same",
        )
    return kept


def by_rarest(known: ClipSet, clips: Sequence[Clip]) -> dict[int, list[Movement]]:
    """Return the movements by the rarest class that each holds."""
    total = frame_counts(clips, len(known.classes))
    own: dict[Movement, Any] = {}
    for clip in clips:
        own[clip.key] = own.get(clip.key, 0) + frame_counts([clip], len(known.classes))
    movements: dict[int, list[Movement]] = {}
    for key, counts in own.items():
        rarest = int(np.where(counts > 0, total, np.iinfo(np.int64).max).argmin())
        movements.setdefault(rarest, []).append(key)
    return movements
