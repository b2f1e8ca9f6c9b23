"""Folds of a study: what is judged, of what there is only video, and whose radar is there.

Groups are people, or parts into which all movements are dealt. One is judged, of another there is
only video, and of all others there are maps of the radar. Of these a share is taken, equally much
of every class.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import permutations
from typing import Literal

import numpy as np

from sd2core.classify.data import UNKNOWN, ClipSet
from sd2core.classify.metrics import gesture_runs
from sd2core.classify.splitting import by_rarest, dealt
from sd2core.errors import Sd2Error
from sd2core.labels.per_frame import BACKGROUND
from sd2core.study.data import Movement

Group = str
NOBODY: Group = ""


@dataclass(frozen=True)
class Fold:
    """Division of the groups."""

    judged: Group
    video: Group  # Whose radar is not looked at, but for the yardstick; perhaps nobody.
    real: tuple[Group, ...]


def folds_of(
    groups: Sequence[Group], *, filmed: bool, turns: Literal["all", "once"] = "all"
) -> list[Fold]:
    """Return the folds of some groups, with a group that is ``filmed`` or without."""
    least = 3 if filmed else 2
    if len(groups) < least:
        raise Sd2Error(
            f"The study keeps {len(groups)} apart: {', '.join(groups)}",
            "three or more: one is judged, one is filmed only, of the others there is a radar"
            if filmed
            else "two or more: one is judged, the others are learnt from",
            'Give more people, or more movements of the same people with folds = "files"',
        )
    if not filmed:
        pairs = [(one, NOBODY) for one in groups]
    elif turns == "all":
        pairs = list(permutations(groups, 2))
    else:
        pairs = list(zip(groups, [*groups[1:], groups[0]], strict=True))
    return [
        Fold(judged, video, tuple(one for one in groups if one not in (judged, video)))
        for judged, video in pairs
    ]


def groups_of(
    known: ClipSet, movements: Sequence[Movement], parts: int | None, seed: int
) -> Mapping[tuple[str, str], Group]:
    """Return the group of every movement: its person, or one of so many parts.

    Parameters
    ----------
    known : ClipSet
        The classes, of which every part gets its share.
    movements : sequence of Movement
    parts : int or None
        Number of parts; None: people are the groups.
    seed : int
        By which movements are dealt.

    Returns
    -------
    mapping of (str, str) to str
        By the key of a movement's clip.
    """
    clips = [one.clip for one in movements]
    if parts is None:
        return {clip.key: clip.subject for clip in clips}
    return {key: f"part {number + 1}" for key, number in dealt(known, clips, parts, seed).items()}


def share_of(
    known: ClipSet, movements: Sequence[Movement], share: float, seed: int
) -> list[Movement]:
    """Draw a share of every class; a larger one of the same seed includes a smaller one.

    Of movements beside background whole ones are drawn. Without background there are runs of one
    class, in random order; of these the last is cut short.

    Parameters
    ----------
    known : ClipSet
    movements : sequence of Movement
    share : float
        Of the frames of each class, or of its movements beside background; above 0, up to 1.
    seed : int
    """
    if BACKGROUND in known.classes:
        return _whole(known, movements, share, seed)
    runs_of: dict[int, list[Movement]] = {}
    for one in movements:
        for start, stop, number in gesture_runs(one.clip.label, UNKNOWN):
            runs_of.setdefault(number, []).append(one.part(slice(start, stop)))
    drawn = []
    for number, own in sorted(runs_of.items()):
        order = np.random.default_rng([seed, number]).permutation(len(own))
        left = max(1, round(share * sum(len(one.clip) for one in own)))
        for one in (own[place] for place in order):
            if left <= 0:
                break
            drawn.append(one if len(one.clip) <= left else one.part(slice(left)))
            left -= len(drawn[-1].clip)
    return drawn


def _whole(
    known: ClipSet, movements: Sequence[Movement], share: float, seed: int
) -> list[Movement]:
    drawn: set[tuple[str, str]] = set()
    for number, keys in by_rarest(known, [one.clip for one in movements]).items():
        order = np.random.default_rng([seed, number]).permutation(len(keys))
        drawn |= {keys[place] for place in order[: max(1, round(share * len(keys)))]}
    return [one for one in movements if one.clip.key in drawn]
