"""Forecast of an export: segments, bytes and time, before any map is made."""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from sd2core.datasets.cutting import count_segments
from sd2core.datasets.layout import bytes_per_segment
from sd2core.datasets.options import DatasetOptions
from sd2core.datasets.recording_sources import Making, places_of
from sd2core.datasets.simulating import simulated_map
from sd2core.datasets.source import KINDS, LazySource, Outline, Source
from sd2core.datasets.splitting import split_people
from sd2core.errors import Sd2Error
from sd2core.maps import MapKind
from sd2core.mesh.sequence import MeshSequence
from sd2core.progress import Progress, silent
from sd2core.recording.recording import open_recording
from sd2core.sensor import VirtualSensor
from sd2core.timebase import Timebase
from sd2core.train.data import Split

_TIMED_FRAMES = 60
_WARMING_FRAMES = 4


@dataclass(frozen=True)
class Forecast:
    """Size of the data set that would be written."""

    sources: int
    segments: int
    of_subject: dict[str, int]  # Segments.
    of_label: dict[str, int]  # Segments.
    # Segments that have it; where a radar missed frames it may be fewer.
    of_kind: dict[MapKind, int]
    split: Split
    frame_rate_hz: float
    total_bytes: int  # Size of the arrays before compression.
    failed: tuple[str, ...] = ()  # Sources that cannot be read, each with its reason.

    def of_split(self) -> dict[str, int]:
        """Segments of each split."""
        parts = {
            "train": self.split.training,
            "validation": self.split.validation,
            "test": self.split.test,
        }
        return {name: sum(self.of_subject[one] for one in people) for name, people in parts.items()}


@dataclass
class Counting:
    """Outlines of sources, read once and counted with several options."""

    outlines: list[tuple[str, Outline]] = field(default_factory=list)  # With the subject of each.
    failed: list[str] = field(default_factory=list)

    @classmethod
    def of(cls, sources: Iterable[Source | LazySource], progress: Progress = silent) -> Counting:
        """Read the outlines of sources; those without one are refused."""
        found = cls()
        sources = list(sources)
        for number, one in enumerate(sources):
            progress(number, len(sources))
            try:
                if one.outline is None:
                    raise Sd2Error(f"{one.key.title} does not say what it holds", "an outline")
                found.outlines.append((one.key.subject, one.outline()))
            except Sd2Error as error:
                found.failed.append(f"{one.key.title}: {error}")
        progress(len(sources), len(sources))
        return found

    def forecast(self, options: DatasetOptions, bins: int) -> Forecast:
        """Count the segments that these options give on a velocity axis of ``bins``."""
        if not self.outlines:
            raise Sd2Error(
                self.failed[0] if self.failed else "There are no sources", "one at least"
            )
        rate_hz = options.frame_rate_hz or round(
            Timebase(self.outlines[0][1].times_s).frames_per_s, 3
        )
        of_subject: dict[str, int] = {}
        of_label: dict[str, int] = {}
        of_kind: dict[MapKind, int] = {}
        for subject, outline in self.outlines:
            total, labels = count_segments(outline, rate_hz, options)
            if total:
                of_subject[subject] = of_subject.get(subject, 0) + total
            for name, count in labels.items():
                of_label[name] = of_label.get(name, 0) + count
            for kind in outline.kinds:
                if kind in options.kinds:
                    of_kind[kind] = of_kind.get(kind, 0) + total
        segments = sum(of_subject.values())
        split = Split((), (), ())
        if segments:
            split = split_people(list(of_subject), options.validation, options.test)
        return Forecast(
            sources=len(self.outlines),
            segments=segments,
            of_subject=of_subject,
            of_label=of_label,
            of_kind={kind: of_kind[kind] for kind in KINDS if kind in of_kind},
            split=split,
            frame_rate_hz=rate_hz,
            total_bytes=segments * bytes_per_segment(options.length, bins, len(of_kind)),
            failed=tuple(self.failed),
        )


def simulation_s(recordings: Sequence[Path], making: Making) -> float:
    """Estimate the seconds that simulating all recordings from all places takes.

    Timed on some frames of the first recording that can be simulated; the others are assumed to
    cost the same per frame. Recordings that cannot be read are left out.
    """
    if making.simulation is None or "simulated" not in making.kinds:
        return 0.0
    frames, each_s = 0, 0.0
    for path in recordings:
        try:
            recording = open_recording(path)
            mesh = recording.load_mesh() if recording.mesh is not None else None
        except Sd2Error:
            continue  # the counting says it
        if mesh is None or mesh.faces is None:
            continue
        if not frames:
            each_s = _timed_s(mesh, recording.sensor, making)
        frames += mesh.frame_count * (1 + len(places_of(recording, making)))
    return frames * each_s


def _timed_s(mesh: MeshSequence, sensor: VirtualSensor, making: Making) -> float:
    """Measure the seconds per frame in the middle of the clip."""
    assert making.simulation is not None
    middle = mesh.frame_count // 2
    begun_s = 0.0
    for count in (_WARMING_FRAMES, _TIMED_FRAMES):
        start = max(middle - count // 2, 0)
        stop = min(start + count, mesh.frame_count)
        begun_s = time.perf_counter()
        simulated_map(mesh, sensor, making.simulation, making.synthesis.axis, (start, stop))
    return (time.perf_counter() - begun_s) / (stop - start)
