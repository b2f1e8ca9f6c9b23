"""Facts of labelled data, found without making a map."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np

from sd2core.classify.data import ClipSet, clips_of_map
from sd2core.datasets.labelled_source import LabelledSource
from sd2core.datasets.people import people_shown, subject_of
from sd2core.datasets.reading import open_dataset
from sd2core.errors import Sd2Error
from sd2core.io.kinds import RADAR_MAP_SUFFIXES, kind_of
from sd2core.io.radar import holds_map, load_recorded_map
from sd2core.labels.spans import Labels, Span
from sd2core.pairs.summary import PairFacts, names_together, pair_facts
from sd2core.recording.recording import SUFFIX, is_recording, open_recording

LabelledKind = Literal["pairs", "data set", "recording", "radar file"]

ONE_PERSON = "one person"
"""Subject of a radar file that does not name one."""

_EXPECTED = "a campaign or other pairs, a data set, a labelled recording, or a labelled radar file"


class Grid(NamedTuple):
    """Grid that maps must share to be trained on together."""

    bins: int
    v_max_mps: float
    frame_rate_hz: float


@dataclass(frozen=True)
class LabelledFacts:
    """Content of one source of labelled data."""

    path: Path
    kind: LabelledKind
    subjects: tuple[str, ...]  # Names in the source itself.
    # Those of ``synthetic``, ``denoised`` and ``radar`` that exist or can be made.
    maps: tuple[str, ...]
    # Length of the movements, each counted once; None where only reading the maps would tell.
    duration_s: float | None = None
    simulated: bool = False  # True if its radar is simulated.
    placements: int = 1
    spans: int = 0  # Labelled ones; 0 where labels stand by frames.
    grid: Grid | None = None  # None where it depends on what it is learnt from with.
    # Subjects that train, validate and test, where the source says so.
    splits: dict[str, tuple[str, ...]] = field(default_factory=dict)
    pairs: PairFacts | None = None  # Of a store of them.


def unfolded(sources: Sequence[LabelledSource]) -> list[LabelledSource]:
    """Replace folders by the recordings and radar files in them, and name whom recordings show."""
    result: list[LabelledSource] = []
    for one in sources:
        if not one.path.exists():
            raise Sd2Error(f"{one.path} does not exist", "labelled data", "Check the path")
        inside = inside_of(one.path)
        result += [LabelledSource(path, one.subject) for path in inside] if inside else [one]
    unnamed = [one.path for one in result if not one.subject and is_recording(one.path)]
    names = dict(zip(unnamed, people_shown(unnamed), strict=True))
    return [LabelledSource(one.path, one.subject or names.get(one.path, "")) for one in result]


def inside_of(folder: Path) -> list[Path]:
    """Return recordings and radar files directly in a folder; none in a recording or store."""
    if not folder.is_dir() or folder.suffix in (SUFFIX, ".zarr"):
        return []
    return sorted(
        path
        for path in folder.iterdir()
        if (path.suffix == SUFFIX and path.is_dir()) or path.suffix.lower() in RADAR_MAP_SUFFIXES
    )


def labelled_facts(source: LabelledSource) -> LabelledFacts:
    """Return the facts of a source that is not a folder of several."""
    path = source.path
    kind = kind_of(path)
    if kind == "pairs":
        return _of_pairs(path)
    if kind == "dataset":
        return _of_dataset(path)
    if is_recording(path):
        return _of_recording(source)
    if holds_map(path):
        return _of_radar_file(source)
    raise Sd2Error(f"{path} is a {kind}", _EXPECTED)


def people_of(facts: Sequence[LabelledFacts]) -> tuple[str, ...]:
    """Return all people by the names and in the order of a classifier's training.

    Pairs come last, called as :func:`~sd2core.pairs.summary.names_together` says; in recordings,
    radar files and data sets people of the same name are the same.
    """
    stores = [one.pairs for one in facts if one.pairs is not None]
    others = [name for one in facts if one.pairs is None for name in one.subjects]
    in_stores = [name for names in names_together(stores) for name in names.values()]
    return tuple(dict.fromkeys([*others, *in_stores]))


def _of_pairs(path: Path) -> LabelledFacts:
    facts = pair_facts(path)
    return LabelledFacts(
        path,
        "pairs",
        facts.subjects,
        ("synthetic", "denoised", "radar"),
        facts.duration_s,
        facts.kind == "simulated",
        facts.placements,
        grid=Grid(facts.bins, facts.v_max_mps, facts.frame_rate_hz),
        pairs=facts,
    )


def _of_dataset(path: Path) -> LabelledFacts:
    with open_dataset(path) as dataset:
        header = dataset.header
        kinds = {"radar" if kind in ("simulated", "real") else kind for kind in header.kinds}
        placement = dataset["placement"][:]
        seen_from = np.unique(placement, return_counts=True)[1]
        step_s = (header.length - header.overlap) / header.frame_rate_hz
        if header.spans is not None and len(dataset):
            step_s = float(np.mean(dataset["end_s"][:] - dataset["start_s"][:]))
    return LabelledFacts(
        path,
        "data set",
        header.subjects,
        tuple(name for name in ("synthetic", "denoised", "radar") if name in kinds),
        # Other places show the same movements.
        int(seen_from.max(initial=0)) * step_s,
        header.simulated,
        len(seen_from),
        grid=Grid(header.axis.bins, header.axis.v_max_mps, header.frame_rate_hz),
        splits=header.splits,
    )


def clips_of_radar_file(source: LabelledSource, frame_rate_hz: float | None) -> ClipSet:
    """Return the clips of a labelled radar file; see :func:`clips_of_map`."""
    recorded = load_recorded_map(source.path)
    return clips_of_map(
        recorded.doppler,
        recorded.labels,
        subject=source.subject or ONE_PERSON,
        movement=source.path.stem,
        frame_rate_hz=frame_rate_hz,
    )


def labels_given(labels: Labels, path: Path) -> tuple[Span, ...]:
    """Return the labels that are no suggestions; Sd2Error where a recording has none."""
    if not labels.decided:
        raise Sd2Error(
            f"{path} has no labels",
            "a recording in which gestures are labelled",
            "Label it in the window, or leave it out",
        )
    return labels.decided


def _of_recording(source: LabelledSource) -> LabelledFacts:
    recording = open_recording(source.path)
    labels = recording.effective_labels()
    first = source.subject or recording.subject or source.path.stem
    spans = labels_given(labels, source.path)
    maps: list[str] = []
    if recording.mesh is not None:
        shown_without = recording.denoiser is None and recording.bundled_denoiser == ""
        maps += ["synthetic"] if shown_without else ["synthetic", "denoised"]
    if recording.radar is not None:
        maps.append("radar")
    return LabelledFacts(
        source.path,
        "recording",
        tuple(subject_of(recording, person, first) for person in labels.persons or ("",)),
        tuple(maps),
        simulated=recording.simulated and recording.radar is not None,
        spans=len(spans),
    )


def _of_radar_file(source: LabelledSource) -> LabelledFacts:
    recorded = load_recorded_map(source.path)
    return LabelledFacts(
        source.path,
        "radar file",
        (source.subject or ONE_PERSON,),
        ("radar",),
        recorded.timebase.duration_s,
        spans=len(recorded.labels.spans),
    )
