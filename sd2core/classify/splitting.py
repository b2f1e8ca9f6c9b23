"""Who is learnt from, who chooses the best moment, who is judged: people, never frames."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from sd2core.classify.data import Clip, ClipSet
from sd2core.errors import Sd2Error
from sd2core.train.data import split_subjects


@dataclass(frozen=True, eq=False)
class Parts:
    """Clips by what they are for; no movement of one part is in another.

    Parameters
    ----------
    training, validation, test : tuple of Clip
    by_movement : bool
        True with one subject: then movements are kept apart, not people, and what is
        measured says nothing about other people.
    """

    training: tuple[Clip, ...]
    validation: tuple[Clip, ...]
    test: tuple[Clip, ...]
    by_movement: bool

    def to_json(self) -> dict[str, Any]:
        """Who is in which part."""
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
    validation, test : sequence of str, optional
        As :func:`sd2core.train.data.split_subjects` has them.
    first_only : bool
        Learn only from what every movement's own sensor saw; validation and test always
        do.

    Raises
    ------
    Sd2Error
        When a subject is unknown, or there is too little to split.
    """
    split = split_subjects(known.subjects, validation, test)
    parts = {name: known.of(getattr(split, name)) for name in ("training", "validation", "test")}
    if split.by_take:
        parts["training"], parts["validation"] = _by_movement(known, parts["training"])
    for name, clips in parts.items():
        if first_only or name != "training":
            parts[name] = tuple(clip for clip in clips if clip.placement == 0)
    return Parts(**parts, by_movement=split.by_take)


def _by_movement(
    known: ClipSet, clips: tuple[Clip, ...]
) -> tuple[tuple[Clip, ...], tuple[Clip, ...]]:
    """The last fifth of the movements of every class apart, where a class has two or more.

    A movement counts as one of the rarest class that it holds.
    """
    groups: dict[int, list[tuple[str, str]]] = {}
    for key, label in _rarest(known, clips).items():
        groups.setdefault(label, []).append(key)
    kept = {
        key for keys in groups.values() if len(keys) > 1 for key in keys[-max(1, len(keys) // 5) :]
    }
    if not kept:
        raise Sd2Error(
            "There is no class of which there are two movements",
            "one movement of a class to learn from and one to choose the best moment by",
        )
    return (
        tuple(clip for clip in clips if clip.key not in kept),
        tuple(clip for clip in clips if clip.key in kept),
    )


def _rarest(known: ClipSet, clips: Sequence[Clip]) -> dict[tuple[str, str], int]:
    """Of every movement the class that has the fewest frames in all, of those it holds."""
    from sd2core.classify.data import frame_counts

    counts = frame_counts(clips, len(known.classes))
    found: dict[tuple[str, str], int] = {}
    for clip in clips:
        own = frame_counts([clip], len(known.classes))
        rarest = min(
            (one for one in range(len(own)) if own[one]), key=counts.__getitem__, default=-1
        )
        before = found.get(clip.key, rarest)
        found[clip.key] = min(before, rarest, key=lambda one: counts[one] if one >= 0 else 1 << 60)
    return found
