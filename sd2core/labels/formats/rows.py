"""Rows of label files: made into labels when read, and free of overlaps when written.

Tiers of ELAN and Praat hold no two intervals at one instant, and BORIS pairs the start and the
stop of a behaviour by its subject. A free track therefore becomes the rows ``NAME [overlap 1]``,
``NAME [overlap 2]`` and so on; an exclusive one stays ``NAME``. Whatever tracks are called, they
come back: an exclusive track whose own name looks like such a row becomes ``NAME [overlap 0]``.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from sd2core.errors import Sd2Error
from sd2core.labels.formats.losses import DEFAULT_TRACK
from sd2core.labels.formats.numbers import whole_number
from sd2core.labels.label_set import GESTURES, LONGEST_NAME, LabelSet
from sd2core.labels.spans import (
    LARGEST_ID,
    ORIGINS,
    OVERLAPS,
    Labels,
    LabelTrack,
    Origin,
    Overlap,
    Span,
)
from sd2core.timebase import Timebase

UNNAMED = "unnamed"
"""Label of a span for which the file has none, and name of a track without one."""


@dataclass(frozen=True)
class Row:
    """Unchecked span of a file; ``place`` is where it stands, for messages: ``"line 3"``."""

    place: str
    start_s: float
    end_s: float
    label: str
    track: str = DEFAULT_TRACK
    note: str = ""
    author: str = ""
    confidence: float | None = None
    origin: str = "import"
    id: int | None = None


class TableRows:
    """Rows of a table by the names of its columns, and the tracks that they name."""

    def __init__(self) -> None:
        self.rows: list[Row] = []
        self.tracks: dict[str, Overlap | None] = {}

    def add(
        self,
        line: int,
        edges_s: tuple[float, float],
        label: str,
        confidence: float | None,
        cells: Mapping[str, str],
    ) -> None:
        """Add a line of the table, with what has been read of it.

        Parameters
        ----------
        line : int
            Number of the line in the file, for messages.
        edges_s : (float, float)
            Start and end.
        label : str
        confidence : float or None
        cells : mapping of str to str
            Texts of the other columns: ``track``, ``overlap``, ``note``, ``author``, ``origin`` and
            ``id``, as far as there are any.
        """
        track = cells.get("track") or DEFAULT_TRACK
        stated = next((one for one in OVERLAPS if one == cells.get("overlap")), None)
        self.tracks[clean_name(track)] = stated
        row = Row(
            f"line {line}",
            *edges_s,
            label,
            track,
            note=cells.get("note", ""),
            author=cells.get("author", ""),
            confidence=confidence,
            origin=cells.get("origin", ""),
            id=whole_number(cells.get("id", "")),
        )
        self.rows.append(row)


def assemble(
    path: Path,
    rows: Sequence[Row],
    *,
    tracks: Iterable[tuple[str, Overlap | None]] = (),
    label_set: LabelSet = GESTURES,
    timebase: Timebase | None = None,
) -> Labels:
    """Make labels of rows.

    Ids are kept where they are positive and differ; the other spans are numbered after them, in
    the order of time.

    Parameters
    ----------
    path : Path
        The file, for messages.
    rows : sequence of Row
    tracks : iterable of (str, Overlap or None)
        In their order, also those without spans; further ones of the rows follow. A track is
        ``"free"`` where spans do overlap, else as it says; where it says None, ``"exclusive"``.
    label_set : LabelSet
    timebase : Timebase, optional
        Needed for a row without extent, which becomes the frame that is shown at that instant.

    Raises
    ------
    Sd2Error
        Naming the file and the place, when a row is not a span.
    """
    ids = _ids(rows)
    spans = tuple(_span(path, row, number, timebase) for row, number in zip(rows, ids, strict=True))
    overlaps: dict[str, Overlap | None] = {}
    for name, overlap in tracks:
        clean = clean_name(name)
        overlaps[clean] = overlap or overlaps.get(clean)
    for span in spans:
        overlaps.setdefault(span.track, None)
    if not overlaps:
        overlaps[DEFAULT_TRACK] = None
    crowded = _overlapping(spans)
    made = tuple(
        LabelTrack(name, "free" if name in crowded else overlap or "exclusive")
        for name, overlap in overlaps.items()
    )
    return Labels(made, spans, label_set)


def clean_name(name: str) -> str:
    """Make a name for a label or a track of any text: one printable line."""
    if name.isprintable() and name.strip() and len(name) <= LONGEST_NAME:
        return name
    line = " ".join("".join(one if one.isprintable() else " " for one in name).split())
    return line[:LONGEST_NAME].strip() or UNNAMED


def _ids(rows: Sequence[Row]) -> list[int]:
    used: set[int] = set()
    kept: list[int | None] = []
    for row in rows:
        fits = row.id is not None and 0 < row.id <= LARGEST_ID and row.id not in used
        kept.append(row.id if fits else None)
        if fits and row.id is not None:
            used.add(row.id)
    number = max(used, default=0)
    for index in sorted(range(len(rows)), key=lambda i: (rows[i].start_s, rows[i].end_s)):
        if kept[index] is None:
            number += 1
            kept[index] = number
    return [number for number in kept if number is not None]


def _span(path: Path, row: Row, number: int, timebase: Timebase | None) -> Span:
    where = f"{path}, {row.place}"
    start_s, end_s = row.start_s, row.end_s
    if start_s == end_s:
        if timebase is None:
            raise Sd2Error(
                f"{where}: {row.label!r} at {start_s:g} s has no duration",
                "spans with a start before the end",
                "Read the file together with its recording: such a mark becomes one frame",
            )
        frame = timebase.frame_at(start_s)
        start_s, end_s = timebase.edges_s[frame : frame + 2].tolist()
    origin: Origin = next((one for one in ORIGINS if one == row.origin), "import")
    try:
        return Span(
            number,
            clean_name(row.track),
            start_s,
            end_s,
            clean_name(row.label),
            row.note,
            row.author,
            row.confidence,
            origin,
        )
    except Sd2Error as error:
        raise Sd2Error(f"{where}: {error.found}", error.expected, "Mend that place") from None


def _overlapping(spans: Sequence[Span]) -> set[str]:
    last_end_s: dict[str, float] = {}
    found: set[str] = set()
    for span in sorted(spans, key=lambda one: (one.start_s, one.end_s)):
        if span.start_s < last_end_s.get(span.track, float("-inf")):
            found.add(span.track)
        last_end_s[span.track] = max(span.end_s, last_end_s.get(span.track, span.end_s))
    return found


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
    found: list[Lane] = []
    for track in labels.tracks:
        rows = apart(labels.of_track(track.name), edges)
        free = track.overlap == "free" or len(rows) > 1
        first = 1 if free else 0
        bare = not free and not _ROW.fullmatch(track.name)
        for number, spans in enumerate(rows, start=first):
            name = track.name if bare else f"{track.name} [overlap {number}]"
            found.append(Lane(name, track, tuple(spans)))
    return found


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
