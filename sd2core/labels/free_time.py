"""Frame edges and free time: the places that edges of spans can take or snap to."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from operator import attrgetter

import numpy as np

from sd2core.errors import Sd2Error
from sd2core.labels.spans import Labels, Span
from sd2core.timebase import Timebase


class NoRoom(Sd2Error):
    """An edit that is refused because what it would put somewhere finds no free frame there."""


TimeRange = tuple[float, float]
"""Half-open ``[start_s, end_s)``."""


@dataclass(frozen=True, eq=False)
class LabelledFrames:
    """Labels, and the frames of their recording, on whose edges those of spans are put."""

    labels: Labels
    timebase: Timebase

    @property
    def whole(self) -> TimeRange:
        """Start and end of the recording."""
        return self.timebase.start_s, self.timebase.end_s

    def nearest(self, time_s: float) -> float:
        """Return the edge of a frame closest to a time (the earlier one on a tie)."""
        if not math.isfinite(time_s):
            raise Sd2Error(f"A span was to begin or end at {time_s} s", "a finite time in seconds")
        after = int(np.searchsorted(self.timebase.edges_s, time_s))
        near = self.timebase.edges_s[max(after - 1, 0) : after + 1]
        return float(near[np.argmin(np.abs(near - time_s))])

    def stepped(self, time_s: float, frames: int) -> float:
        """Return the time some edges later or earlier, inside the recording.

        A time between two edges goes to an edge with the first step.
        """
        edges_s = self.timebase.edges_s
        if frames > 0:
            index = int(np.searchsorted(edges_s, time_s, "right")) + frames - 1
        else:
            index = int(np.searchsorted(edges_s, time_s)) + frames
        return float(edges_s[min(max(index, 0), len(edges_s) - 1)])

    def first_from(self, start_s: float) -> int:
        """Return the first frame that begins at ``start_s`` or later; T where there is none."""
        return int(np.searchsorted(self.timebase.times_s, start_s))

    def last_before(self, end_s: float) -> int:
        """Return the last frame that begins before ``end_s``; -1 where there is none."""
        return int(np.searchsorted(self.timebase.times_s, end_s)) - 1

    def held(self, start_s: float, end_s: float) -> int:
        """Count the frames that begin in ``[start_s, end_s)``."""
        return max(self.last_before(end_s) - self.first_from(start_s) + 1, 0)

    def stretch(self, one_s: float, other_s: float) -> TimeRange:
        """From edge to edge between two times in any order, at least a frame."""
        start_s, end_s = (self.nearest(time_s) for time_s in sorted((one_s, other_s)))
        if start_s < end_s:
            return start_s, end_s
        # Both are nearest to one edge: the frame on screen at the earlier of the two.
        shown = int(np.searchsorted(self.timebase.times_s, min(one_s, other_s), "right")) - 1
        first = min(max(shown, 0), len(self.timebase) - 1)
        return float(self.timebase.edges_s[first]), float(self.timebase.edges_s[first + 1])

    def placed(self, start_s: float, duration_s: float, room: TimeRange) -> TimeRange | None:
        """Place a stretch of a given start and duration inside limits.

        It keeps its duration where frames and limits allow it. None where the limits hold no frame.
        """
        low_s, high_s = room
        if not self.held(low_s, high_s):
            return None
        edges_s = self.timebase.edges_s
        start_s = min(max(self.nearest(start_s), low_s), edges_s[self.last_before(high_s)])
        if start_s + duration_s > high_s:
            start_s, end_s = max(self.nearest(high_s - duration_s), low_s), high_s
        else:
            end_s = min(self.nearest(start_s + duration_s), high_s)
        if not self.held(start_s, end_s):
            first = min(self.first_from(start_s), self.last_before(high_s))
            start_s = min(start_s, edges_s[first])
            end_s = min(edges_s[first + 1], high_s)
        return float(start_s), float(end_s)

    def limits_of(self, moved: Sequence[Span]) -> list[TimeRange]:
        """Return the times between which each of some spans can be moved.

        On an exclusive track these are its neighbours that are not moved as well.
        """
        ids = {span.id for span in moved}
        staying: dict[str, list[Span]] = {}
        for name in {span.track for span in moved}:
            if self.labels.track(name).overlap == "exclusive":
                staying[name] = [one for one in self.labels.of_track(name) if one.id not in ids]
        limits = []
        for span in moved:
            low_s, high_s = self.whole
            others = staying.get(span.track, [])
            after = bisect_left(others, span.start_s, key=attrgetter("start_s"))
            if after > 0:
                low_s = max(low_s, others[after - 1].end_s)
            if after < len(others):
                high_s = min(high_s, others[after].start_s)
            limits.append((low_s, high_s))
        return limits

    def steps_free(self, span: Span, room: TimeRange, count: int) -> int:
        """Limit a move by ``count`` frames, negative to earlier ones, to those inside its limits.

        These are as :meth:`limits_of` finds them.
        """
        low_s, high_s = room
        edges_s = self.timebase.edges_s
        if count < 0:
            wall, here = edges_s.searchsorted([low_s, span.start_s]).tolist()
            return max(count, min(wall - here, 0))
        wall, here = edges_s.searchsorted([high_s, span.end_s], "right").tolist()
        return min(count, max(wall - here, 0))

    def free_parts(self, track: str, wanted: TimeRange) -> list[TimeRange]:
        """Return the parts of a stretch that no span of a track covers, in order."""
        parts = []
        low_s, high_s = wanted
        for span in self.labels.spans:
            if span.start_s >= high_s:
                break
            if span.track == track and span.end_s > low_s:
                if span.start_s > low_s:
                    parts.append((low_s, span.start_s))
                low_s = span.end_s
        if low_s < high_s:
            parts.append((low_s, high_s))
        return parts

    def clip_to_free(self, track: str, wanted: TimeRange) -> TimeRange:
        """Return the longest free part of a stretch; all of it where spans may overlap.

        Raises NoRoom when no frame of it is free.
        """
        if self.labels.track(track).overlap == "free":
            return wanted
        parts = [one for one in self.free_parts(track, wanted) if self.held(*one)]
        if not parts:
            raise NoRoom(
                f"From {wanted[0]:.3f} to {wanted[1]:.3f} s every frame has a span on {track!r}",
                "room for at least one frame on a track without overlaps",
                "Shorten or delete the span there, or take another track",
            )
        return max(parts, key=lambda part: part[1] - part[0])

    def snap(self, time_s: float, within_s: float, ignore: Collection[int] = ()) -> float:
        """Snap a time to the nearest edge of a span within a distance, else to that of a frame.

        Frames are always near: were they to compete with spans, spans would hardly ever win. Of
        edges equally near, a span's goes before a suggestion's, then the earlier one. Spans to
        ``ignore``, such as those being dragged, do not attract.
        """
        nearest_s = self.nearest(time_s)
        best: tuple[float, bool, float] | None = None
        for span in self.labels.spans:
            if span.start_s > time_s + within_s:
                break
            if span.end_s < time_s - within_s or span.id in ignore:
                continue
            for edge_s in (span.start_s, span.end_s):
                rank = (abs(edge_s - time_s), span.origin == "suggestion", edge_s)
                if rank[0] <= within_s and (best is None or rank < best):
                    best = rank
        return nearest_s if best is None else best[-1]

    def seen_at(self, track: str, now_s: float, reaction_s: float) -> float:
        """Return when the event that a key marks on a track was seen: the time of a frame.

        A key is pressed after the event was seen. The time is that of the frame on screen
        ``reaction_s`` earlier; not before the recording, nor, on an exclusive track, before the end
        of the span before, and never later than ``now_s``, that of the frame on screen.
        """
        frame = self.timebase.frame_at(now_s - reaction_s)
        if self.labels.track(track).overlap == "exclusive":
            ends_s = [one.end_s for one in self.labels.of_track(track) if one.end_s <= now_s]
            # An import's edge may be between two frames.
            frame = max(frame, self.first_from(max(ends_s))) if ends_s else frame
        return min(self.timebase.time_of(frame), now_s)


LONGEST_REACTION_S = 1.0
