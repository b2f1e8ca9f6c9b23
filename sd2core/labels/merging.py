"""Merging of two states of labels that began as one."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import TypeVar

from sd2core.labels.import_labels import free_name
from sd2core.labels.label_set import LabelSet, with_own_keys
from sd2core.labels.spans import Labels, LabelTrack, Span

Value = TypeVar("Value")


@dataclass(frozen=True)
class Merged:
    """Labels of both sides, with numbers of spans that both sides changed or made."""

    labels: Labels
    both: int  # Both changed a span in different ways: two spans are there now.
    aside: int  # Spans of theirs that lie on a track of their own, for want of room.


def merge(base: Labels, mine: Labels, theirs: Labels) -> Merged:
    """Merge two states of labels by the ids of spans.

    What one side added, changed or removed since ``base`` holds. Of a span that both changed in
    different ways both are kept, theirs with a new id; one that a side changed and the other
    removed is kept. What both did alike is there once. A span of theirs that has no room beside
    mine on an exclusive track goes to one of its own below, called ``NAME (both)``.

    Tracks and labels of the set are merged by their names in the same way; where both changed one,
    mine holds. A track that a side removed stays while spans are on it.
    """
    old = {span.id: span for span in base.spans}
    ours = {span.id: span for span in mine.spans}
    others = {span.id: span for span in theirs.spans}
    kept = [
        span
        for span in mine.spans
        if span.id not in old or span != old[span.id] or others.get(span.id) == span
    ]
    alike = {replace(span, id=1) for span in kept if span != old.get(span.id)}
    free_id = max(side.next_id for side in (base, mine, theirs))
    brought, both = [], 0
    for span in theirs.spans:
        before, here = old.get(span.id), ours.get(span.id)
        if span == before or replace(span, id=1) in alike:
            continue
        if here is not None and here != before:
            both += before is not None
            span, free_id = replace(span, id=free_id), free_id + 1
        brought.append(span)
    tracks = _tracks(base, mine, theirs, {span.track for span in (*kept, *brought)})
    tracks, spans, aside = _with_room(tracks, (*kept, *brought))
    label_set = _label_set(base.label_set, mine.label_set, theirs.label_set)
    merged = Labels(tuple(tracks), tuple(spans), label_set)
    return Merged(mine if merged == mine else merged, both, aside)


def chosen(base: Value | None, mine: Value, theirs: Value) -> Value:
    """Value of the side that changed it; mine where both did."""
    return theirs if mine == base else mine


def _by_name(
    base: Mapping[str, Value], mine: Mapping[str, Value], theirs: Mapping[str, Value]
) -> dict[str, Value]:
    """Entries of both sides, without those that a side removed and the other left as they were."""
    order = theirs if list(mine) == list(base) else mine
    merged = {}
    for name in dict.fromkeys((*order, *mine, *theirs)):
        before = base.get(name)
        if name in mine and name in theirs:
            merged[name] = chosen(before, mine[name], theirs[name])
        elif (one := mine.get(name) or theirs.get(name)) is not None and one != before:
            merged[name] = one
    return merged


def _tracks(base: Labels, mine: Labels, theirs: Labels, used: set[str]) -> list[LabelTrack]:
    named = [{one.name: one for one in side.tracks} for side in (base, mine, theirs)]
    merged = _by_name(*named)
    for side in (named[1], named[2]):
        merged.update((name, one) for name, one in side.items() if name in used - merged.keys())
    return list(merged.values())


def _with_room(
    tracks: list[LabelTrack], spans: Iterable[Span]
) -> tuple[list[LabelTrack], list[Span], int]:
    """Put each span on its track, or on one below where those before it leave no room."""
    taken: dict[str, list[tuple[float, float]]] = {
        track.name: [] for track in tracks if track.overlap == "exclusive"
    }
    placed: list[Span] = []
    below: dict[str, LabelTrack] = {}
    aside = 0
    for span in spans:
        occupied = taken.get(span.track)
        if occupied is not None:
            at = bisect_left(occupied, (span.start_s, span.end_s))
            near = occupied[max(at - 1, 0) : at + 1]
            if not any(start_s < span.end_s and span.start_s < end_s for start_s, end_s in near):
                occupied.insert(at, (span.start_s, span.end_s))
            else:
                if span.track not in below:
                    names = {one.name for one in (*tracks, *below.values())}
                    below[span.track] = LabelTrack(free_name(span.track, "both", names), "free")
                span, aside = replace(span, track=below[span.track].name), aside + 1
        placed.append(span)
    after = [one for track in tracks for one in (track, below.get(track.name)) if one is not None]
    return after, placed, aside


def _label_set(base: LabelSet, mine: LabelSet, theirs: LabelSet) -> LabelSet:
    if base in (mine, theirs) or mine == theirs:
        return chosen(base, mine, theirs)
    named = [{one.name: one for one in side.labels} for side in (base, mine, theirs)]
    merged = _by_name(*named)
    brought = [one for name, one in merged.items() if one != named[1].get(name)]
    kept_keys = (one.key for name, one in merged.items() if one == named[1].get(name))
    merged |= {one.name: one for one in with_own_keys(brought, [*kept_keys])}
    return LabelSet(chosen(base.name, mine.name, theirs.name), tuple(merged.values()))
