"""Which frames are denoised next, and with how much before and after them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2app.maps.partial_map import View
from sd2core.maps import DopplerMap
from sd2core.pairs.segments import LENGTH, OVERLAP
from sd2core.timebase import Timebase

AT_ONCE = 2048
"""Frames that are denoised together; a clip up to this length always is whole."""

CONTEXT = 288
"""Frames around a stretch that its preview is made with: four windows of training."""


def next_piece(wanted: NDArray[np.bool_], view: View) -> View | None:
    """The stretch to be denoised next, half-open; None when there is none.

    Parameters
    ----------
    wanted : bool array, shape (T,)
        Frames that are known, and whose answer is not.
    view : tuple of int
        Frames on screen: these first, then those that follow, then those before.
    """
    if len(wanted) <= AT_ONCE:
        return (0, len(wanted)) if wanted.any() else None
    for start, stop in (view, (view[1], len(wanted)), (0, view[0])):
        numbers = np.flatnonzero(wanted[start:stop])
        if numbers.size:
            first = start + int(numbers[0])
            last = start + int(numbers[numbers < numbers[0] + AT_ONCE][-1])
            return first, last + 1
    return None


def with_context(known: NDArray[np.bool_], piece: View) -> View:
    """A stretch with what comes before and after it, as far as that is known.

    It begins where a window does that is cut from the whole clip.
    """
    first, last = piece[0], piece[1]
    wanted = max(first - CONTEXT, 0)
    before = known[wanted - wanted % (LENGTH - OVERLAP) : first][::-1]
    after = known[last : last + CONTEXT]
    return (
        first - (len(before) if before.all() else int(before.argmin())),
        last + (len(after) if after.all() else int(after.argmin())),
    )


def touched(piece: View, frames: int) -> slice:
    """Frames whose preview changes with a stretch."""
    return slice(max(piece[0] - CONTEXT, 0), min(piece[1] + CONTEXT, frames))


def cut_out(doppler: DopplerMap, start: int, values: NDArray[np.float32]) -> DopplerMap:
    """A stretch of a map, with values (bins, frames) of its own, as a map."""
    stop = start + values.shape[1]
    whole = (start, stop) == (0, len(doppler.timebase))
    return replace(
        doppler,
        values=values,
        timebase=doppler.timebase if whole else Timebase(doppler.times_s[start:stop]),
        present=None if doppler.present is None else doppler.present[start:stop],
        uncertainty=None,
    )


def known_frames(doppler: DopplerMap, covered: Any) -> NDArray[np.bool_]:
    """Frames of a track that hold something, (T,)."""
    return np.ones(len(doppler.timebase), bool) if covered is None else np.asarray(covered, bool)
