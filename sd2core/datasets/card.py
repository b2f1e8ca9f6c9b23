"""What a data set holds, counted from its arrays: the card beside it, for programs."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from sd2core.datasets.layout import SPLITS
from sd2core.datasets.reading import Dataset, open_dataset
from sd2core.datasets.source import KINDS
from sd2core.files.atomic import atomic_write_text

CARD_FORMAT = "sd2-dataset-card"
_ROWS = 8192
_MANY = 12
"""Distinct ways of making that are listed; more are counted."""


def card_paths(path: Path) -> tuple[Path, Path, Path]:
    """Markdown, JSON and preview sheet that belong to a data set, beside it."""
    return tuple(path.with_name(f"{path.stem}.{end}") for end in ("card.md", "card.json", "png"))  # type: ignore[return-value]


def write_card(path: Path) -> dict[str, Any]:
    """Count a data set and write its card, as JSON and as Markdown; what it says.

    Raises
    ------
    Sd2Error
        When the path holds no finished data set.
    """
    from sd2core.datasets.card_text import card_text

    with open_dataset(path) as dataset:
        card = describe_dataset(dataset)
    markdown, as_json, _ = card_paths(path)
    atomic_write_text(as_json, json.dumps(card, indent=2, ensure_ascii=False) + "\n")
    atomic_write_text(markdown, card_text(card))
    return card


def describe_dataset(dataset: Dataset) -> dict[str, Any]:
    """Everything a card says, as JSON can hold it; arrays are read in parts."""
    header = dataset.header
    counts = _Counts(len(header.labels), len(header.subjects))
    for rows in _parts(dataset):
        counts.add(rows)
    sources = _Sources()
    for entry in dataset.sources():
        sources.add(entry)
    by_label = dict(zip(header.labels, counts.label.tolist(), strict=True))
    return {
        "format": CARD_FORMAT,
        "version": 1,
        "dataset": dataset.path.name,
        **{name: value for name, value in header.as_dict().items() if name not in _NOT_ON_CARD},
        "segments": len(dataset),
        "segment_s": header.length / header.frame_rate_hz,
        "sources": sources.count,
        "recordings": sources.recordings,
        "minutes": sources.minutes,
        "segments_of_split": _named(SPLITS, counts.split),
        "segments_of_label": by_label,
        "frames_of_label": _named(header.labels, counts.frames),
        "segments_of_class": _of_class(by_label, header.classes),
        "segments_of_label_and_split": {
            label: _named(SPLITS, counts.label_split[number])
            for number, label in enumerate(header.labels)
        },
        "segments_of_subject": _named(header.subjects, counts.subject),
        "segments_of_kind": {
            kind: int(counts.kind[KINDS.index(kind)]) for kind in header.kinds
        },
        "purity_mean": counts.purity / max(len(dataset), 1),
        "placements": sources.placements,
        **{name: counts.extent(name) for name in _EXTENTS},
        "frames_without_person": sources.frames_without_person,
        "resampled_segments": counts.resampled,
        "sources_without_segments": sources.empty,
        "simulated_recordings": sources.simulated,
        "how": sources.how(),
    }  # fmt: skip


_NOT_ON_CARD = {"format", "version", "all_kinds"}
_EXTENTS = ("range_m", "azimuth_deg", "elevation_deg")
_READ = ("segment_label", "purity", "subject", "split", "available", "resampled", *_EXTENTS)


class _Counts:
    """Segments counted part by part."""

    def __init__(self, labels: int, subjects: int) -> None:
        self.label = np.zeros(labels, np.int64)
        self.frames = np.zeros(labels, np.int64)
        self.subject = np.zeros(subjects, np.int64)
        self.split = np.zeros(len(SPLITS), np.int64)
        self.label_split = np.zeros((labels, len(SPLITS)), np.int64)
        self.kind = np.zeros(len(KINDS), np.int64)
        self.purity = 0.0
        self.resampled = 0
        self._extents: dict[str, list[float]] = {name: [] for name in _EXTENTS}

    def add(self, rows: dict[str, np.ndarray]) -> None:
        np.add.at(self.label, rows["segment_label"], 1)
        np.add.at(self.subject, rows["subject"], 1)
        np.add.at(self.split, rows["split"], 1)
        np.add.at(self.label_split, (rows["segment_label"], rows["split"]), 1)
        self.frames += np.bincount(rows["label"].ravel(), minlength=len(self.frames))
        self.kind += rows["available"].sum(axis=0)
        self.resampled += int(rows["resampled"].sum())
        self.purity += float(rows["purity"].sum(dtype=np.float64))
        for name, known in self._extents.items():
            values = rows[name][np.isfinite(rows[name])].astype(float)
            if len(values):
                known[:] = [min([*known, values.min()]), max([*known, values.max()])]

    def extent(self, name: str) -> list[float] | None:
        """Smallest and largest, or None where it is not known."""
        return [round(float(value), 4) for value in self._extents[name]] or None


class _Sources:
    """Lines of sources, counted one by one."""

    def __init__(self) -> None:
        self.count = 0
        self.empty = 0
        self.simulated = 0
        self.minutes = 0.0
        self.frames_without_person = 0
        self._views: Counter[int] = Counter()
        self._how: dict[str, Counter[str]] = {kind: Counter() for kind in KINDS}

    def add(self, entry: dict[str, Any]) -> None:
        self.count += 1
        self.empty += entry["start"] == entry["stop"]
        recording = hash((entry["subject"], entry["recording"]))
        self._views[recording] += 1
        provenance = entry["provenance"]
        # Others show the same movement; its own sensor need not be among them.
        if self._views[recording] == 1:
            self.minutes += entry["frames"] / entry["frame_rate_hz"] / 60
            self.frames_without_person += entry["frames"] - entry["frames_with_person"]
            self.simulated += bool(provenance.get("simulated"))
        for kind, made in provenance["maps"].items():
            self._how[kind][how_words(kind, made, provenance)] += 1

    @property
    def recordings(self) -> int:
        """How many there are."""
        return len(self._views)

    @property
    def placements(self) -> int:
        """From how many places one of them is seen, at most."""
        return max(self._views.values(), default=0)

    def how(self) -> dict[str, dict[str, int]]:
        """Ways in which maps of each kind were made, and of how many sources."""
        found = {}
        for kind, ways in self._how.items():
            if ways:
                found[kind] = dict(ways.most_common(_MANY))
                rest = ways.total() - sum(found[kind].values())
                if rest:
                    found[kind][f"{len(ways) - _MANY} other ways"] = rest
        return found


def how_words(kind: str, made: dict[str, Any], provenance: dict[str, Any]) -> str:
    """How a map was made, in a few words, from what it says of itself."""
    if kind == "synthetic":
        options = made.get("options", {})
        if "pairs" in provenance:
            return f"from the pairs {provenance['pairs']}"
        plan = provenance.get("plan") or made.get("plan")
        if plan is not None:
            return f"counted from a mesh by the plan {plan['text']}"
        return (
            f"counted from a mesh: visibility {options.get('visibility', 'not stated')},"
            f" weight {options.get('weight', 'not stated')}"
        )
    if kind == "denoised":
        told = made.get("denoiser", {})
        name = told.get("title") or told.get("name") or "a denoiser"
        return (
            f"the synthetic map through {name} ({told.get('model', 'model not stated')}),"
            f" trained on {told.get('trained_on', 'unknown')} radar data: "
            f"{told.get('data') or 'not stated which'}"
        )
    if "pairs" in provenance:
        return f"from the pairs {provenance['pairs']}"
    radar = made.get("radar")
    name = radar.get("name", "") if isinstance(radar, dict) else str(radar or "")
    return ("a computed radar signal" if kind == "simulated" else "a radar capture") + (
        f": {name}" if name else ""
    )


def _parts(dataset: Dataset) -> Iterator[dict[str, np.ndarray]]:
    for start in range(0, len(dataset), _ROWS):
        names = (*_READ, "label")
        yield {name: np.asarray(dataset[name][start : start + _ROWS]) for name in names}


def _named(names: tuple[str, ...], counts: np.ndarray) -> dict[str, int]:
    return dict(zip(names, counts.tolist(), strict=True))


def _of_class(by_label: dict[str, int], classes: dict[str, str]) -> dict[str, int]:
    found: dict[str, int] = {}
    for label, count in by_label.items():
        name = classes.get(label)
        if name:
            found[name] = found.get(name, 0) + count
    return found
