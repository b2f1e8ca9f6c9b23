"""Rows of label files, as they are read, and the labels that are made of them.

A reader adds what a file says, entry by entry; an odd entry is left out and listed
(:meth:`LabelRows.entry`). What frames and marks without a duration are in seconds is decided here
(:class:`LabelClock`), for all formats alike.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace

import numpy as np

from sd2core.errors import Sd2Error
from sd2core.files.tables import counted
from sd2core.labels.formats.lanes import apart, edges_s
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
from sd2core.plausibility.spans import judge_spans
from sd2core.timebase import Timebase

UNNAMED = "unnamed"
"""Label of a span for which the file has none, and name of a track without one."""

_MAX_LISTED = 5
_MILLISECOND_S = 1e-3


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
    frames: tuple[int, int] | None = None  # First and end, exclusive, where these stand for times.
    person: str = ""


@dataclass
class LabelRows:
    """Content of a label file: rows, tracks, a label set, and what could not be read.

    Tracks are in their order, also those without spans; further ones of the rows follow. A track is
    ``"free"`` where spans do overlap, else as it says; where it says None, ``"exclusive"``.
    """

    rows: list[Row] = field(default_factory=list)
    tracks: list[tuple[str, Overlap | None]] = field(default_factory=list)
    label_set: LabelSet = GESTURES
    odd: list[Sd2Error] = field(default_factory=list)  # Why entries are left out.
    # What else a reader of the file should know, each without a full stop.
    remarks: list[str] = field(default_factory=list)

    @contextmanager
    def entry(self, place: str = "") -> Iterator[None]:
        """Read one entry of the file, which stands at a place; left out where it is in error."""
        try:
            yield
        except Sd2Error as error:
            self.odd.append(error.within(place) if place else error)

    def add_line(self, row: Row, cells: Mapping[str, str]) -> None:
        """Add a row of a table, with the texts of its other columns, as far as there are any.

        These are ``track``, ``overlap``, ``note``, ``author``, ``origin``, ``person`` and ``id``.
        """
        track = cells.get("track") or DEFAULT_TRACK
        stated = next((one for one in OVERLAPS if one == cells.get("overlap")), None)
        self.tracks.append((clean_name(track), stated))
        self.rows.append(
            replace(
                row,
                track=track,
                note=cells.get("note", ""),
                author=cells.get("author", ""),
                origin=cells.get("origin", ""),
                person=cells.get("person", ""),
                id=whole_number(cells.get("id", "")),
            )
        )


@dataclass(frozen=True)
class LabelClock:
    """Clock of a recording for which labels are read."""

    timebase: Timebase | None = None
    frames_per_s: float | None = None  # Rate of frames from 0 s on, where there is no timebase.
    mark_s: float | None = None  # Length of marks without a duration; None: the frame shown then.

    def __post_init__(self) -> None:
        for what, value in (
            ("rate of frames", self.frames_per_s),
            ("length of marks", self.mark_s),
        ):
            if value is not None and not 0 < value < math.inf:
                raise Sd2Error(f"The {what} is {value!r}", "a positive number")

    def of_frames(self, first: int, end: int) -> tuple[float, float]:
        """Times of a half-open range of frames."""
        base = self.timebase
        least = 0 if base is None else base.first_number
        known = math.inf if base is None else len(base) + least
        if not least <= first < end <= known:
            counted_from = "frames, counted from 0"
            if base is not None:
                counted_from = f"frames of the {known} of the recording, counted from 0"
            raise Sd2Error(
                f"a span from frame {first} up to frame {end}, exclusive",
                counted_from,
                "Check that the file is of this recording",
            )
        if base is not None:
            return float(base.edges_s[first - least]), float(base.edges_s[end - least])
        assert self.frames_per_s is not None
        return first / self.frames_per_s, end / self.frames_per_s

    def of_mark(self, at_s: float) -> tuple[float, float]:
        """Times of a mark: of its length, or of the frame shown then; beyond all, where it is."""
        if self.mark_s is not None:
            return at_s, at_s + self.mark_s
        if self.timebase is None:
            assert self.frames_per_s is not None
            frame = math.floor(at_s * self.frames_per_s + 1e-3)  # of a rounded time
            return frame / self.frames_per_s, (frame + 1) / self.frames_per_s
        if not self.timebase.covers(at_s):
            return at_s, at_s + self.timebase.frame_duration_s
        frame = self.timebase.frame_at(at_s)
        return float(self.timebase.edges_s[frame]), float(self.timebase.edges_s[frame + 1])

    def on_frame(self, time_s: float) -> float:
        """Edge of a frame that a time, in whole milliseconds as files have it, stands for."""
        if self.timebase is None:
            return time_s
        edges_s = self.timebase.edges_s
        after = int(np.searchsorted(edges_s, time_s))
        near_s = min(
            edges_s[max(after - 1, 0) : after + 1], key=lambda edge_s: abs(edge_s - time_s)
        )
        return float(near_s) if abs(near_s - time_s) < _MILLISECOND_S else time_s

    @property
    def knows_frames(self) -> bool:
        """True if the times of frames are known."""
        return self.timebase is not None or self.frames_per_s is not None


@dataclass(frozen=True)
class LabelReading:
    """Labels of a file, and what was not taken of it."""

    labels: Labels
    left_out: tuple[str, ...] = ()  # Entries, each with its place and what is wrong.
    remarks: tuple[str, ...] = ()
    beyond: str = ""  # How many spans reach beyond the recording.

    @property
    def sentence(self) -> str:
        """Sentence on spans that were taken, and on those that were not."""
        spans, tracks = len(self.labels.spans), len(self.labels.tracks)
        parts = [f"{counted(spans, 'span')} on {counted(tracks, 'track')} taken", *self.remarks]
        if self.beyond:
            parts.insert(1, self.beyond)
        if not self.left_out:
            parts.append("nothing left out")
        else:
            more = len(self.left_out) - _MAX_LISTED
            listed = [*self.left_out[:_MAX_LISTED], *([f"{more} more"] if more > 0 else [])]
            parts.append(f"{len(self.left_out):,} left out ({'; '.join(listed)})")
        return ", ".join(parts) + "."

    def beside(self, timebase: Timebase | None) -> LabelReading:
        """Copy with a remark on spans that reach beyond a recording; their times stay."""
        if timebase is None:
            return self
        spans_s = [(one.start_s, one.end_s) for one in self.labels.spans]
        remarks = (
            f"{one.found} ({one.remedy[0].lower()}{one.remedy[1:]})"
            for one in judge_spans(spans_s, timebase.start_s, timebase.end_s)
        )
        return replace(self, beyond="".join(remarks))


def assembled(content: LabelRows, clock: LabelClock) -> LabelReading:
    """Make labels of what a reader found.

    Ids are kept where they are positive and differ; the other spans are numbered after them, in
    the order of time. Raises Sd2Error when frames or marks need a clock that is not known, or when
    nothing is left to be taken.
    """
    _check_clock(content.rows, clock)
    rows: list[Row] = []
    unnumbered: list[Span] = []
    for row in content.rows:
        with content.entry(row.place):
            timed = _timed(row, clock)
            unnumbered.append(_span(timed))
            rows.append(timed)
    if content.odd and not rows:
        raise content.odd[0]
    numbered = zip(unnumbered, _ids(rows), strict=True)
    spans = tuple(replace(span, id=number) for span, number in numbered)
    overlaps: dict[str, Overlap | None] = {}
    for name, overlap in content.tracks:
        clean = clean_name(name)
        overlaps[clean] = overlap or overlaps.get(clean)
    for span in spans:
        overlaps.setdefault(span.track, None)
    if not overlaps:
        overlaps[DEFAULT_TRACK] = None
    crowded = {
        name
        for name in overlaps
        if len(apart([span for span in spans if span.track == name], edges_s)) > 1
    }
    made = tuple(
        LabelTrack(name, "free" if name in crowded else overlap or "exclusive")
        for name, overlap in overlaps.items()
    )
    left_out = tuple(error.found for error in content.odd)
    return LabelReading(Labels(made, spans, content.label_set), left_out, tuple(content.remarks))


def chosen_observation(
    names: Collection[str], wanted: str | None, kind: str = "observation"
) -> str:
    """Return which part of a file to read: the one wanted, or the only one.

    Raises Sd2Error when that is not certain; ``kind`` is what the parts are.
    """
    if wanted is None and len(names) == 1:
        return next(iter(names))
    if wanted is not None and wanted in names:
        return wanted
    listed = ", ".join(map(repr, list(names)[:20])) or "none"
    raise Sd2Error(
        f"it has {len(names)} {kind}s: {listed}",
        f"one {kind}" if wanted is None else f"the {kind} {wanted!r}",
        "Name the one to read, as an observation",
    )


def clean_name(name: str) -> str:
    """Make a name for a label or a track of any text: one printable line."""
    if name.isprintable() and name.strip() and len(name) <= LONGEST_NAME:
        return name
    line = " ".join("".join(one if one.isprintable() else " " for one in name).split())
    return line[:LONGEST_NAME].strip() or UNNAMED


def _check_clock(rows: Iterable[Row], clock: LabelClock) -> None:
    if clock.knows_frames:
        return
    for row in rows:
        if row.frames is not None:
            raise Sd2Error(
                "it gives frames and no seconds",
                "times in seconds",
                "Read it together with its recording, which knows the times of frames, or with"
                " their rate (--fps)",
            )
        if row.start_s == row.end_s and clock.mark_s is None:
            raise Sd2Error(
                f"{row.place}: {row.label!r} at {row.start_s:g} s has no duration",
                "spans with a start before the end",
                "Read the file together with its recording, or with the rate of its frames (--fps):"
                " such a mark becomes one frame; or give marks a length (--mark-s)",
            )


def _timed(row: Row, clock: LabelClock) -> Row:
    """A row with times, where it has frames or no duration, and on frames, where it was rounded."""
    if row.frames is not None:
        start_s, end_s = clock.of_frames(*row.frames)
    elif row.start_s == row.end_s:
        start_s, end_s = clock.of_mark(row.start_s)
    else:
        start_s, end_s = clock.on_frame(row.start_s), clock.on_frame(row.end_s)
        if not start_s < end_s:
            return row
    return replace(row, start_s=start_s, end_s=end_s)


def _span(row: Row) -> Span:
    origin: Origin = next((one for one in ORIGINS if one == row.origin), "import")
    try:
        return Span(
            1,  # Numbered when all are known.
            clean_name(row.track),
            row.start_s,
            row.end_s,
            clean_name(row.label),
            row.note,
            row.author,
            row.confidence,
            origin,
            clean_name(row.person) if row.person.strip() else "",
        )
    except Sd2Error as error:
        why = error.found.replace("Span 1", "the span", 1)
        raise Sd2Error(why, error.expected, "Mend that place") from None


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
