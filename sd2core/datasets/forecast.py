"""Forecast of an export: segments and bytes, before any map is made."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

from sd2core.datasets.cutting import count_segments
from sd2core.datasets.layout import bytes_per_segment
from sd2core.datasets.options import DatasetOptions
from sd2core.datasets.source import KINDS, LazySource, Outline, Source
from sd2core.datasets.splitting import split_people
from sd2core.errors import Sd2Error
from sd2core.maps import MapKind
from sd2core.progress import Progress, silent
from sd2core.timebase import Timebase
from sd2core.train.data import Split


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
        maps = len(of_kind) + len(options.parts)
        more = len(options.imu), len(options.joints)
        return Forecast(
            sources=len(self.outlines),
            segments=segments,
            of_subject=of_subject,
            of_label=of_label,
            of_kind={kind: of_kind[kind] for kind in KINDS if kind in of_kind},
            split=split,
            frame_rate_hz=rate_hz,
            total_bytes=segments * bytes_per_segment(options.length, bins, maps, *more),
            failed=tuple(self.failed),
        )
