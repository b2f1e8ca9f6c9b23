"""Presence of a person in the frames of a clip."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sd2core.errors import Sd2Error


@dataclass(frozen=True, eq=False)
class Presence:
    """Frames with a person, in stretches separated by frames without.

    Nothing is known of the motion in between. So every stretch is treated as a clip of its own:
    no velocity is measured and nothing is smoothed from one to another (docs/decisions/0021).
    """

    present: NDArray[np.bool_]  # (T,) frames with a person
    first: NDArray[np.int64]  # (T,) first frame of the stretch; itself without a person
    last: NDArray[np.int64]  # (T,) last frame of that stretch

    @classmethod
    def of(
        cls, present: ArrayLike | None, frames: int, breaks: NDArray[np.bool_] | None = None
    ) -> Presence:
        """Presence by a mask (frames,); None means everywhere.

        ``breaks`` (frames - 1,) marks what lies between frames that do not follow each other.
        """
        mask = np.ones(frames, bool) if present is None else checked(present, frames)
        numbers = np.arange(frames)
        # A stretch begins at every frame that does not go on from the one before.
        begins = np.ones(frames, bool)
        begins[1:] = ~(mask[1:] & mask[:-1]) | (False if breaks is None else breaks)
        ends = np.ones(frames, bool)
        ends[:-1] = begins[1:]
        first = np.maximum.accumulate(np.where(begins, numbers, 0))
        last = np.minimum.accumulate(np.where(ends, numbers, frames)[::-1])[::-1]
        return cls(mask, first, last)

    def __len__(self) -> int:
        return len(self.present)

    @cached_property
    def whole(self) -> bool:
        """True if the person is there in every frame, and all of them are one stretch."""
        return bool(self.present.all()) and not self.first.any()

    @cached_property
    def measured(self) -> NDArray[np.bool_]:
        """Frames whose motion can be known, (T,): with another of their stretch beside them.

        In a clip without gaps all of them, be it one frame long.
        """
        return self.present if self.whole else self.present & (self.last > self.first)

    def between(self, start: int, stop: int) -> Presence:
        """Frames ``start`` to ``stop`` as a clip of their own."""
        breaks = self.first[start + 1 : stop] == np.arange(start + 1, stop)
        return Presence.of(self.present[start:stop], stop - start, breaks)


def runs(mask: NDArray[np.bool_]) -> tuple[tuple[int, int], ...]:
    """Half-open runs of frames that are marked."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return tuple(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def checked(present: ArrayLike, frames: int) -> NDArray[np.bool_]:
    """Mask as a bool array of its own; Sd2Error without one truth value (or 0 and 1) per frame."""
    mask = np.array(present)
    if mask.shape != (frames,) or not (
        mask.dtype.kind == "b" or (mask.dtype.kind in "iu" and np.isin(mask, (0, 1)).all())
    ):
        raise Sd2Error(
            f"present is of type {mask.dtype} and shape {mask.shape}",
            f"{frames} truth values, one per frame",
        )
    return mask.astype(np.bool_)


def gaps_in_words(
    gaps: Sequence[tuple[int, int]], times_s: NDArray[np.float64], frame_duration_s: float
) -> str:
    """Amount that is missing: ``34 of 450 frames (1.13 s)``; gaps are half-open runs of frames."""
    ends_s = np.append(times_s, times_s[-1] + frame_duration_s)
    frames = sum(stop - start for start, stop in gaps)
    missing_s = sum(float(ends_s[stop] - ends_s[start]) for start, stop in gaps)
    return f"{frames:,} of {len(times_s):,} frames ({missing_s:.2f} s)"
