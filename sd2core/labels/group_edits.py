"""Edits of several spans together: moved, nudged, copied as one, in one step.

Whatever the distances between them, they keep their order, and those that touch still do: every
edge goes to the frame edge nearest to where it would be. They stop as a whole where the first
of them meets a neighbour that stays, or an end of the recording.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

from sd2core.errors import Sd2Error
from sd2core.labels.edits import Edit, duplicate
from sd2core.labels.free_time import Frames, Stretch, steps_free
from sd2core.labels.spans import Labels, Span
from sd2core.timebase import Timebase


def move_together(
    labels: Labels, timebase: Timebase, ids: Collection[int], lead_id: int, start_s: float
) -> Edit:
    """Move spans so that one of them, which a hand holds, begins at a time."""
    frames = Frames.of(timebase)
    chosen = _chosen(labels, {*ids, lead_id})
    lead = labels.span(lead_id)
    rooms = _rooms(labels, chosen, frames)
    earliest_s = max(low_s - span.start_s for span, (low_s, _) in zip(chosen, rooms, strict=True))
    latest_s = min(high_s - span.end_s for span, (_, high_s) in zip(chosen, rooms, strict=True))
    by_s = frames.nearest(start_s) - lead.start_s
    # Whoever lies outside (an import) is not in the way of the others.
    by_s = min(max(by_s, min(earliest_s, 0.0)), max(latest_s, 0.0))
    moved = []
    for span, (low_s, high_s) in zip(chosen, rooms, strict=True):
        first_s, last_s = (frames.nearest(edge + by_s) for edge in (span.start_s, span.end_s))
        moved.append(_put(span, max(first_s, low_s), min(last_s, high_s), frames))
    if by_s == 0.0:
        moved = chosen
    return Edit(_name("Move", moved), labels.with_spans(moved), tuple(one.id for one in moved))


def nudge_together(labels: Labels, timebase: Timebase, ids: Collection[int], count: int) -> Edit:
    """Move spans by so many frames, each keeping how many it holds."""
    frames = Frames.of(timebase)
    chosen = _chosen(labels, ids)
    rooms = _rooms(labels, chosen, frames)
    free = [steps_free(frames, span, room, count) for span, room in zip(chosen, rooms, strict=True)]
    count = min(free, key=abs)
    moved = chosen
    if count:
        moved = []
        for span in chosen:
            start_s, end_s = frames.stepped(span.start_s, count), frames.stepped(span.end_s, count)
            moved.append(_put(span, start_s, end_s, frames))
    return Edit(_name("Nudge", moved), labels.with_spans(moved), tuple(one.id for one in moved))


def duplicate_together(
    labels: Labels, timebase: Timebase, ids: Collection[int], start_s: float
) -> Edit:
    """Copy spans, so that the first copy begins at a time; each where there is room for it."""
    chosen = _chosen(labels, ids)
    after = labels
    made: list[int] = []
    for span in chosen:
        place_s = start_s + span.start_s - chosen[0].start_s
        edit = duplicate(after, timebase, span.id, place_s)
        after = edit.labels
        made += edit.ids
    return Edit(_name("Duplicate", chosen), after, tuple(made))


def _chosen(labels: Labels, ids: Collection[int]) -> list[Span]:
    wanted = set(ids)
    chosen = [span for span in labels.spans if span.id in wanted]
    if len(chosen) < max(len(wanted), 1):
        raise Sd2Error(f"{len(chosen)} of {len(wanted)} spans are there", "spans that exist")
    return chosen


def _rooms(labels: Labels, chosen: Sequence[Span], frames: Frames) -> list[Stretch]:
    """How far each can reach before it meets one that stays, in one pass for thousands."""
    low_s, high_s = frames.whole
    moving = {span.id for span in chosen}
    exclusive = {track.name for track in labels.tracks if track.overlap == "exclusive"}
    lows, highs = {}, {}
    wall = dict.fromkeys(exclusive, low_s)
    for span in labels.spans:
        if span.id in moving:
            lows[span.id] = wall.get(span.track, low_s)
        elif span.track in exclusive:
            wall[span.track] = max(wall[span.track], span.end_s)
    wall = dict.fromkeys(exclusive, high_s)
    for span in reversed(labels.spans):
        if span.id in moving:
            highs[span.id] = wall.get(span.track, high_s)
        elif span.track in exclusive:
            wall[span.track] = min(wall[span.track], span.start_s)
    return [(lows[span.id], highs[span.id]) for span in chosen]


def _put(span: Span, start_s: float, end_s: float, frames: Frames) -> Span:
    if not frames.held(start_s, end_s):
        raise Sd2Error(
            f"{span.words()} would hold no frame there",
            "a place where each of the spans holds one",
            "Move it by itself",
        )
    return replace(span, start_s=start_s, end_s=end_s)


def _name(verb: str, spans: Sequence[Span]) -> str:
    return f"{verb} {len(spans)} spans" if len(spans) > 1 else f"{verb} span"
