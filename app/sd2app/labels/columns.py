"""Columns of the table of spans: text, order, and the edit made by typing."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from sd2core.errors import Sd2Error
from sd2core.labels import edits, field_edits
from sd2core.labels.edits import Edit, Side
from sd2core.labels.spans import Labels, Span
from sd2core.labels.typed_times import typed_duration_end, typed_end, typed_start
from sd2core.timebase import Timebase

Change = Callable[[Labels, Timebase], Edit]
Typed = Callable[[str, Sequence[Span]], Change]
"""Makes the edit of a typed text, given the spans concerned, that of the cell first."""
When = Callable[[str, Span, Timebase], float]


@dataclass(frozen=True)
class Edge:
    """Edge of a span that a cell moves, and the time parsed from typed text."""

    side: Side
    when: When

    def of(self, span: Span) -> float:
        """Return the time of the edge."""
        return span.start_s if self.side == "start" else span.end_s

    def typed(self, text: str, spans: Sequence[Span]) -> Change:
        """Make the edit that moves the edge."""
        span_id = spans[0].id
        return lambda labels, base: edits.resize(
            labels, base, span_id, self.side, self.when(text, labels.span(span_id), base)
        )


@dataclass(frozen=True)
class Column:
    """One column of the table of spans."""

    id: str
    heading: str
    tip: str
    text: Callable[[Span, Timebase], str]
    order: Callable[[Span], Any]  # sort key; ties stay in the order of time
    typed: Typed | None = None  # makes the edit of a typed text; None: not editable
    listed: Literal["label", "track"] | None = None  # chosen from a list, for all selected spans
    wide: str = "000.000"  # a text as wide as the column is at first
    number: bool = False
    hidden: bool = False  # at first
    edge: Edge | None = None  # edge that typing moves, in a column of times


_START = Edge("start", lambda text, _, base: typed_start(text, base))
_END = Edge("end", lambda text, _, base: typed_end(text, base))
_DURATION = Edge("end", lambda text, span, base: typed_duration_end(text, span.start_s, base))
_TIMES = "seconds (1.5 or 1:02.5) or a frame (f48)"


def _frames(span: Span, timebase: Timebase) -> str:
    first, stop = timebase.frames_between(span.start_s, span.end_s)
    return f"{first}–{stop - 1}" if stop > first else ""


def _label(text: str, spans: Sequence[Span]) -> Change:
    return lambda labels, _: field_edits.relabel(labels, [one.id for one in spans], text)


def _track(text: str, spans: Sequence[Span]) -> Change:
    return lambda labels, _: field_edits.set_track(labels, [one.id for one in spans], text)


def _note(text: str, spans: Sequence[Span]) -> Change:
    return lambda labels, _: field_edits.set_note(labels, [spans[0].id], text.strip())


def _author(text: str, spans: Sequence[Span]) -> Change:
    return lambda labels, _: field_edits.set_author(labels, [spans[0].id], text.strip())


def _confidence(text: str, spans: Sequence[Span]) -> Change:
    typed = text.strip().replace(",", ".")

    def change(labels: Labels, _: Timebase) -> Edit:
        try:
            confidence = float(typed) if typed else None
        except ValueError:
            raise Sd2Error(
                f"{text[:40]!r} was typed as a confidence", "a number from 0 to 1, or nothing"
            ) from None
        return field_edits.set_confidence(labels, [spans[0].id], confidence)

    return change


COLUMNS: tuple[Column, ...] = (
    Column(
        "start", "Start s", f"Start. Type {_TIMES}: the first one of the span",
        lambda span, _: f"{span.start_s:.3f}", lambda span: span.start_s, _START.typed,
        number=True, edge=_START,
    ),
    Column(
        "end", "End s", f"End. Type {_TIMES}: the last one of the span",
        lambda span, _: f"{span.end_s:.3f}", lambda span: span.end_s, _END.typed,
        number=True, edge=_END,
    ),
    Column(
        "label", "Label", "Label of the set, given to all selected spans",
        lambda span, _: span.label, lambda span: span.label.casefold(), _label, "label",
        wide="■ right-to-left",
    ),
    Column(
        "duration", "Length s", "Duration. Type seconds or frames (12 f): its end moves",
        lambda span, _: f"{span.duration_s:.3f}", lambda span: span.duration_s,
        _DURATION.typed, number=True, edge=_DURATION,
    ),
    Column(
        "frames", "Frames", "The first frame and the last one",
        _frames, lambda span: span.start_s, wide="0000–0000", number=True,
    ),
    Column(
        "track", "Track", "Track, for all selected spans",
        lambda span, _: span.track, lambda span: span.track.casefold(), _track, "track",
        wide="Gestures ▾",
    ),
    Column(
        "note", "Note", "Any text",
        lambda span, _: span.note, lambda span: span.note.casefold(), _note,
        wide="some words",
    ),
    Column(
        "author", "Author", "Person who marked it",
        lambda span, _: span.author, lambda span: span.author.casefold(), _author,
        wide="some name", hidden=True,
    ),
    Column(
        "confidence", "Sure", "Confidence, 0 to 1",
        lambda span, _: "" if span.confidence is None else f"{span.confidence:g}",
        lambda span: -1.0 if span.confidence is None else span.confidence, _confidence,
        wide="0.00", number=True, hidden=True,
    ),
    Column(
        "origin", "Origin", "A person, a suggestion, or an import",
        lambda span, _: span.origin, lambda span: span.origin, wide="suggestion", hidden=True,
    ),
)  # fmt: skip
