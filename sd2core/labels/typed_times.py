"""Parsing of typed times of spans: seconds or frames.

``1.5``, ``1,5`` and ``1.5 s`` are seconds, ``1:02.5`` is a minute and 2.5 s, ``0:01:02.5``
the same with hours; ``f48`` and ``48 f`` are a frame. A frame typed as a start is the first
one of a span, as an end the last one, as a duration the number of frames.
"""

from __future__ import annotations

import re

from sd2core.errors import Sd2Error
from sd2core.timebase import Timebase

_FRAMES = re.compile(r"(?:f(?:rame)?\s*(\d{1,9}))|(?:(\d{1,9})\s*f(?:rames?)?)", re.IGNORECASE)
_SECONDS = re.compile(
    r"(?P<sign>[-−]?)(?:(?:(?P<h>\d{1,5}):)?(?P<min>\d{1,5}):)?(?P<s>\d{1,9}(?:[.,]\d*)?|[.,]\d+)\s*s?"
)
_LONGEST_SHOWN = 40


def typed_start(text: str, timebase: Timebase) -> float:
    """Parse the start of a span, in seconds.

    Raises Sd2Error when it is neither seconds nor a frame of the recording.
    """
    frame = _typed_frames(text)
    return _typed_seconds(text) if frame is None else timebase.time_of(_known(frame, timebase))


def typed_end(text: str, timebase: Timebase) -> float:
    """Parse the end of a span, in seconds; errors are those of :func:`typed_start`."""
    frame = _typed_frames(text)
    if frame is None:
        return _typed_seconds(text)
    return float(timebase.edges_s[_known(frame, timebase) + 1])


def typed_duration_end(text: str, start_s: float, timebase: Timebase) -> float:
    """Parse a duration and return the end of a span that begins at ``start_s``, in seconds."""
    frames = _typed_frames(text)
    if frames is None:
        return start_s + _typed_seconds(text)
    end = timebase.frame_at(start_s) + frames
    return float(timebase.edges_s[min(max(end, 1), len(timebase))])


def _typed_frames(text: str) -> int | None:
    match = _FRAMES.fullmatch(text.strip())
    return None if match is None else int(match[1] or match[2])


def _typed_seconds(text: str) -> float:
    seconds = seconds_of(text)
    if seconds is None:
        shown = text if len(text) <= _LONGEST_SHOWN else f"{text[:_LONGEST_SHOWN]}…"
        raise Sd2Error(f"{shown!r} was typed as a time", "seconds (1.5 or 1:02.5) or a frame (f48)")
    return seconds


def seconds_of(text: str) -> float | None:
    """Parse ``1.5``, ``1:02.5`` or ``0:01:02,5``; None for any other text."""
    match = _SECONDS.fullmatch(text.strip())
    if match is None:
        return None
    hours, minutes = (int(match[name] or 0) for name in ("h", "min"))
    seconds = 3600.0 * hours + 60.0 * minutes + float(match["s"].replace(",", "."))
    return -seconds if match["sign"] else seconds


def _known(frame: int, timebase: Timebase) -> int:
    last = timebase.first_number + len(timebase) - 1
    if frame > last:
        raise Sd2Error(f"Frame {frame} was typed", f"a frame from 0 to {last}")
    return frame - timebase.first_number
