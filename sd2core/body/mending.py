"""Landmarks of a clip of any length mended, part by part, so that memory does not grow with it.

What is mended of a frame depends on the frames around it, within a second or two. So each part
is mended with some frames more on both sides, which count to its neighbours. A clip of one part
is mended as a whole.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sd2core.body.landmark_repair import (
    SIDED_PARTS,
    Floats,
    Found,
    bridged,
    resided,
    unswapped,
    without_outliers,
)
from sd2core.body.track import parts

_MARGIN_FRAMES = 300

Read = Callable[[int, int], Found]
"""Gives what was found in frames ``start`` to ``stop``."""


def mended(
    read: Read,
    times_s: Floats,
    seen: NDArray[np.bool_],
    max_gap_s: float,
    write: Callable[[Found], None],
) -> tuple[str, ...]:
    """Mend everything that was found.

    Parameters
    ----------
    read : callable
    times_s : float64 array, shape (T,)
    seen : bool array, shape (T,)
        Frames in which the person was found.
    max_gap_s : float
        The longest gap that is bridged, from the last frame before to the first after.
    write : callable
        Called with the mended parts, in order.

    Returns
    -------
    tuple of str
        Sentences about it.
    """
    swapped = swapped_sides(read, seen)
    tally = _Tally(swapped={part: int(frames.sum()) for part, frames in swapped.items()})
    for start, stop in parts(len(times_s)):
        first, last = _around(start, stop, times_s, seen, max_gap_s)
        found = read(first, last)
        for part, frames in swapped.items():
            found = resided(found, part, frames[first:last])
        found, replaced = without_outliers(found)
        found = bridged(found, max_gap_s).part(start - first, stop - first)
        tally.add(found, replaced[start - first : stop - first])
        write(found)
    return tally.sentences(max_gap_s)


def swapped_sides(read: Read, seen: NDArray[np.bool_]) -> dict[str, NDArray[np.bool_]]:
    """Frames (T,) in which left and right are to be swapped back, for each part of the body.

    Which of the two sides is right is what most frames say: not those of one part of the
    clip, but of all parts that are linked by frames that they share.
    """
    frames = len(seen)
    swapped = {part: np.zeros(frames, bool) for part in SIDED_PARTS}
    linked, decided = 0, 0  # where what is linked began, and up to where all is decided
    for start, stop in parts(frames):
        first, last = max(start - _MARGIN_FRAMES, 0), min(stop + _MARGIN_FRAMES, frames)
        shared = seen[first:decided]
        if not shared.any():
            linked = start
        for part, here in unswapped(read(first, last))[1].items():
            whole = swapped[part]
            both = slice(first, decided)
            if shared.any() and (whole[both] != here[: decided - first])[shared].mean() > 0.5:
                here = ~here & seen[first:last]
            whole[start:last] = here[start - first :]
            counted = whole[linked:last][seen[linked:last]]
            if counted.any() and counted.mean() > 0.5:
                whole[linked:last] = ~whole[linked:last] & seen[linked:last]
        decided = last
    return swapped


def _around(
    start: int, stop: int, times_s: Floats, seen: NDArray[np.bool_], max_gap_s: float
) -> tuple[int, int]:
    """The frames that a part is mended with.

    A gap that is bridged belongs to them with three frames on either side, on which its
    curve rests, however long it is.
    """
    rows = np.flatnonzero(seen)

    def bridged_after(number: int) -> bool:
        if not 0 <= number < len(rows) - 1:
            return False
        here, there = rows[number], rows[number + 1]
        return bool(there - here > 1 and times_s[there] - times_s[here] <= max_gap_s + 1e-9)

    before = int(np.searchsorted(rows, start)) - 1
    if bridged_after(before):
        start = min(start, int(rows[max(before - 2, 0)]))
    after = int(np.searchsorted(rows, stop))
    if bridged_after(after - 1):
        stop = max(stop, int(rows[min(after + 2, len(rows) - 1)]) + 1)
    return max(start - _MARGIN_FRAMES, 0), min(stop + _MARGIN_FRAMES, len(times_s))


@dataclass
class _Tally:
    """How much was mended."""

    swapped: dict[str, int]
    landmarks: int = 0
    outlying: int = 0
    bridged: int = 0
    missing: int = 0

    def add(self, found: Found, replaced: NDArray[np.bool_]) -> None:
        self.landmarks += int(replaced.sum())
        self.outlying += int(replaced.any(axis=1).sum())
        self.bridged += int(found.bridged.sum())
        self.missing += int((~found.present).sum())

    def sentences(self, max_gap_s: float) -> tuple[str, ...]:
        notes = [
            f"Left and right of {part} swapped back in {_count(frames)}."
            for part, frames in self.swapped.items()
            if frames
        ]
        if self.landmarks:
            notes.append(
                "Replaced from the frames around them:"
                f" {_count(self.landmarks, 'outlying landmark')} in {_count(self.outlying)}."
            )
        if self.bridged:
            notes.append(
                f"Interpolated, in gaps of up to {max_gap_s:g} s without the person:"
                f" {_count(self.bridged)}."
            )
        if self.missing:
            notes.append(f"Left empty, without the person: {_count(self.missing)}.")
        return tuple(notes)


def _count(number: int, what: str = "frame") -> str:
    return f"{number} {what}" if number == 1 else f"{number} {what}s"
