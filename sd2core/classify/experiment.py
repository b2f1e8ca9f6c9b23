"""Conditions of a comparison: share of real data, added data, and network.

Of the people who are learnt from, movements are put in a random order and parted in two.
The larger part is there as the radar saw it; of it a share is taken, whole movements, the
last one cut short. The smaller part is 0.4 times as many frames (the paper's 12,000 beside
30,000), and is there as video only: it may be added as synthetic maps. So what is added are
always other movements than the real ones, as when video is plenty and radar is scarce.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np

from sd2core.classify.data import Clip, ClipSet, frame_counts, seen_first
from sd2core.classify.defaults import DELAY_S, WIDTH
from sd2core.classify.features import Kind
from sd2core.classify.splitting import Parts, fold, movements
from sd2core.errors import Sd2Error

if TYPE_CHECKING:
    from sd2core.classify.training import TrainOptions

Added = Literal["nothing", "synthetic", "denoised", "radar"]
ADDED: tuple[Added, ...] = get_args(Added)

AMOUNT = 0.4
"""Added frames for each real one, where all real ones are taken."""

RADAR = ("simulated", "real")
"""Kinds of maps that stand for the radar's."""

Denoise = Callable[[Clip], Clip]
"""A synthetic clip as a denoiser gives it."""


@dataclass(frozen=True)
class Network:
    """Network to train."""

    model: str = "lstm"
    features: Kind = "columns"
    width: int = WIDTH  # units or channels of its layers
    delay_s: float = DELAY_S  # from a frame to its answer

    def of(self, training: TrainOptions, seed: int) -> TrainOptions:
        """Return these training options with this network and seed."""
        return replace(
            training,
            model=self.model,
            features=self.features,
            delay_s=self.delay_s,
            options={**training.options, "width": self.width},
            seed=seed,
        )


PAPER = Network("lstm", "peak", 16, 0.0)
"""Two layers of 16 units that look at the strongest bin and answer at once."""


@dataclass(frozen=True)
class Condition:
    """Condition of a training: its data and its network."""

    share: float = 1.0  # of the real frames, 0 to 1
    added: Added = "nothing"
    """Maps of the other movements that are added. ``radar`` is what the radar saw of them, which
    is what synthetic maps are at best."""
    moved: bool = False
    """Range synthesis: the added ones also as other placements of the sensor see them."""
    network: Network = field(default_factory=Network)

    def __post_init__(self) -> None:
        if not 0.0 <= self.share <= 1.0 or (self.share == 0.0 and self.added == "nothing"):
            raise Sd2Error(
                f"{self.share:g} of the real data, with {self.added} added",
                "0 to 1, with something added where it is 0",
            )
        if self.added not in ADDED:
            raise Sd2Error(f"{self.added!r} is to be added", f"one of {', '.join(ADDED)}")

    @classmethod
    def from_json(cls, content: Mapping[str, Any]) -> Condition:
        """Parse the fields by name; raises TypeError."""
        return cls(**{**content, "network": Network(**content["network"])})


@dataclass(frozen=True, eq=False)
class Chosen:
    """Clips of one run, by their use; real and added ones are both learnt from."""

    real: tuple[Clip, ...]
    added: tuple[Clip, ...]
    validation: tuple[Clip, ...]  # of the radar, each movement's own sensor
    test: tuple[Clip, ...]  # likewise
    moved: tuple[Clip, ...]  # test movements as the radar saw them from elsewhere
    by_movement: bool  # see sd2core.classify.splitting.Parts


def choose(
    known: ClipSet, condition: Condition, seed: int, denoise: Denoise, *, same_people: bool = False
) -> Chosen:
    """Choose the clips of one run, reproducibly; a larger share includes a smaller one.

    ``known`` holds the radar's and the synthetic maps of the same movements. The seed
    determines the test subjects as well, or with ``same_people`` the test movements.
    """
    parts = fold(known, seed, same_people=same_people)
    real_pool, added_pool = _pools(known, parts, seed)
    first = seen_first(known.clips)
    seen = [clip for clip in parts.training if clip.kind in RADAR and first(clip)]
    by_key: dict[tuple[str, str], list[Clip]] = {}
    for clip in seen:
        by_key.setdefault(clip.key, []).append(clip)
    real = _first([clip for key in real_pool for clip in by_key.get(key, [])], condition.share)
    validation = [clip for clip in parts.validation if clip.kind in RADAR and first(clip)]
    test = [clip for clip in parts.test if clip.kind in RADAR]
    return Chosen(
        real=real,
        added=_added(
            [clip for clip in parts.training if condition.moved or first(clip)],
            set(added_pool),
            condition,
            denoise,
        ),
        validation=_whole(validation, condition.share),
        test=tuple(clip for clip in test if first(clip)),
        moved=tuple(clip for clip in test if not first(clip)),
        by_movement=parts.by_movement,
    )


def has_synthetic(known: ClipSet) -> bool:
    """Tell if there are synthetic maps to add."""
    return "synthetic" in known.kinds


def digest(known: ClipSet) -> str:
    """Hash of the clips, independent of file names."""
    sums = hashlib.blake2b(digest_size=16)
    head = [known.classes, known.axis.bins, known.axis.v_max_mps, known.null_bins]
    sums.update(json.dumps([*head, known.frame_rate_hz]).encode())
    for clip in known.clips:
        sums.update(
            json.dumps([clip.title, clip.kind, clip.placement, clip.energies.shape]).encode()
        )
        sums.update(np.ascontiguousarray(clip.energies).data)
        sums.update(np.ascontiguousarray(clip.label).data)
    return sums.hexdigest()


def counts_of(clips: Sequence[Clip], known: ClipSet) -> dict[str, int]:
    """Count the frames per class, by name."""
    counts = frame_counts(clips, len(known.classes)).tolist()
    return dict(zip(known.classes, counts, strict=True))


def _pools(
    known: ClipSet, parts: Parts, seed: int
) -> tuple[list[tuple[str, str]], list[tuple[str, str]]]:
    """Split the movements into real ones and ones to add, each in random order."""
    keys = movements([clip for clip in parts.training if clip.kind in RADAR])
    if not keys:
        raise Sd2Error("There is no map of a radar to learn from", "labelled maps of a radar")
    order = np.random.default_rng([seed, 0]).permutation(len(keys))
    keys = [keys[number] for number in order]
    if not has_synthetic(known):
        return keys, []
    count = min(max(round(len(keys) * AMOUNT / (1.0 + AMOUNT)), 1), len(keys) - 1)
    return keys[: len(keys) - count], keys[len(keys) - count :]


def _added(
    clips: Sequence[Clip], pool: set[tuple[str, str]], condition: Condition, denoise: Denoise
) -> tuple[Clip, ...]:
    if condition.added == "nothing":
        return ()
    kinds = RADAR if condition.added == "radar" else ("synthetic",)
    found = [clip for clip in clips if clip.key in pool and clip.kind in kinds]
    if not found:
        raise Sd2Error(
            f"The data hold no {condition.added} maps to add", "pairs, or recordings with a mesh"
        )
    return tuple(map(denoise, found)) if condition.added == "denoised" else tuple(found)


def _first(clips: Sequence[Clip], share: float) -> tuple[Clip, ...]:
    """Return the first clips that hold a share of the frames; the last one is cut short."""
    left = round(share * sum(map(len, clips)))
    found = []
    for clip in clips:
        if left <= 0:
            break
        found.append(clip if len(clip) <= left else clip.until(left))
        left -= len(clip)
    return tuple(found)


def _whole(clips: Sequence[Clip], share: float) -> tuple[Clip, ...]:
    """Return that share of the clips, at least one, so validation data shrinks with the rest."""
    return tuple(clips[: max(1, round(share * len(clips)))])
