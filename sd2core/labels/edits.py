"""Edits of the times of spans: create, move, resize, split, merge, overwrite.

Every edit (a method of :class:`Edits`) returns an :class:`Edit`: the labels afterwards and the
name of the step. Labels are never changed in place, so the labels before are the undo. Decision 30
has the reasons for these rules:

- An edge that an edit sets is that of a frame, inside the recording, and every span keeps the
  time of at least one frame. Edges that an edit does not set stay, on a frame or not.
- On an exclusive track an edge stops at the neighbour (exactly there, where an import has
  put the neighbour's edge between frames), and so does a moved span. A new span is clipped
  to the longest free part of the time asked for. Where no frame is free the edit is refused.
  Only :meth:`Edits.overwrite` shortens spans that were not named.
- An edit that changes nothing returns the very labels that it was given.

During a mouse drag, call the edit with the labels from before the drag and the present place:
it can then stop at a neighbour and come back.

Edits of several spans together keep their order, and those that touch still touch: every edge
goes to the nearest frame edge. They stop together where the first of them meets a neighbour that
is not moved, or an end of the recording.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from sd2core.errors import Sd2Error
from sd2core.labels.free_time import LabelledFrames, NoRoom, TimeRange
from sd2core.labels.spans import Labels, Span

Side = Literal["start", "end"]


@dataclass(frozen=True)
class Edit:
    """Result of an edit."""

    name: str  # Name of the step in the history, such as "Move span".
    labels: Labels  # After the edit.
    ids: tuple[int, ...] = ()  # Spans that were made or changed, to be selected next.


class Edits(LabelledFrames):
    """Edits of the times of spans, given all labels and the frames of the recording."""

    def create(self, track: str, start_s: float, end_s: float, label: str) -> Edit:
        """Create a span between two times, clipped to the free time of the track.

        Parameters
        ----------
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
        part = self.clip_to_free(track, self.stretch(start_s, end_s))
        made = Span(self.labels.next_id, track, *part, label)
        return Edit("Create span", self.labels.with_spans([made]), (made.id,))

    def duplicate(self, ids: Collection[int], start_s: float) -> Edit:
        """Copy spans so that the first copy begins at a time; each is clipped to free time.

        The others keep their distances from it. Raises Sd2Error when there is no free frame for a
        copy.
        """
        chosen = _chosen(self.labels, ids)
        now: LabelledFrames = self
        made: list[int] = []
        for span in chosen:
            place_s = start_s + (span.start_s - chosen[0].start_s)
            # A recording has frames, so there is room.
            wanted = self.placed(place_s, span.duration_s, self.whole) or self.whole
            first_s, last_s = now.clip_to_free(span.track, wanted)
            copy = replace(span, id=now.labels.next_id, start_s=first_s, end_s=last_s)
            now = replace(now, labels=now.labels.with_spans([copy]))
            made.append(copy.id)
        return Edit(_name("Duplicate", chosen), now.labels, tuple(made))

    def resize(self, span_id: int, side: Side, time_s: float) -> Edit:
        """Move one edge of a span to the frame edge nearest to a time, as far as it can go."""
        span, edges_s = self.labels.span(span_id), self.timebase.edges_s
        ((low_s, high_s),) = self.limits_of([span])
        wanted_s = self.nearest(time_s)
        if side == "start":
            latest_s = float(edges_s[max(self.last_before(span.end_s), 0)])
            changed = self._timed(span, max(min(wanted_s, latest_s), low_s), span.end_s)
        else:
            first = min(self.first_from(span.start_s), len(self.timebase) - 1)
            earliest_s = float(edges_s[first + 1])
            changed = self._timed(span, span.start_s, min(max(wanted_s, earliest_s), high_s))
        return Edit(f"Move {side} of span", self.labels.with_spans([changed]), (span_id,))

    def move(self, ids: Collection[int], lead_id: int, start_s: float) -> Edit:
        """Move spans so that the lead, which is dragged and may be among them, begins at a time.

        Frame edges and neighbours decide how near it comes. One alone keeps its duration; several
        keep their order and their contacts.
        """
        chosen = _chosen(self.labels, {*ids, lead_id})
        limits = self.limits_of(chosen)
        if len(chosen) == 1:
            (span,), (room,) = chosen, limits
            place = self.placed(start_s, span.duration_s, room)
            moved = [self._timed(span, *(place or (span.start_s, span.end_s)))]
        else:
            by_s = self.nearest(start_s) - self.labels.span(lead_id).start_s
            moved = self._moved_by(by_s, chosen, limits)
        ids = tuple(one.id for one in moved)
        return Edit(_name("Move", moved), self.labels.with_spans(moved), ids)

    def nudge(self, ids: Collection[int], count: int) -> Edit:
        """Move spans by some frames, negative to earlier ones; they stop at neighbours.

        Each keeps its number of frames. Where frames are not evenly spaced their durations change,
        and a step back restores them. A span alone that is between frames goes to them with the
        first step.
        """
        chosen = _chosen(self.labels, ids)
        limits = self.limits_of(chosen)
        alone = len(chosen) == 1
        pairs = list(zip(chosen, limits, strict=True))
        count = min((self.steps_free(span, room, count) for span, room in pairs), key=abs)
        moved = []
        for span, (_, high_s) in pairs if count else ():
            start_s, end_s = self.stepped(span.start_s, count), self.stepped(span.end_s, count)
            if alone and not self.held(start_s, end_s):  # one that lay between two frames
                start_s, end_s = self.stretch(start_s, start_s)
                end_s = min(end_s, high_s)
            moved.append(self._timed(span, start_s, end_s, alone=alone))
        after = self.labels.with_spans(moved)
        return Edit(_name("Nudge", chosen), after, tuple(one.id for one in chosen))

    def split(self, span_id: int, time_s: float) -> Edit:
        """Split a span at the frame nearest to a time; the first part keeps the id.

        Raises Sd2Error when the time is not within the span, or that holds a single frame.
        """
        span = self.labels.span(span_id)
        if not span.start_s <= time_s <= span.end_s:
            raise Sd2Error(f"{span.words()} is to be split at {time_s:.3f} s", "a time within it")
        at_s = self._frame_between(span, span, time_s)
        if at_s is None:
            expected = "two frames or more, to be split"
            raise Sd2Error(f"{span.words()} holds a single frame", expected)
        left, right = _met(span, replace(span, id=self.labels.next_id), at_s)
        return Edit("Split span", self.labels.with_spans([left, right]), (left.id, right.id))

    def join_at(self, one_id: int, other_id: int, time_s: float) -> Edit:
        """Make two neighbours on a track meet at the frame nearest to a time: no gap, no overlap.

        Each keeps a frame at least, however far away that is. Raises Sd2Error when they are no
        neighbours on one track, or have one frame between them.
        """
        left, right = sorted(
            (self.labels.span(one_id), self.labels.span(other_id)),
            key=lambda one: (one.start_s, one.end_s),
        )
        between = [span.id for span in self.labels.of_track(left.track)]
        both = f"{left.words()} and {right.words()}"
        if left.track != right.track or between.index(right.id) != between.index(left.id) + 1:
            raise Sd2Error(f"{both} are to meet", "two neighbours on one track")
        at_s = self._frame_between(left, right, time_s)
        if at_s is None:
            raise Sd2Error(f"{both} have one frame between them", "one for each")
        met = _met(left, right, at_s)
        return Edit("Let spans meet", self.labels.with_spans(met), (left.id, right.id))

    def fill_gaps(self, track: str, label: str) -> Edit:
        """Create a span in every gap of a track that holds a frame, e.g. of background.

        Gaps before the first and after the last span count.
        """
        self.labels.track(track)
        gaps = [gap for gap in self.free_parts(track, self.whole) if self.held(*gap)]
        free_id = self.labels.next_id
        made = [Span(free_id + k, track, *gap, label) for k, gap in enumerate(gaps)]
        return Edit("Fill gaps", self.labels.with_spans(made), tuple(span.id for span in made))

    def overwrite(self, track: str, start_s: float, end_s: float, label: str) -> Edit:
        """Create a span between two times, cutting away other spans of the track there.

        A span around it is split; parts without a single frame are deleted.

        Parameters
        ----------
        track, start_s, end_s, label
            As for :meth:`create`.
        """
        self.labels.track(track)
        made = Span(self.labels.next_id, track, *self.stretch(start_s, end_s), label)
        free_id = made.id + 1
        put, gone = [made], set()
        for span in self.labels.of_track(track):
            if not span.overlaps(made):
                continue
            gone.add(span.id)
            sides = ((span.start_s, made.start_s), (made.end_s, span.end_s))
            for count, (low_s, high_s) in enumerate(side for side in sides if self.held(*side)):
                span_id = free_id if count else span.id
                put.append(replace(span, id=span_id, start_s=low_s, end_s=high_s))
                free_id += count
        after = self.labels.with_spans(put, without=gone)
        return Edit("Create span over others", after, (made.id,))

    def _moved_by(
        self, by_s: float, chosen: Sequence[Span], limits: Sequence[TimeRange]
    ) -> list[Span]:
        """Several spans moved by a time, as far as all of them can go, each edge to the nearest."""
        pairs = list(zip(chosen, limits, strict=True))
        earliest_s = max(low_s - span.start_s for span, (low_s, _) in pairs)
        latest_s = min(high_s - span.end_s for span, (_, high_s) in pairs)
        # Whoever lies outside (an import) is not in the way of the others.
        by_s = min(max(by_s, min(earliest_s, 0.0)), max(latest_s, 0.0))
        moved = []
        for span, (low_s, high_s) in pairs:
            start_s = max(self.nearest(span.start_s + by_s), low_s)
            end_s = min(self.nearest(span.end_s + by_s), high_s)
            moved.append(self._timed(span, start_s, end_s, alone=False))
        return moved if by_s else [*chosen]

    def _timed(self, span: Span, start_s: float, end_s: float, *, alone: bool = True) -> Span:
        if self.held(start_s, end_s):
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

    def _frame_between(self, left: Span, right: Span, time_s: float) -> float | None:
        """The frame nearest to a time at which both keep one; None where there is none."""
        times_s = self.timebase.times_s
        first, last = self.first_from(left.start_s) + 1, self.last_before(right.end_s)
        if first > last:
            return None
        return float(min(max(self.nearest(time_s), times_s[first]), times_s[last]))


Change = Callable[[Edits], Edit]
"""Edit that waits for the labels and frames to be applied to."""


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


def _met(left: Span, right: Span, at_s: float) -> tuple[Span, Span]:
    return replace(left, end_s=at_s), replace(right, start_s=at_s)


def _chosen(labels: Labels, ids: Collection[int]) -> list[Span]:
    chosen = labels.these(ids)
    if not chosen:
        raise Sd2Error("0 of 0 spans are there", "spans that exist")
    return chosen


def _name(verb: str, spans: Sequence[Span]) -> str:
    return f"{verb} {len(spans)} spans" if len(spans) > 1 else f"{verb} span"
