"""Frame edges and free time: the places that edges of spans can take or snap to."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from operator import attrgetter

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.labels.spans import Labels, Span
from sd2core.timebase import Timebase


class NoRoom(Sd2Error):
    """An edit that is refused because what it would put somewhere finds no free frame there."""


TimeRange = tuple[float, float]
"""Half-open ``[start_s, end_s)``."""


@dataclass(frozen=True, eq=False)
class Frames:
    """Edges of the frames of a recording."""

    times_s: NDArray[np.float64]  # Starts of the frames, (T,).
    edges_s: NDArray[np.float64]  # The same and the end of the last frame, (T + 1,).

    @classmethod
    def of(cls, timebase: Timebase) -> Frames:
        """Return the edges of the frames of a recording."""
        return cls(timebase.times_s, timebase.edges_s)

    @property
    def whole(self) -> TimeRange:
        """Start and end of the recording."""
        return float(self.edges_s[0]), float(self.edges_s[-1])

    def nearest(self, time_s: float) -> float:
        """Return the edge closest to a time (the earlier one on a tie)."""
        if not math.isfinite(time_s):
            raise Sd2Error(f"A span was to begin or end at {time_s} s", "a finite time in seconds")
        after = int(np.searchsorted(self.edges_s, time_s))
        near = self.edges_s[max(after - 1, 0) : after + 1]
        return float(near[np.argmin(np.abs(near - time_s))])

    def stepped(self, time_s: float, frames: int) -> float:
        """Return the time some edges later or earlier, inside the recording.

        A time between two edges goes to an edge with the first step.
        """
        if frames > 0:
            index = int(np.searchsorted(self.edges_s, time_s, "right")) + frames - 1
        else:
            index = int(np.searchsorted(self.edges_s, time_s)) + frames
        return float(self.edges_s[min(max(index, 0), len(self.edges_s) - 1)])

    def first_from(self, start_s: float) -> int:
        """Return the first frame that begins at ``start_s`` or later; T where there is none."""
        return int(np.searchsorted(self.times_s, start_s))

    def last_before(self, end_s: float) -> int:
        """Return the last frame that begins before ``end_s``; -1 where there is none."""
        return int(np.searchsorted(self.times_s, end_s)) - 1

    def held(self, start_s: float, end_s: float) -> int:
        """Count the frames that begin in ``[start_s, end_s)``."""
        return max(self.last_before(end_s) - self.first_from(start_s) + 1, 0)

    def stretch(self, one_s: float, other_s: float) -> TimeRange:
        """From edge to edge between two times in any order, at least a frame."""
        start_s, end_s = (self.nearest(time_s) for time_s in sorted((one_s, other_s)))
        if start_s < end_s:
            return start_s, end_s
        # Both are nearest to one edge: the frame on screen at the earlier of the two.
        shown = int(np.searchsorted(self.times_s, min(one_s, other_s), "right")) - 1
        first = min(max(shown, 0), len(self.times_s) - 1)
        return float(self.edges_s[first]), float(self.edges_s[first + 1])

    def placed(self, start_s: float, duration_s: float, room: TimeRange) -> TimeRange | None:
        """Place a stretch of a given start and duration inside limits.

        It keeps its duration where frames and limits allow it. None where the limits hold no frame.
        """
        low_s, high_s = room
        if not self.held(low_s, high_s):
            return None
        start_s = min(max(self.nearest(start_s), low_s), self.edges_s[self.last_before(high_s)])
        if start_s + duration_s > high_s:
            start_s, end_s = max(self.nearest(high_s - duration_s), low_s), high_s
        else:
            end_s = min(self.nearest(start_s + duration_s), high_s)
        if not self.held(start_s, end_s):
            first = min(self.first_from(start_s), self.last_before(high_s))
            start_s = min(start_s, self.edges_s[first])
            end_s = min(self.edges_s[first + 1], high_s)
        return float(start_s), float(end_s)


def limits_of(labels: Labels, moved: Sequence[Span], frames: Frames) -> list[TimeRange]:
    """Return the times between which each of some spans can be moved.

    On an exclusive track these are its neighbours that are not moved as well.
    """
    ids = {span.id for span in moved}
    staying: dict[str, list[Span]] = {}
    for name in {span.track for span in moved}:
        if labels.track(name).overlap == "exclusive":
            staying[name] = [one for one in labels.of_track(name) if one.id not in ids]
    limits = []
    for span in moved:
        low_s, high_s = frames.whole
        others = staying.get(span.track, [])
        after = bisect_left(others, span.start_s, key=attrgetter("start_s"))
        if after > 0:
            low_s = max(low_s, others[after - 1].end_s)
        if after < len(others):
            high_s = min(high_s, others[after].start_s)
        limits.append((low_s, high_s))
    return limits


def steps_free(frames: Frames, span: Span, room: TimeRange, count: int) -> int:
    """Limit a move by ``count`` frames to those that a span can make inside its limits.

    Parameters
    ----------
    frames : Frames
    span : Span
    room : (float, float)
        Limits of the span, as :func:`limits_of` finds them.
    count : int
        Frames; negative to earlier ones.

    Returns
    -------
    int
        From 0 to ``count``.
    """
    low_s, high_s = room
    if count < 0:
        wall = int(frames.edges_s.searchsorted(low_s))
        here = int(frames.edges_s.searchsorted(span.start_s))
        return max(count, min(wall - here, 0))
    wall = int(frames.edges_s.searchsorted(high_s, "right"))
    here = int(frames.edges_s.searchsorted(span.end_s, "right"))
    return min(count, max(wall - here, 0))


def free_parts(labels: Labels, track: str, wanted: TimeRange) -> list[TimeRange]:
    """Return the parts of a stretch that no span of a track covers, in order."""
    parts = []
    low_s, high_s = wanted
    for span in labels.spans:
        if span.start_s >= high_s:
            break
        if span.track == track and span.end_s > low_s:
            if span.start_s > low_s:
                parts.append((low_s, span.start_s))
            low_s = span.end_s
    if low_s < high_s:
        parts.append((low_s, high_s))
    return parts


def clip_to_free(labels: Labels, track: str, wanted: TimeRange, frames: Frames) -> TimeRange:
    """Return the longest free part of a stretch; all of it where spans may overlap.

    Parameters
    ----------
    labels : Labels
    track : str
        Name of one of the tracks.
    wanted : (float, float)
        Start and end in seconds.
    frames : Frames

    Raises
    ------
    Sd2Error
        When no frame of it is free.
    """
    if labels.track(track).overlap == "free":
        return wanted
    parts = [one for one in free_parts(labels, track, wanted) if frames.held(*one)]
    if not parts:
        raise NoRoom(
            f"From {wanted[0]:.3f} to {wanted[1]:.3f} s every frame has a span on {track!r}",
            "room for at least one frame on a track without overlaps",
            "Shorten or delete the span there, or take another track",
        )
    return max(parts, key=lambda part: part[1] - part[0])


def snap(
    labels: Labels,
    timebase: Timebase,
    time_s: float,
    within_s: float,
    *,
    ignore: Collection[int] = (),
) -> float:
    """Snap a time to the nearest edge of a span within a distance, else to the nearest frame edge.

    Frames are always near: were they to compete with spans, spans would hardly ever win. Of edges
    equally near, a span's goes before a suggestion's, then the earlier one.

    Parameters
    ----------
    labels : Labels
    timebase : Timebase
        Of the recording.
    time_s : float
    within_s : float
        Distance from which a span attracts, some pixels of the time axis; 0: only exact hits.
    ignore : collection of int
        Spans that do not attract, such as those being dragged.
    """
    nearest_s = Frames.of(timebase).nearest(time_s)
    best: tuple[float, bool, float] | None = None
    for span in labels.spans:
        if span.start_s > time_s + within_s:
            break
        if span.end_s < time_s - within_s or span.id in ignore:
            continue
        for edge_s in (span.start_s, span.end_s):
            rank = (abs(edge_s - time_s), span.origin == "suggestion", edge_s)
            if rank[0] <= within_s and (best is None or rank < best):
                best = rank
    return nearest_s if best is None else best[-1]


LONGEST_REACTION_S = 1.0


def seen_at(
    labels: Labels, timebase: Timebase, track: str, now_s: float, reaction_s: float
) -> float:
    """Return when the event that a key marks was seen: the time of a frame.

    A key is pressed after the event was seen. The time is that of the frame on screen
    ``reaction_s`` earlier; not before the recording, nor, on an exclusive track, before the end of
    the span before, and never later than ``now_s``.

    Parameters
    ----------
    labels : Labels
    timebase : Timebase
        Of the recording.
    track : str
        Name of the track on which the event is marked.
    now_s : float
        Time of the frame on screen.
    reaction_s : float
    """
    frame = timebase.frame_at(now_s - reaction_s)
    if labels.track(track).overlap == "exclusive":
        ends_s = [one.end_s for one in labels.of_track(track) if one.end_s <= now_s]
        # An import's edge may be between two frames.
        frame = max(frame, Frames.of(timebase).first_from(max(ends_s))) if ends_s else frame
    return min(timebase.time_of(frame), now_s)
