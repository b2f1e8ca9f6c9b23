"""Sources from Doppler maps: files of `sd2 synth` and the like, and radars' own recordings."""

from __future__ import annotations

import hashlib
from dataclasses import asdict
from pathlib import Path
from typing import Any

from sd2core.datasets.recording_sources import labels_and_classes
from sd2core.datasets.source import LazySource, Outline, Source, SourceKey, label_per_frame
from sd2core.files.digests import cached_digest
from sd2core.io.radar import holds_map, load_recorded_map
from sd2core.labels.files import read_labels as read_own
from sd2core.labels.formats import read_labels
from sd2core.labels.spans import Labels
from sd2core.maps import DopplerMap
from sd2core.progress import Progress
from sd2core.sensor import VirtualSensor


def map_source(path: Path, subject: str, label_file: Path | None = None) -> LazySource:
    """A source of one Doppler map.

    Parameters
    ----------
    path : Path
        Of a map (``.npz``), or a radar's file that holds one with labels of its own.
    subject : str
    label_file : Path, optional
        On the map's clock, in any format that `sd2 labels convert` reads. None: the labels
        of the radar's file, otherwise nothing is labelled.

    Raises
    ------
    Sd2Error
        When the map cannot be read, once it is its turn.
    """
    key = SourceKey(subject, path.stem, 0)
    return LazySource(
        key,
        lambda progress: _made(path, key, label_file, progress),
        lambda: _fingerprint(path, label_file),
        lambda: _outlined(path, label_file),
    )


def _fingerprint(path: Path, label_file: Path | None) -> str:
    sums = hashlib.blake2b(digest_size=16)
    for one in (path, label_file):
        sums.update(b"" if one is None else cached_digest(one).encode())
    return sums.hexdigest()


def _read(path: Path, label_file: Path | None) -> tuple[DopplerMap, Labels]:
    labels = Labels()
    if holds_map(path):
        recorded = load_recorded_map(path)
        doppler, labels = recorded.doppler, recorded.labels
    else:
        doppler = DopplerMap.load(path)
    if label_file is not None:
        labels = (
            read_own(label_file).labels
            if label_file.suffix.lower() == ".json"
            else read_labels(label_file, doppler.timebase)
        )
    return doppler, labels


def _made(path: Path, key: SourceKey, label_file: Path | None, progress: Progress) -> Source:
    doppler, labels = _read(path, label_file)
    names, classes = labels_and_classes(labels)
    spans = [span for span in labels.spans if span.origin != "suggestion"]
    return Source(
        key.subject,
        key.recording,
        key.placement,
        _sensor(doppler.meta),
        {doppler.kind: doppler},
        label_per_frame(spans, names, doppler.times_s),
        names,
        classes,
        None,
        {"file": path.name, "labels": None if label_file is None else label_file.name},
    )


def _outlined(path: Path, label_file: Path | None) -> Outline:
    doppler, labels = _read(path, label_file)
    names, _ = labels_and_classes(labels)
    spans = [span for span in labels.spans if span.origin != "suggestion"]
    label = label_per_frame(spans, names, doppler.times_s)
    return Outline((doppler.kind,), doppler.times_s, doppler.present, label, names)


def _sensor(meta: dict[str, Any]) -> VirtualSensor:
    """Where the map was seen from, as far as it says so; otherwise the camera."""
    found = meta.get("sensor")
    known = asdict(VirtualSensor())
    if not isinstance(found, dict):
        return VirtualSensor()
    given = {name: value for name, value in found.items() if name in known}
    return VirtualSensor(**given)
