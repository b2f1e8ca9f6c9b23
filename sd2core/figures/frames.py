"""Choice of the frames of a figure."""

from __future__ import annotations

import re

import numpy as np

from sd2core.errors import Sd2Error

_RANGE = re.compile(r"(\d*):(\d*)(?::(\d+))?")
_EXPECTED = "frame numbers such as 0,15,30 or a range such as 0:90:15 (from, to, step)"


def parse_frames(text: str, total: int) -> list[int]:
    """Read ``0,15,30`` or ``0:90:15``, or several of either.

    Parameters
    ----------
    text : str
        Ranges are half-open; what is left out is the start, the end, or 1.
    total : int
        Number of frames there are.

    Returns
    -------
    list of int
        In the order given.

    Raises
    ------
    Sd2Error
        When it cannot be read, is empty, or names a frame that is not there.
    """
    frames: list[int] = []
    for part in text.replace(" ", "").split(","):
        if part.isascii() and part.isdigit():
            frames.append(int(part))
            continue
        match = _RANGE.fullmatch(part)
        if match is None or match[3] == "0":
            raise Sd2Error(f"The frames are {text!r}", _EXPECTED)
        start = int(match[1] or 0)
        stop = min(int(match[2] or total), total)
        frames.extend(range(start, stop, int(match[3] or 1)))
    for frame in frames:
        if frame >= total:
            raise Sd2Error(f"There is no frame {frame}", f"frames from 0 to {total - 1}")
    if not frames:
        raise Sd2Error(f"There are no frames in {text!r}", _EXPECTED)
    return frames


def spread_frames(count: int, total: int) -> list[int]:
    """``count`` frames spread evenly over all, the first and the last among them."""
    return np.unique(np.linspace(0, total - 1, min(count, total)).round().astype(int)).tolist()


def frames_around(frame: int, count: int, step: int, total: int) -> list[int]:
    """``count`` frames, ``step`` apart, ``frame`` in their middle; none outside the clip."""
    first = frame - step * ((count - 1) // 2)
    return [k for k in range(first, first + step * count, step) if 0 <= k < total]
