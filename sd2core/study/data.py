"""Data of a study: what a radar saw, of which movements there is video, and the classes."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from sd2core.body.parts import splits_everybody
from sd2core.classify.data import (
    UNKNOWN,
    Clip,
    ClipSet,
    clips_of_map,
    clips_of_pairs,
    gesture_classes,
    merged,
    seen_first,
)
from sd2core.datasets.clips import clips_of_dataset
from sd2core.datasets.labelled import clips_of_radar_file, labels_given, unfolded
from sd2core.datasets.labelled_source import LabelledSource
from sd2core.datasets.reading import open_dataset
from sd2core.datasets.recording_sources import (
    Making,
    labels_and_classes,
    radar_map,
    recording_sources,
)
from sd2core.denoise.resample_to_model import SAME_RATE
from sd2core.doppler import PRESETS
from sd2core.errors import Sd2Error
from sd2core.files.keys import all_code_digest
from sd2core.files.paths import make_folder
from sd2core.io.kinds import kind_of
from sd2core.io.radar import holds_map
from sd2core.mocap.recording_pairs import make_recording_pairs
from sd2core.pairs.labelling import TakeLabel, labelled, read_take_labels
from sd2core.pairs.store import PairSet, Take, read_pairs
from sd2core.recording.recording import Recording, open_recording
from sd2core.study.plan import StudyPlan
from sd2core.train.data import read_mixed

_NEITHER = "\n"
"""Class of labels that the plan leaves out."""


@dataclass(frozen=True, eq=False)
class Movement:
    """Map of a movement by a radar, real or simulated, and its input where known."""

    clip: Clip  # The radar's map, and the class of every frame.
    take: Take | None = None  # With the synthetic map.

    @property
    def title(self) -> str:
        """Name in results."""
        return self.clip.title

    def part(self, frames: slice) -> Movement:
        """Return some of its frames."""
        clip = replace(
            self.clip, energies=self.clip.energies[frames], label=self.clip.label[frames]
        )
        return Movement(clip, None if self.take is None else self.take.part(frames))


@dataclass(frozen=True, eq=False)
class StudyData:
    """Movements that share an axis, a frame rate and classes."""

    known: ClipSet  # Without its clips; the classes of all.
    real: tuple[Movement, ...]  # As each movement's own sensor saw it.
    # Of which there is only video where their people are filmed.
    filmed: tuple[Movement, ...]
    # Likewise, of people whom no radar saw.
    others: tuple[Movement, ...]
    pairs: PairSet | None  # Without its takes; None where there is no input to learn from.
    described: dict[Any, dict[int, Any]] = field(default_factory=dict)
    """What each learner is shown of real clips, by their identity: as long as these are there."""

    @property
    def lost_frames(self) -> int:
        """Frames of the pairs that the radar saw which are lost to damaged chunks."""
        return 0 if self.pairs is None else self.pairs.lost_frames

    @property
    def kind(self) -> str:
        """Kind of the radar."""
        kinds = {one.clip.kind for one in self.real}
        return "simulated" if "simulated" in kinds else "real"

    @property
    def people(self) -> tuple[str, ...]:
        """People whom the radar saw."""
        return tuple(dict.fromkeys(one.clip.subject for one in self.real))


_READ_FOR = {"title", "out", "data", "video", "labels", "classes", "placements"}
"""Keys of a plan that tell what is read."""


def kept_study_data(plan: StudyPlan, content: str) -> StudyData:
    """Data of a plan, read once for all plans of the same data and ``content``, a digest of it."""
    return _kept_study_data(plan.model_dump_json(include=_READ_FOR), content)


@lru_cache(maxsize=1)
def _kept_study_data(plan_text: str, content: str) -> StudyData:
    return study_data_of(StudyPlan.model_validate_json(plan_text))


def study_data_of(plan: StudyPlan) -> StudyData:
    """Read the data of a plan whose paths are absolute."""
    stores, sets, takes, own = _sources(plan)
    names = {name for one in sets for name in one.classes}
    pairs = None
    if stores:
        pairs = _labelled(read_mixed(stores), plan)
        names |= {*pairs.labels}
        sets.append(_clips(pairs, plan, own))
        takes += pairs.takes
    if strange := [label for label in plan.classes if label not in names]:
        raise Sd2Error(
            f"No frame is labelled {', '.join(strange)}", f"some of {', '.join(sorted(names))}"
        )
    seen = _of_the_classes(merged(sets), plan)
    moves = [
        Movement(clip, take)
        for clip, take in zip(seen.clips, takes, strict=True)
        if (clip.label != UNKNOWN).any()
    ]
    first = seen_first(one.clip for one in moves)
    filmed = [one for one in moves if one.take is not None and (plan.placements or first(one.clip))]
    others: list[Movement] = []
    people = {one.clip.subject for one in moves}
    for path in plan.video:
        for one in _filmed(Path(path), plan, seen, own):
            (filmed if one.clip.subject in people else others).append(one)
    return StudyData(
        replace(seen, clips=()),
        tuple(one for one in moves if first(one.clip)),
        tuple(filmed),
        tuple(others),
        None if pairs is None else replace(pairs, takes=()),
    )


def _sources(
    plan: StudyPlan,
) -> tuple[list[Path], list[ClipSet], list[Take | None], dict[str, str]]:
    """Stores of pairs, sets of what a radar saw, and a take for each of their clips or none.

    And the class of every label of the recordings of which pairs are made, which hold no classes.
    """
    stores: list[Path] = []
    sets: list[ClipSet] = []
    takes: list[Take | None] = []
    with_mesh: list[tuple[Path, str]] = []
    own: dict[str, str] = {}
    for one in unfolded([LabelledSource.parsed(text) for text in plan.data]):
        rate_hz = sets[0].frame_rate_hz if sets else None
        kind = kind_of(one.path)
        if kind == "pairs":
            stores.append(one.path)
        elif kind == "dataset":
            radar, inputs = _of_dataset(one.path)
            sets.append(radar)
            takes += inputs
        elif holds_map(one.path):
            sets.append(clips_of_radar_file(one, rate_hz))
        elif kind == "recording":
            recording = open_recording(one.path)
            if recording.mesh is not None and not recording.holds_radar_map:
                with_mesh.append((one.path, one.subject))
                names, classes = labels_and_classes(recording.labelled)
                own |= {name: classes.get(name, _NEITHER) for name in names}
            else:
                sets.append(_of_recording(recording, one.subject, rate_hz))
        else:
            raise Sd2Error(
                f"{one.path} is a {kind}",
                "pairs, data sets, labelled recordings with a radar, or labelled radar files",
            )
        takes += [None] * (sum(len(each.clips) for each in sets) - len(takes))
    if with_mesh:
        stores.append(_made_pairs(Path(plan.out), *zip(*with_mesh, strict=True)))
    return stores, sets, takes, own


def _made_pairs(out: Path, paths: Sequence[Path], names: Sequence[str]) -> Path:
    """Pairs of recordings, made anew where these are others, or they or the code have changed."""
    sources = recording_sources(paths, names, Making(("synthetic", "simulated", "real")))
    content = json.dumps([all_code_digest(), *([*one.key, one.fingerprint()] for one in sources)])
    made = out / f"pairs-{hashlib.blake2b(content.encode(), digest_size=8).hexdigest()}.zarr"
    if not made.exists():
        make_folder(out)
        begun = made.with_name(f"begun-{made.name}")
        limbs = all(splits_everybody(open_recording(path).load_mesh()) for path in paths)
        make_recording_pairs(paths, begun, PRESETS["paper"], subjects=names, limbs=limbs)
        begun.rename(made)
    return made


def _of_recording(recording: Recording, subject: str, rate_hz: float | None) -> ClipSet:
    labels = recording.effective_labels()
    labels_given(labels, recording.folder)
    return clips_of_map(
        radar_map(recording, None), labels, subject=subject,
        movement=recording.folder.stem, frame_rate_hz=rate_hz,
    )  # fmt: skip


def _of_dataset(path: Path) -> tuple[ClipSet, list[Take | None]]:
    """Maps of the radar, and a take with the synthetic map of each clip, where there is one."""
    with open_dataset(path) as dataset:
        kind = next((one for one in dataset.header.kinds if one in ("real", "simulated")), None)
        if kind is None:
            raise Sd2Error(f"{path} holds no maps of a radar", "maps that a radar saw")
        seen = clips_of_dataset(dataset, kind)
        if "synthetic" not in dataset.header.kinds:
            return seen, [None] * len(seen.clips)
        shown = clips_of_dataset(dataset, "synthetic")
    waiting: dict[tuple[str, str, int], list[Clip]] = {}
    for clip in shown.clips:
        waiting.setdefault((*clip.key, clip.placement), []).append(clip)
    takes: list[Take | None] = []
    for clip in seen.clips:
        alike = waiting.get((*clip.key, clip.placement), [])
        # A movement may have several clips; those of both kinds are cut alike, and in order.
        at = next((n for n, one in enumerate(alike) if np.array_equal(one.label, clip.label)), None)
        takes.append(None if at is None else _take(alike.pop(at), clip, seen.frame_rate_hz))
    return seen, takes


def _take(shown: Clip, seen: Clip, rate_hz: float) -> Take:
    frames = len(seen)
    return Take(
        seen.subject, seen.movement, shown.energies, seen.energies, np.arange(frames) / rate_hz,
        np.zeros(frames, np.int8), np.zeros(3), seen.placement,
    )  # fmt: skip


def _filmed(
    path: Path, plan: StudyPlan, seen: ClipSet, classes: Mapping[str, str]
) -> list[Movement]:
    """Movements of pairs or a data set of which there is only video."""
    if kind_of(path) == "dataset":
        made, inputs = _of_dataset(path)
    else:
        pairs = read_pairs(path)
        rows = [] if plan.labels is None else read_take_labels(Path(plan.labels))
        own = [row for row in rows if any(_is_of(row, one) for one in pairs.takes)]
        pairs = labelled(pairs, own) if own else pairs
        made, inputs = _clips(pairs, plan, classes), list(pairs.takes)
    _check_alike(path, made, seen)
    return [
        Movement(clip, take)
        for clip, take in zip(_renumbered(made, seen.classes), inputs, strict=True)
        if (clip.label != UNKNOWN).any()
    ]


def _is_of(row: TakeLabel, take: Take) -> bool:
    return fnmatchcase(take.subject, row.subject) and fnmatchcase(take.name, row.take)


def _labelled(pairs: PairSet, plan: StudyPlan) -> PairSet:
    if plan.labels is None:
        return pairs
    return labelled(pairs, read_take_labels(Path(plan.labels)))


def _clips(pairs: PairSet, plan: StudyPlan, own: Mapping[str, str]) -> ClipSet:
    """Maps of the radar; labels have the classes of the plan, their ``own``, or the usual ones."""
    usual = zip(pairs.labels, gesture_classes(pairs.labels), strict=True)
    names: Sequence[str] = [own.get(label, name) for label, name in usual]
    if plan.classes:
        names = [plan.classes.get(label, _NEITHER) for label in pairs.labels]
    return clips_of_pairs(pairs, pairs.kind, names=names)


def _of_the_classes(known: ClipSet, plan: StudyPlan) -> ClipSet:
    """Keep the classes of the plan that occur; frames of others are unknown."""
    occurring = {known.classes[n] for clip in known.clips for n in np.unique(clip.label) if n >= 0}
    given: Mapping[str, str] = {**plan.classes, **{one: one for one in plan.classes.values()}}
    names = [given.get(one, _NEITHER) if plan.classes else one for one in known.classes]
    kept = tuple(dict.fromkeys(
        name for one, name in zip(known.classes, names, strict=True)
        if name != _NEITHER and one in occurring
    ))  # fmt: skip
    if len(kept) < 2:
        raise Sd2Error(
            f"The data hold the classes {', '.join(kept) or 'none'}",
            "two or more",
            "Label pairs with `sd2 pairs label`, recordings in the window",
        )
    clips = _renumbered(replace(known, classes=tuple(names)), kept)
    return replace(known, classes=kept, clips=tuple(clips))


def _renumbered(known: ClipSet, classes: Sequence[str]) -> list[Clip]:
    """Give frames the numbers of other classes; those of none are unknown."""
    numbers = [classes.index(one) if one in classes else UNKNOWN for one in known.classes]
    table = np.array([*numbers, UNKNOWN], np.int8)
    return [replace(clip, label=table[clip.label]) for clip in known.clips]


def _check_alike(path: Path, more: ClipSet, seen: ClipSet) -> None:
    if more.axis != seen.axis or abs(more.frame_rate_hz / seen.frame_rate_hz - 1.0) > SAME_RATE:
        raise Sd2Error(
            f"{path} has {more.axis.words} at {more.frame_rate_hz:.4g} frames/s",
            f"{seen.axis.words} at {seen.frame_rate_hz:.4g} frames/s, as the data have",
        )
