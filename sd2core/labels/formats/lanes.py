"""Rows free of overlaps, for files whose tiers hold no two intervals at one instant.

ELAN and Praat have such tiers, and BORIS pairs the start and the stop of a behaviour by its
subject. A free track therefore becomes the rows ``NAME [overlap 1]``, ``NAME [overlap 2]`` and so
on; an exclusive one stays ``NAME``. Whatever tracks are called, they come back: an exclusive track
whose own name looks like such a row becomes ``NAME [overlap 0]``.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeVar

from sd2core.labels.spans import Labels, LabelTrack, Overlap, Span

_ROW = re.compile(r"(.+) \[overlap (\d{1,18})\]")

Time = TypeVar("Time", int, float)


@dataclass(frozen=True)
class Lane:
    """Spans that do not overlap, in order, and the name of their row in a file."""

    name: str
    track: LabelTrack
    spans: tuple[Span, ...]


def lanes_of(labels: Labels, edges: Callable[[Span], tuple[Time, Time]]) -> list[Lane]:
    """Distribute the spans of every track over rows, at least one each.

    ``edges`` gives start and end of a span in the times of the file, half-open.
    """
    lanes: list[Lane] = []
    for track in labels.tracks:
        rows = apart(labels.of_track(track.name), edges)
        free = track.overlap == "free" or len(rows) > 1
        first = 1 if free else 0
        bare = not free and not _ROW.fullmatch(track.name)
        for number, spans in enumerate(rows, start=first):
            name = track.name if bare else f"{track.name} [overlap {number}]"
            lanes.append(Lane(name, track, tuple(spans)))
    return lanes


def edges_s(span: Span) -> tuple[float, float]:
    """Start and end of a span, for files that have times in seconds."""
    return span.start_s, span.end_s


def track_of(row: str) -> tuple[str, Overlap | None]:
    """Return the track that a row belongs to, and its overlap where the row says so."""
    match = _ROW.fullmatch(row)
    if match is None:
        return row, None
    return match[1], "exclusive" if int(match[2]) == 0 else "free"


def apart(spans: Sequence[Span], edges: Callable[[Span], tuple[Time, Time]]) -> list[list[Span]]:
    """Distribute spans over rows without overlaps: first fit by start; at least one."""
    rows: list[list[Span]] = [[]]
    ends: list[Time | None] = [None]
    for span in sorted(spans, key=lambda one: (*edges(one), one.id)):
        start, end = edges(span)
        for number, last in enumerate(ends):
            if last is None or last <= start:
                rows[number].append(span)
                ends[number] = end
                break
        else:
            rows.append([span])
            ends.append(end)
    return rows
