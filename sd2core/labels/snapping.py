"""Where a time jumps to that a hand drags: edges of spans nearby, otherwise of frames."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import Literal

from sd2core.labels.free_time import Frames
from sd2core.labels.spans import Labels
from sd2core.timebase import Timebase


@dataclass(frozen=True)
class Snap:
    """A time and what is there.

    Parameters
    ----------
    time_s : float
    at : {"frame", "span", "suggestion"}
    span_id : int, optional
        Whose edge it is.
    """

    time_s: float
    at: Literal["frame", "span", "suggestion"]
    span_id: int | None = None


def snap(
    labels: Labels,
    timebase: Timebase,
    time_s: float,
    within_s: float,
    *,
    ignore: Collection[int] = (),
) -> Snap:
    """The nearest edge of a span within a distance, on any track; else the nearest frame edge.

    Frames are always near: were they to compete with spans, spans would hardly ever win. Of
    edges as near as each other a span's goes before a suggestion's, then the earlier one.

    Parameters
    ----------
    time_s : float
        Where the hand is.
    within_s : float
        How far a span attracts, which is some pixels of the time axis; 0: only where it is.
    ignore : collection of int
        Ids of spans that do not attract: those in the hand.
    """
    nearest = Frames.of(timebase).nearest(time_s)
    best: tuple[tuple[float, bool, float], Snap] | None = None
    for span in labels.spans:
        if span.start_s > time_s + within_s:
            break
        if span.end_s < time_s - within_s or span.id in ignore:
            continue
        suggested = span.origin == "suggestion"
        for edge_s in (span.start_s, span.end_s):
            rank = (abs(edge_s - time_s), suggested, edge_s)
            if rank[0] <= within_s and (best is None or rank < best[0]):
                best = rank, Snap(edge_s, "suggestion" if suggested else "span", span.id)
    return Snap(nearest, "frame") if best is None else best[1]
