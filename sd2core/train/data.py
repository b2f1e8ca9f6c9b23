"""Segments of pairs for training, for the choice of the best epoch, and for the test."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sd2core.denoise.metrics import stands_out
from sd2core.denoise.resample_to_model import is_same_rate
from sd2core.errors import Sd2Error
from sd2core.files.paths import check_distinct
from sd2core.maps import peak_velocity_mps
from sd2core.options.training import DataConfig
from sd2core.pairs.rows import UNKNOWN
from sd2core.pairs.segments import cut, segment_starts
from sd2core.pairs.store import PairSet, Take, read_pairs
from sd2core.pairs.summary import names_together, pair_facts
from sd2core.sensor import VelocityAxis

_LARGEST_WEIGHT, _MIN_LEVEL = 8.0, 1e-3


@dataclass(frozen=True)
class Split:
    """Disjoint groups of people for training, for choosing the best epoch, and for testing."""

    training: tuple[str, ...]
    validation: tuple[str, ...]
    test: tuple[str, ...]
    by_take: bool = False
    """True without people for validation, as with one subject: the last fifth of everyone's takes,
    or of the one take there is, is used instead, and the errors say nothing about other people."""


@dataclass(frozen=True, eq=False)
class Segments:
    """Windows of equal length."""

    inputs: NDArray[np.float32]  # synthetic, (segments, length, features)
    targets: NDArray[np.float32]  # of the radar
    moving: NDArray[np.bool_]  # (segments, length); the radar shows more than noise

    def __len__(self) -> int:
        return len(self.inputs)


@dataclass(frozen=True, eq=False)
class Windows:
    """Segments that are cut while learning, so that they may lie elsewhere in every epoch."""

    inputs: NDArray[np.float32]  # (frames, features), all takes one after another
    targets: NDArray[np.float32]  # (frames, bins)
    earliest: NDArray[np.int64]
    """Bounds, shape (segments,), of the first frame of every segment: within half a step of its
    own place, and within its take."""
    latest: NDArray[np.int64]
    length: int
    levels: NDArray[np.float64]  # (frames,), mean energy of a frame of each frame's take

    def __len__(self) -> int:
        return len(self.earliest)

    def places(self, indices: NDArray[np.int64], shares: NDArray[np.float64]) -> NDArray[np.int64]:
        """Start frames of segments, from shares in [0, 1) of the range from earliest to latest."""
        earliest = self.earliest[indices]
        room = self.latest[indices] - earliest + 1
        return earliest + (shares * room).astype(np.int64)


@dataclass(frozen=True, eq=False)
class TrainingData:
    """Training and validation data of a run."""

    pairs: PairSet  # with those of the unseen subjects
    split: Split
    training: Windows
    validation: Segments
    training_takes: tuple[Take, ...]  # sources of the training segments
    parts: tuple[str, ...] = ()  # of the body, whose limb maps are the input; none: the map is

    @property
    def digest(self) -> str:
        """Hash of the segments, independent of the names of their files."""
        sums = hashlib.blake2b(digest_size=16)
        learnt, chosen_by = self.training, self.validation
        places = (learnt.earliest, learnt.latest)
        for values in (learnt.inputs, learnt.targets, *places, chosen_by.inputs, chosen_by.targets):
            sums.update(str(values.shape).encode())
            sums.update(np.ascontiguousarray(values).data)
        return sums.hexdigest()


def read_mixed(paths: Sequence[Path]) -> PairSet:
    """Read one or several stores of pairs as one, each once.

    People are called as :func:`~sd2core.pairs.summary.names_together` says. Labels are those of all
    stores. What holds anything simulated is called simulated. Raises Sd2Error if axes, frame rates
    or null bins differ, or two are links to one.
    """
    paths = list(dict.fromkeys(paths))
    check_distinct(paths)
    sets = [read_pairs(path) for path in paths]
    first = sets[0]
    if len(sets) == 1:
        return first
    for path, other in zip(paths[1:], sets[1:], strict=True):
        rates = (f"{first.frame_rate_hz:g} Hz", f"{other.frame_rate_hz:g} Hz")
        if is_same_rate(first.frame_rate_hz, other.frame_rate_hz):
            rates = (rates[0], rates[0])
        for what, mine, theirs in (
            ("velocity axis", first.axis.words, other.axis.words),
            ("frame rate", *rates),
            ("null bins", str(list(first.null_bins)), str(list(other.null_bins))),
        ):
            if mine != theirs:
                raise Sd2Error(
                    f"The pairs cannot be mixed: the {what} of {paths[0]} is {mine}, that of"
                    f" {path} is {theirs}",
                    "the same in all of them",
                    "Make one of them again with the settings of the other",
                )
    labels = tuple(dict.fromkeys(label for one in sets for label in one.labels))
    takes = tuple(
        replace(
            take,
            subject=names[take.subject],
            label=np.array([*map(labels.index, one.labels), UNKNOWN], np.int8)[take.label],
        )
        for names, one in zip(names_together([*map(pair_facts, paths)]), sets, strict=True)
        for take in one.takes
    )
    simulated = any(one.kind == "simulated" for one in sets)
    return replace(
        first,
        kind="simulated" if simulated else "real",
        labels=labels,
        takes=takes,
        provenance={"mixed": [one.provenance for one in sets]},
    )


def split_subjects(
    subjects: Sequence[str],
    validation: Sequence[str] | None = None,
    test: Sequence[str] | None = None,
) -> Split:
    """Split people into training and held-out parts.

    By default a sixth of the subjects, at least one, is kept for the test (where there are
    three or more) and as many for validation, from the end of the list. Raises Sd2Error if
    a subject is unknown or named twice, or none is left to learn from.
    """
    subjects = list(subjects)
    for key, named in (("validation", validation), ("test", test)):
        for name in named or ():
            if name not in subjects:
                raise Sd2Error(
                    f"{name!r} is to be a {key} subject and has no takes",
                    f"some of {', '.join(subjects)}",
                )
    both = sorted(set(validation or ()) & set(test or ()))
    if both:
        raise Sd2Error(
            f"{', '.join(both)} is to validate and to test", "subjects that do one of the two"
        )
    share = max(1, len(subjects) // 6)
    free = [name for name in subjects if name not in {*(validation or ()), *(test or ())}]
    if test is None:
        # Two people are needed to learn and to choose.
        spare = len(free) - (2 if validation is None else 1)
        test = free[len(free) - max(0, min(share, spare)) :]
        free = free[: len(free) - len(test)]
    if validation is None:
        spare = len(free) - 1
        validation = free[len(free) - max(0, min(share, spare)) :]
        free = free[: len(free) - len(validation)]
    if not free:
        raise Sd2Error(
            f"Of the subjects {', '.join(subjects)} none is left to learn from",
            "a person who neither validates nor tests",
        )
    return Split(tuple(free), tuple(validation), tuple(test), by_take=not validation)


def prepare(pairs: PairSet, config: DataConfig, parts: tuple[str, ...] = ()) -> TrainingData:
    """Cut pairs into segments to learn from and to choose by.

    With ``parts`` of the body the input is their limb maps, otherwise the map. Raises Sd2Error for
    limb maps of several persons, whom the radar's map does not tell apart.

    Segments to choose by overlap only where a take's length makes them, so that every frame
    counts about once, and are of the takes' own sensors. Raises Sd2Error if the subjects
    cannot be split, no take is as long as a segment, or there are no limb maps.
    """
    for take in pairs.takes if parts else ():
        if take.limbs is not None and take.limbs.persons:
            raise Sd2Error(
                f"{take.title} shows {' and '.join(take.limbs.persons)}",
                "takes of one person, whom such a model answers",
                "Learn from the map (inputs = map), or leave out pairs of several persons",
            )
    split = split_subjects(pairs.subjects, config.validation_subjects, config.test_subjects)
    learnt = pairs.of(split.training).takes
    chosen_by = pairs.of(split.validation).takes if split.validation else ()
    if split.by_take:
        learnt, chosen_by = _by_take(learnt)
    if config.placements == "first":
        learnt = tuple(take for take in learnt if take.placement == 0)
    own = tuple(take for take in chosen_by if take.placement == 0) or chosen_by
    return TrainingData(
        pairs,
        split,
        windows_of(learnt, config, parts),
        segments_of(own, config.segment_frames, pairs.null_bins, parts),
        learnt,
        parts,
    )


def windows_of(takes: Sequence[Take], config: DataConfig, parts: Sequence[str] = ()) -> Windows:
    """All segments to learn from, in the order of their takes. Raises Sd2Error without any."""
    length, overlap = config.segment_frames, config.overlap_frames
    reach = (length - overlap) // 2 if config.segments == "shifted" else 0
    earliest, latest = [], []
    before = 0
    for take in takes:
        frames = len(take.times_s)
        own = segment_starts(frames, length, overlap)
        earliest.append(before + np.maximum(own - reach, 0))
        latest.append(before + np.minimum(own + reach, frames - length))
        before += frames
    if not sum(map(len, earliest)):
        raise _too_short(takes, length)
    return Windows(
        inputs=np.concatenate([take.inputs(parts) for take in takes]),
        targets=np.concatenate([take.radar for take in takes]),
        earliest=np.concatenate(earliest),
        latest=np.concatenate(latest),
        length=length,
        levels=np.repeat(
            [take.radar.sum(axis=1, dtype=np.float64).mean() for take in takes],
            [len(take.times_s) for take in takes],
        ),
    )


def frame_weights(windows: Windows, axis: VelocityAxis) -> NDArray[np.float32]:
    """Weights of frames by how rare the speed of their strongest bin and how weak their take is.

    Fast frames are few, and the mean square error over all of them is least for a model that shows
    them too slow. The weight is the inverse square root of the number of frames of that speed,
    smoothed over the neighbouring speeds, as in Y. Yang et al., "Delving into deep imbalanced
    regression", ICML 2021. Empty frames are a speed of their own. A squared error of amplitudes
    counts as a share of the take's mean energy: who is twice as far away is 16 times as weak. The
    mean is 1 but for weights above 8, which are 8. Shape (frames,).
    """
    speed_mps = np.abs(peak_velocity_mps(windows.targets, axis))
    empty = np.isnan(speed_mps)
    ranks = np.where(empty, 0.0, speed_mps / axis.bin_width_mps).astype(np.intp)
    counts = np.bincount(ranks[~empty], minlength=int(ranks.max(initial=0)) + 1).astype(float)
    shares = np.convolve(np.pad(counts, 1, mode="edge"), [0.25, 0.5, 0.25], mode="valid")
    of_frame = np.where(empty, np.count_nonzero(empty), shares[ranks])
    weights = 1.0 / np.sqrt(np.maximum(of_frame, 1.0))
    weights /= np.maximum(windows.levels, _MIN_LEVEL * (windows.levels.mean() or 1.0))
    return np.minimum(weights / weights.mean(), _LARGEST_WEIGHT).astype(np.float32)


def segments_of(
    takes: Sequence[Take],
    length: int,
    null_bins: Sequence[int] = (),
    parts: Sequence[str] = (),
) -> Segments:
    """All segments of some takes, in their order.

    Parameters
    ----------
    takes : sequence of Take
    length : int
        Frames, as for :func:`~sd2core.pairs.segments.segment_starts`.
    null_bins : sequence of int
        Bins that do not tell whether something moves.
    parts : sequence of str
        The input is the limb maps of these parts of the body; by default the map.

    Raises
    ------
    Sd2Error
        Without any.
    """
    inputs, targets, moving = [], [], []
    for take in takes:
        starts = segment_starts(len(take.times_s), length, 0)
        inputs.append(cut(take.inputs(parts), starts, length))
        targets.append(cut(take.radar, starts, length))
        moves = stands_out(take.radar, tuple(null_bins))
        moving.append(moves[starts[:, None] + np.arange(length)])
    if not sum(map(len, inputs)):
        raise _too_short(takes, length)
    return Segments(*(np.concatenate(parts) for parts in (inputs, targets, moving)))


def _too_short(takes: Sequence[Take], length: int) -> Sd2Error:
    longest = max((len(take.times_s) for take in takes), default=0)
    return Sd2Error(
        f"Segments are to be {length} frames long, and the longest of {len(takes)} takes has"
        f" {longest}",
        "takes that are at least as long as a segment",
        "Choose shorter segments with --segment-frames",
    )


def _by_take(takes: tuple[Take, ...]) -> tuple[tuple[Take, ...], tuple[Take, ...]]:
    """The last fifth of everyone's motions, with all their placements, apart from the others.

    If nobody has two motions, the last fifth of each.
    """
    kept: set[tuple[str, str]] = set()
    for subject in dict.fromkeys(take.subject for take in takes):
        motions = list(dict.fromkeys(take.name for take in takes if take.subject == subject))
        if len(motions) > 1:
            kept |= {(subject, name) for name in motions[-max(1, len(motions) // 5) :]}
    if not kept:
        cuts = [round(0.8 * len(take.times_s)) for take in takes]
        pairs = list(zip(takes, cuts, strict=True))
        return (
            tuple(take.part(slice(cut)) for take, cut in pairs),
            tuple(take.part(slice(cut, None)) for take, cut in pairs),
        )
    return (
        tuple(take for take in takes if (take.subject, take.name) not in kept),
        tuple(take for take in takes if (take.subject, take.name) in kept),
    )
