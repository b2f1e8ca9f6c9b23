"""The columns of the table of spans: what they show, how they sort, what typing into them does."""

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
"""What was typed into a cell, and the spans that it is about, the one of the cell first."""
When = Callable[[str, Span, Timebase], float]


@dataclass(frozen=True)
class Edge:
    """Which edge of a span a cell moves, and to where.

    Parameters
    ----------
    side : {"start", "end"}
    when : callable
        The time that was typed.
    """

    side: Side
    when: When

    def of(self, span: Span) -> float:
        """Where it is."""
        return span.start_s if self.side == "start" else span.end_s

    def typed(self, text: str, spans: Sequence[Span]) -> Change:
        """Move it there."""
        span_id = spans[0].id
        return lambda labels, base: edits.resize(
            labels, base, span_id, self.side, self.when(text, labels.span(span_id), base)
        )


@dataclass(frozen=True)
class Column:
    """One column.

    Parameters
    ----------
    id, heading, tip : str
    text : callable
        What the cell shows.
    order : callable
        What spans are sorted by; ties stay in the order of time.
    typed : callable, optional
        The edit that typing comes to; without it the column is not editable.
    listed : {"label", "track"}, optional
        The cell is chosen from a list, and the choice goes to all spans that are selected.
    wide : str
        A text as wide as the column is at first.
    number : bool
        Stands at the right.
    hidden : bool
        At first.
    edge : Edge, optional
        What typing moves, in a column of times.
    """

    id: str
    heading: str
    tip: str
    text: Callable[[Span, Timebase], str]
    order: Callable[[Span], Any]
    typed: Typed | None = None
    listed: Literal["label", "track"] | None = None
    wide: str = "000.000"
    number: bool = False
    hidden: bool = False
    edge: Edge | None = None


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
        "start", "Start s", f"First instant. Type {_TIMES}: the first one of the span",
        lambda span, _: f"{span.start_s:.3f}", lambda span: span.start_s, _START.typed,
        number=True, edge=_START,
    ),
    Column(
        "end", "End s", f"Where it ends. Type {_TIMES}: the last one of the span",
        lambda span, _: f"{span.end_s:.3f}", lambda span: span.end_s, _END.typed,
        number=True, edge=_END,
    ),
    Column(
        "label", "Label", "A label of the set; of several selected spans all get it",
        lambda span, _: span.label, lambda span: span.label.casefold(), _label, "label",
        wide="■ right-to-left",
    ),
    Column(
        "duration", "Length s", "How long it is. Type seconds or frames (12 f): its end moves",
        lambda span, _: f"{span.duration_s:.3f}", lambda span: span.duration_s,
        _DURATION.typed, number=True, edge=_DURATION,
    ),
    Column(
        "frames", "Frames", "The first frame and the last one",
        _frames, lambda span: span.start_s, wide="0000–0000", number=True,
    ),
    Column(
        "track", "Track", "A track; several selected spans all go there",
        lambda span, _: span.track, lambda span: span.track.casefold(), _track, "track",
        wide="Gestures ▾",
    ),
    Column(
        "note", "Note", "Any words",
        lambda span, _: span.note, lambda span: span.note.casefold(), _note,
        wide="some words",
    ),
    Column(
        "author", "Author", "Who marked it",
        lambda span, _: span.author, lambda span: span.author.casefold(), _author,
        wide="somebody", hidden=True,
    ),
    Column(
        "confidence", "Sure", "How sure one is of it, 0 to 1",
        lambda span, _: "" if span.confidence is None else f"{span.confidence:g}",
        lambda span: -1.0 if span.confidence is None else span.confidence, _confidence,
        wide="0.00", number=True, hidden=True,
    ),
    Column(
        "origin", "Origin", "A person, a suggestion, or an import",
        lambda span, _: span.origin, lambda span: span.origin, wide="suggestion", hidden=True,
    ),
)  # fmt: skip
