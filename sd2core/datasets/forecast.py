"""Forecast of an export: segments and bytes, before any map is made."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field, replace

from sd2core.datasets.cutting import count_segments
from sd2core.datasets.index import empty_header
from sd2core.datasets.layout import bytes_per_segment
from sd2core.datasets.options import dataset_options
from sd2core.datasets.source import KINDS, LazySource, Outline, SourceKey, each_once
from sd2core.datasets.splitting import named_splits, split_people
from sd2core.errors import Sd2Error
from sd2core.maps import MapKind
from sd2core.options.exporting import Exporting
from sd2core.progress import Progress, silent
from sd2core.sensor import VelocityAxis
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
    frames_damaged: int = 0  # Lost to damaged chunks, each recording counted once.
    failed: tuple[str, ...] = ()  # Sources that cannot be read, each with its reason.

    def of_split(self) -> dict[str, int]:
        """Segments of each split."""
        return {
            name: sum(self.of_subject[one] for one in people)
            for name, people in named_splits(self.split).items()
        }


@dataclass
class Counting:
    """Outlines of sources, read once and counted with several options."""

    outlines: list[tuple[SourceKey, Outline]] = field(default_factory=list)
    failed: list[str] = field(default_factory=list)

    @classmethod
    def of(cls, sources: Iterable[LazySource], progress: Progress = silent) -> Counting:
        """Read the outlines of sources."""
        counting = cls()
        sources = each_once(sources)
        for number, one in enumerate(sources):
            progress(number, len(sources))
            assert one.outline is not None
            try:
                counting.outlines.append((one.key, one.outline()))
            except Sd2Error as error:
                counting.failed.append(f"{one.key.title}: {error}")
        progress(len(sources), len(sources))
        return counting

    def forecast(self, options: Exporting, bins: int) -> Forecast:
        """Count the segments that these options give on a velocity axis of ``bins``."""
        if not self.outlines:
            raise Sd2Error(
                self.failed[0] if self.failed else "There are no sources", "one at least"
            )
        options = dataset_options(options)
        first = Timebase(self.outlines[0][1].times_s)
        header = empty_header(options, VelocityAxis(bins), first)
        of_subject: Counter[str] = Counter()
        of_label: Counter[str] = Counter()
        of_kind: Counter[MapKind] = Counter()
        damaged = {key[:2]: outline.damaged for key, outline in self.outlines}
        for key, outline in self.outlines:
            labels = count_segments(outline, header.frame_rate_hz, options)
            of_label.update(labels)
            total = labels.total()
            of_subject += Counter({key.subject: total})
            of_kind.update({kind: total for kind in outline.kinds if kind in options.kinds})
        segments = of_label.total()
        split = Split((), (), ())
        if segments:
            split = split_people(
                list(of_subject), options.validation_subjects, options.test_subjects
            )
        kinds = tuple(kind for kind in KINDS if kind in of_kind)
        return Forecast(
            sources=len(self.outlines),
            segments=segments,
            of_subject=dict(of_subject),
            of_label=dict(of_label),
            of_kind={kind: of_kind[kind] for kind in kinds},
            split=split,
            frame_rate_hz=header.frame_rate_hz,
            total_bytes=segments * bytes_per_segment(replace(header, kinds=kinds)),
            frames_damaged=sum(damaged.values()),
            failed=tuple(self.failed),
        )
