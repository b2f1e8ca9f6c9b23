"""Keys are pressed after what one has seen: marks are put back by the time it takes to react."""

from __future__ import annotations

from sd2core.labels.free_time import Frames
from sd2core.labels.spans import Labels
from sd2core.timebase import Timebase

LONGEST_REACTION_S = 1.0


def seen_at(
    labels: Labels, timebase: Timebase, track: str, now_s: float, reaction_s: float
) -> float:
    """When what a key marks was seen: the time of a frame.

    That of the frame which was on screen the reaction time ago; not before the recording, nor,
    on an exclusive track, before the end of the span that went before, and never later than
    the frame on screen.

    Parameters
    ----------
    now_s : float
        Time of the frame that is on screen.
    """
    frame = timebase.frame_at(now_s - reaction_s)
    if labels.track(track).overlap == "exclusive":
        ends_s = [one.end_s for one in labels.of_track(track) if one.end_s <= now_s]
        # An import's edge may be between two frames.
        frame = max(frame, Frames.of(timebase).first_from(max(ends_s))) if ends_s else frame
    return min(timebase.time_of(frame), now_s)
