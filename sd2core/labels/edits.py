"""Edits of the times of spans: create, move, resize, split, merge, overwrite.

Every edit is a function of labels, frames and its arguments, and returns an :class:`Edit`: the
labels afterwards and the name of the step. Labels are never changed in place, so the labels
before are the undo. Decision 30 has the reasons for these rules:

- An edge that an edit sets is that of a frame, inside the recording, and every span keeps the
  time of at least one frame. Edges that an edit does not set stay, on a frame or not.
- On an exclusive track an edge stops at the neighbour (exactly there, where an import has
  put the neighbour's edge between frames), and so does a moved span. A new span is clipped
  to the longest free part of the time asked for. Where no frame is free the edit is refused.
  Only :func:`overwrite` shortens spans that were not named.
- An edit that changes nothing returns the very labels that it was given.

During a mouse drag, call the edit with the labels from before the drag and the present place:
it can then stop at a neighbour and come back.

Edits of several spans together keep their order, and those that touch still touch: every edge
goes to the nearest frame edge. They stop together where the first of them meets a neighbour that
is not moved, or an end of the recording.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from sd2core.errors import Sd2Error
from sd2core.labels.free_time import (
    Frames,
    NoRoom,
    TimeRange,
    clip_to_free,
    free_parts,
    limits_of,
    steps_free,
)
from sd2core.labels.spans import Labels, Span
from sd2core.timebase import Timebase

Side = Literal["start", "end"]


@dataclass(frozen=True)
class Edit:
    """Result of an edit."""

    name: str  # Name of the step in the history, such as "Move span".
    labels: Labels  # After the edit.
    ids: tuple[int, ...] = ()  # Spans that were made or changed, to be selected next.


Change = Callable[[Labels, Timebase], Edit]
"""Edit that waits for the labels and frames to be applied to."""


def create(
    labels: Labels, timebase: Timebase, track: str, start_s: float, end_s: float, label: str
) -> Edit:
    """Create a span between two times, clipped to the free time of the track.

    Parameters
    ----------
    labels : Labels
    timebase : Timebase
        Of the recording.
    track : str
        Name of one of the tracks.
    start_s, end_s : float
        In either order; the edges go to the nearest frame edges.
    label : str

    Raises
    ------
    Sd2Error
        When no frame between them is free.
    """
    frames = Frames.of(timebase)
    part = clip_to_free(labels, track, frames.stretch(start_s, end_s), frames)
    made = Span(labels.next_id, track, *part, label)
    return Edit("Create span", labels.with_spans([made]), (made.id,))


def duplicate(labels: Labels, timebase: Timebase, ids: Collection[int], start_s: float) -> Edit:
    """Copy spans so that the first copy begins at a time; each is clipped to free time.

    Parameters
    ----------
    labels : Labels
    timebase : Timebase
        Of the recording.
    ids : collection of int
        Spans to copy.
    start_s : float
        Start of the copy of the first of them; the others keep their distances from it.

    Raises
    ------
    Sd2Error
        When there is no free frame for a copy.
    """
    frames, chosen = Frames.of(timebase), _chosen(labels, ids)
    after = labels
    made: list[int] = []
    for span in chosen:
        place_s = start_s + (span.start_s - chosen[0].start_s)
        # A recording has frames, so there is room.
        wanted = frames.placed(place_s, span.duration_s, frames.whole) or frames.whole
        first_s, last_s = clip_to_free(after, span.track, wanted, frames)
        copy = replace(span, id=after.next_id, start_s=first_s, end_s=last_s)
        after = after.with_spans([copy])
        made.append(copy.id)
    return Edit(_name("Duplicate", chosen), after, tuple(made))


def delete(labels: Labels, ids: Iterable[int]) -> Edit:
    """Delete spans."""
    gone = {span.id for span in labels.these(ids)}
    name = "Delete span" if len(gone) == 1 else f"Delete {len(gone)} spans"
    return Edit(name, labels.with_spans(without=gone))


def resize(labels: Labels, timebase: Timebase, span_id: int, side: Side, time_s: float) -> Edit:
    """Move one edge of a span to the frame edge nearest to a time, as far as it can go.

    Parameters
    ----------
    labels : Labels
    timebase : Timebase
        Of the recording.
    span_id : int
    side : {"start", "end"}
        Edge that is moved.
    time_s : float
    """
    frames = Frames.of(timebase)
    span = labels.span(span_id)
    ((low_s, high_s),) = limits_of(labels, [span], frames)
    wanted_s = frames.nearest(time_s)
    if side == "start":
        latest_s = float(frames.times_s[max(frames.last_before(span.end_s), 0)])
        changed = _timed(span, max(min(wanted_s, latest_s), low_s), span.end_s, frames)
    else:
        first = min(frames.first_from(span.start_s), len(timebase) - 1)
        earliest_s = float(frames.edges_s[first + 1])
        changed = _timed(span, span.start_s, min(max(wanted_s, earliest_s), high_s), frames)
    return Edit(f"Move {side} of span", labels.with_spans([changed]), (span_id,))


def move(
    labels: Labels, timebase: Timebase, ids: Collection[int], lead_id: int, start_s: float
) -> Edit:
    """Move spans so that one of them, the dragged one, begins at a time.

    One alone keeps its duration; several keep their order and their contacts.

    Parameters
    ----------
    labels : Labels
    timebase : Timebase
        Of the recording.
    ids : collection of int
        Spans to move; the lead may be among them.
    lead_id : int
        Span that is dragged.
    start_s : float
        Its wanted start; frame edges and neighbours decide how near it comes.
    """
    frames = Frames.of(timebase)
    chosen = _chosen(labels, {*ids, lead_id})
    limits = limits_of(labels, chosen, frames)
    if len(chosen) == 1:
        (span,), (room,) = chosen, limits
        place = frames.placed(start_s, span.duration_s, room)
        moved = [_timed(span, *(place or (span.start_s, span.end_s)), frames)]
    else:
        by_s = frames.nearest(start_s) - labels.span(lead_id).start_s
        moved = _moved_by(by_s, chosen, limits, frames)
    return Edit(_name("Move", moved), labels.with_spans(moved), tuple(one.id for one in moved))


def nudge(labels: Labels, timebase: Timebase, ids: Collection[int], count: int) -> Edit:
    """Move spans by some frames, each keeping their number; they stop at neighbours.

    Where frames are not evenly spaced their durations change, and a step back restores them. A
    span alone that is between frames goes to them with the first step.

    Parameters
    ----------
    labels : Labels
    timebase : Timebase
        Of the recording.
    ids : collection of int
    count : int
        Frames; negative to earlier ones.
    """
    frames = Frames.of(timebase)
    chosen = _chosen(labels, ids)
    limits = limits_of(labels, chosen, frames)
    alone = len(chosen) == 1
    free = [
        steps_free(frames, span, room, count) for span, room in zip(chosen, limits, strict=True)
    ]
    count = min(free, key=abs)
    moved = []
    for span, (_, high_s) in zip(chosen, limits, strict=True) if count else ():
        start_s, end_s = (frames.stepped(time_s, count) for time_s in (span.start_s, span.end_s))
        if alone and not frames.held(start_s, end_s):  # one that lay between two frames
            start_s, end_s = frames.stretch(start_s, start_s)
            end_s = min(end_s, high_s)
        moved.append(_timed(span, start_s, end_s, frames, alone=alone))
    after = labels.with_spans(moved)
    return Edit(_name("Nudge", chosen), after, tuple(one.id for one in chosen))


def split(labels: Labels, timebase: Timebase, span_id: int, time_s: float) -> Edit:
    """Split a span at the frame nearest to a time; the first part keeps the id.

    Parameters
    ----------
    labels : Labels
    timebase : Timebase
        Of the recording.
    span_id : int
    time_s : float
        Within the span.

    Raises
    ------
    Sd2Error
        When the time is not within the span, or that holds a single frame.
    """
    frames = Frames.of(timebase)
    span = labels.span(span_id)
    if not span.start_s <= time_s <= span.end_s:
        raise Sd2Error(f"{span.words()} is to be split at {time_s:.3f} s", "a time within it")
    first, last = frames.first_from(span.start_s) + 1, frames.last_before(span.end_s)
    if first > last:
        raise Sd2Error(f"{span.words()} holds a single frame", "two frames or more, to be split")
    at_s = min(max(frames.nearest(time_s), frames.times_s[first]), frames.times_s[last])
    left = replace(span, end_s=float(at_s))
    right = replace(span, id=labels.next_id, start_s=float(at_s))
    return Edit("Split span", labels.with_spans([left, right]), (left.id, right.id))


def merge(labels: Labels, ids: Sequence[int]) -> Edit:
    """Merge spans of one track into one, from the first start to the last end.

    The earliest of them keeps its id, label and person. Notes and authors that differ are joined,
    and the lowest confidence given holds. Raises Sd2Error when they are on several tracks, or
    another span of an exclusive track is between.
    """
    parts = labels.these(ids)
    tracks = sorted({span.track for span in parts})
    if len(parts) < 2 or len(tracks) != 1:
        raise Sd2Error(
            f"{len(parts)} spans on {', '.join(tracks) or 'no track'} are to be merged",
            "two or more spans of one track",
        )
    known = [span.confidence for span in parts if span.confidence is not None]
    merged = replace(
        parts[0],
        end_s=max(span.end_s for span in parts),
        note="; ".join(dict.fromkeys(span.note for span in parts if span.note)),
        author=", ".join(dict.fromkeys(span.author for span in parts if span.author)),
        confidence=min(known) if known else None,
    )
    gone = {span.id for span in parts}
    return Edit("Merge spans", labels.with_spans([merged], without=gone), (merged.id,))


def join_at(labels: Labels, timebase: Timebase, one_id: int, other_id: int, time_s: float) -> Edit:
    """Make two neighbours on a track meet at the frame nearest to a time: no gap, no overlap.

    Parameters
    ----------
    labels : Labels
    timebase : Timebase
        Of the recording.
    one_id, other_id : int
        In either order.
    time_s : float
        Each keeps a frame at least, however far away this is.

    Raises
    ------
    Sd2Error
        When they are no neighbours on one track, or have one frame between them.
    """
    frames = Frames.of(timebase)
    left, right = sorted(
        (labels.span(one_id), labels.span(other_id)), key=lambda one: (one.start_s, one.end_s)
    )
    between = [span.id for span in labels.of_track(left.track)]
    if left.track != right.track or between.index(right.id) != between.index(left.id) + 1:
        raise Sd2Error(
            f"{left.words()} and {right.words()} are to meet", "two neighbours on one track"
        )
    first, last = frames.first_from(left.start_s) + 1, frames.last_before(right.end_s)
    if first > last:
        raise Sd2Error(
            f"{left.words()} and {right.words()} have one frame between them", "one for each"
        )
    at_s = float(min(max(frames.nearest(time_s), frames.times_s[first]), frames.times_s[last]))
    met = [replace(left, end_s=at_s), replace(right, start_s=at_s)]
    return Edit("Let spans meet", labels.with_spans(met), (left.id, right.id))


def fill_gaps(labels: Labels, timebase: Timebase, track: str, label: str) -> Edit:
    """Create a span in every gap of a track that holds a frame, e.g. of background.

    Gaps before the first and after the last span count.

    Parameters
    ----------
    labels : Labels
    timebase : Timebase
        Of the recording.
    track : str
        Name of one of the tracks.
    label : str
        Of the new spans.
    """
    frames = Frames.of(timebase)
    labels.track(track)
    gaps = [gap for gap in free_parts(labels, track, frames.whole) if frames.held(*gap)]
    free_id = labels.next_id
    made = [Span(free_id + k, track, *gap, label) for k, gap in enumerate(gaps)]
    return Edit("Fill gaps", labels.with_spans(made), tuple(span.id for span in made))


def overwrite(
    labels: Labels, timebase: Timebase, track: str, start_s: float, end_s: float, label: str
) -> Edit:
    """Create a span between two times, cutting away other spans of the track there.

    A span around it is split; parts without a single frame are deleted.

    Parameters
    ----------
    labels, timebase, track, start_s, end_s, label
        As for :func:`create`.
    """
    frames = Frames.of(timebase)
    labels.track(track)
    made = Span(labels.next_id, track, *frames.stretch(start_s, end_s), label)
    free_id = made.id + 1
    put, gone = [made], set()
    for span in labels.of_track(track):
        if not span.overlaps(made):
            continue
        gone.add(span.id)
        sides = ((span.start_s, made.start_s), (made.end_s, span.end_s))
        for count, (low_s, high_s) in enumerate(side for side in sides if frames.held(*side)):
            put.append(replace(span, id=free_id if count else span.id, start_s=low_s, end_s=high_s))
            free_id += count
    return Edit("Create span over others", labels.with_spans(put, without=gone), (made.id,))


def _moved_by(
    by_s: float, chosen: Sequence[Span], limits: Sequence[TimeRange], frames: Frames
) -> list[Span]:
    """Several spans moved by a time, as far as all of them can go, each edge to the nearest."""
    pairs = list(zip(chosen, limits, strict=True))
    earliest_s = max(low_s - span.start_s for span, (low_s, _) in pairs)
    latest_s = min(high_s - span.end_s for span, (_, high_s) in pairs)
    # Whoever lies outside (an import) is not in the way of the others.
    by_s = min(max(by_s, min(earliest_s, 0.0)), max(latest_s, 0.0))
    moved = []
    for span, (low_s, high_s) in pairs:
        start_s, end_s = (frames.nearest(edge + by_s) for edge in (span.start_s, span.end_s))
        start_s, end_s = max(start_s, low_s), min(end_s, high_s)
        moved.append(_timed(span, start_s, end_s, frames, alone=False))
    return moved if by_s else [*chosen]


def _timed(span: Span, start_s: float, end_s: float, frames: Frames, *, alone: bool = True) -> Span:
    if frames.held(start_s, end_s):
        return replace(span, start_s=start_s, end_s=end_s)
    if alone:
        raise NoRoom(
            f"{span.words()} has no room for a frame",
            "room for one frame on its track, inside the recording",
            "Move or delete the spans beside it",
        )
    raise Sd2Error(
        f"{span.words()} would hold no frame there",
        "a place where each of the spans holds one",
        "Move it by itself",
    )


def _chosen(labels: Labels, ids: Collection[int]) -> list[Span]:
    chosen = labels.these(ids)
    if not chosen:
        raise Sd2Error("0 of 0 spans are there", "spans that exist")
    return chosen


def _name(verb: str, spans: Sequence[Span]) -> str:
    return f"{verb} {len(spans)} spans" if len(spans) > 1 else f"{verb} span"
