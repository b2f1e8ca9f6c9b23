"""Where the edges of a span may be: at frames, inside the recording, not past a neighbour."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.labels.spans import Labels, Span
from sd2core.timebase import Timebase

Stretch = tuple[float, float]
"""Half-open ``[start_s, end_s)``."""


@dataclass(frozen=True, eq=False)
class Frames:
    """The places where frames begin and end.

    Parameters
    ----------
    times_s : ndarray, shape (T,)
        Where frames begin.
    edges_s : ndarray, shape (T + 1,)
        The same and the end of the last one.
    """

    times_s: NDArray[np.float64]
    edges_s: NDArray[np.float64]

    @classmethod
    def of(cls, timebase: Timebase) -> Frames:
        """The frames of a recording."""
        return cls(timebase.times_s, np.append(timebase.times_s, timebase.end_s))

    @property
    def whole(self) -> Stretch:
        """From the start of the recording to its end."""
        return float(self.edges_s[0]), float(self.edges_s[-1])

    def nearest(self, time_s: float) -> float:
        """The edge closest to a time (the earlier one on a tie)."""
        if not math.isfinite(time_s):
            raise Sd2Error(f"A span was to begin or end at {time_s} s", "a finite time in seconds")
        after = int(np.searchsorted(self.edges_s, time_s))
        near = self.edges_s[max(after - 1, 0) : after + 1]
        return float(near[np.argmin(np.abs(near - time_s))])

    def stepped(self, time_s: float, frames: int) -> float:
        """So many edges later, or earlier, held at both ends; the first step goes to an edge."""
        if frames > 0:
            index = int(np.searchsorted(self.edges_s, time_s, "right")) + frames - 1
        else:
            index = int(np.searchsorted(self.edges_s, time_s)) + frames
        return float(self.edges_s[min(max(index, 0), len(self.edges_s) - 1)])

    def first_from(self, start_s: float) -> int:
        """The first frame that begins at ``start_s`` or later; T where there is none."""
        return int(np.searchsorted(self.times_s, start_s))

    def last_before(self, end_s: float) -> int:
        """The last frame that begins before ``end_s``; -1 where there is none."""
        return int(np.searchsorted(self.times_s, end_s)) - 1

    def held(self, start_s: float, end_s: float) -> int:
        """How many frames begin in ``[start_s, end_s)``."""
        return max(self.last_before(end_s) - self.first_from(start_s) + 1, 0)

    def stretch(self, one_s: float, other_s: float) -> Stretch:
        """From edge to edge between two times in any order, at least a frame."""
        start_s, end_s = (self.nearest(time_s) for time_s in sorted((one_s, other_s)))
        if start_s < end_s:
            return start_s, end_s
        # Both are nearest to one edge: the frame on screen at the earlier of the two.
        shown = int(np.searchsorted(self.times_s, min(one_s, other_s), "right")) - 1
        first = min(max(shown, 0), len(self.times_s) - 1)
        return float(self.edges_s[first]), float(self.edges_s[first + 1])

    def placed(self, start_s: float, duration_s: float, room: Stretch) -> Stretch | None:
        """A stretch of about this start and duration that stops at the walls of its room.

        It keeps its duration where frames and walls allow it. None where the room holds
        no frame.
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


def room_around(labels: Labels, span: Span, frames: Frames) -> Stretch:
    """How far a span can reach: on an exclusive track to its neighbours."""
    low_s, high_s = frames.whole
    if labels.track(span.track).overlap == "exclusive":
        for other in labels.spans:
            if other.track != span.track or other.id == span.id:
                continue
            if other.end_s <= span.start_s:
                low_s = max(low_s, other.end_s)
            else:
                high_s = min(high_s, other.start_s)
                break
    return low_s, high_s


def steps_free(frames: Frames, span: Span, room: Stretch, count: int) -> int:
    """How many of so many frames a span can be moved by before it meets a wall of its room."""
    low_s, high_s = room
    if count < 0:
        wall = int(frames.edges_s.searchsorted(low_s))
        here = int(frames.edges_s.searchsorted(span.start_s))
        return max(count, min(wall - here, 0))
    wall = int(frames.edges_s.searchsorted(high_s, "right"))
    here = int(frames.edges_s.searchsorted(span.end_s, "right"))
    return min(count, max(wall - here, 0))


def free_parts(
    labels: Labels, track: str, wanted: Stretch, ignore: Collection[int] = ()
) -> list[Stretch]:
    """What no span of a track holds of a stretch, in order."""
    parts = []
    low_s, high_s = wanted
    for span in labels.spans:
        if span.start_s >= high_s:
            break
        if span.track == track and span.end_s > low_s and span.id not in ignore:
            if span.start_s > low_s:
                parts.append((low_s, span.start_s))
            low_s = span.end_s
    if low_s < high_s:
        parts.append((low_s, high_s))
    return parts


def clipped(
    labels: Labels, track: str, wanted: Stretch, frames: Frames, ignore: Collection[int] = ()
) -> Stretch:
    """The longest part of a stretch that a track has room for; all of it where spans may overlap.

    Raises
    ------
    Sd2Error
        When no frame of it is free.
    """
    if labels.track(track).overlap == "free":
        return wanted
    parts = [one for one in free_parts(labels, track, wanted, ignore) if frames.held(*one)]
    if not parts:
        raise Sd2Error(
            f"From {wanted[0]:.3f} to {wanted[1]:.3f} s every frame has a span on {track!r}",
            "room for at least one frame on a track without overlaps",
            "Shorten or delete the span there, or take another track",
        )
    return max(parts, key=lambda part: part[1] - part[0])
