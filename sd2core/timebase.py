"""Conversion between time and frame; no other module does it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sd2core.errors import Sd2Error

_TOLERANCE_S = 1e-6
"""Arithmetic on presentation times loses less than this; no camera is that fast."""
_LONGEST_FRAMES = 5
_USUAL = 0.51, 1.51
"""Steps of these shares of the usual one leave no frame out. As far below it as above: of times
that jitter, the mean would be longer."""


@dataclass(frozen=True, eq=False)
class Timebase:
    """Presentation times of a sequence of frames, evenly spaced or not.

    Frame ``k`` is on screen during the half-open span
    ``[times_s[k], times_s[k + 1])``; the last one for a typical frame duration.

    Parameters
    ----------
    times_s : array_like, shape (T,)
        Strictly increasing times in seconds, at least one.
    first_number : int, optional
        Number of the first frame in files and on screen: negative where frames lie before those
        of the video, which are numbered from 0.

    Raises
    ------
    Sd2Error
        When a time is missing, not finite or not later than the one before.

    Examples
    --------
    >>> import sd2core as sd2
    >>> times = sd2.Timebase.regular(frames=90, frames_per_s=30)
    >>> times.duration_s, times.frame_at(1.01)
    (3.0, 30)
    >>> times.frames_between(0.5, 1.0)
    (15, 30)
    """

    times_s: NDArray[np.float64]
    first_number: int = 0

    def __init__(self, times_s: ArrayLike, first_number: int = 0) -> None:
        times = np.array(times_s, dtype=np.float64)  # (T,)
        if times.ndim != 1 or times.size == 0:
            raise Sd2Error(
                f"Frame times have shape {times.shape}", "one time per frame, at least one frame"
            )
        if not np.isfinite(times).all():
            bad = int(np.flatnonzero(~np.isfinite(times))[0])
            raise Sd2Error(f"The time of frame {bad} is {times[bad]}", "a finite time in seconds")
        steps = np.diff(times)
        if (steps <= 0).any():
            bad = int(np.flatnonzero(steps <= 0)[0])
            raise Sd2Error(
                f"Frame {bad + 1} is at {times[bad + 1]:.6f} s, frame {bad} at {times[bad]:.6f} s",
                "times that increase from frame to frame",
            )
        times.flags.writeable = False
        object.__setattr__(self, "times_s", times)
        object.__setattr__(self, "first_number", first_number)

    @classmethod
    def regular(cls, frames: int, frames_per_s: float, start_s: float = 0.0) -> Timebase:
        """Evenly spaced frames."""
        if not (frames_per_s > 0 and np.isfinite(frames_per_s)):
            raise Sd2Error(f"The frame rate is {frames_per_s}", "a positive number of frames per s")
        return cls(start_s + np.arange(frames) / frames_per_s)

    def __repr__(self) -> str:
        return f"<Timebase {self.words}>"

    @property
    def words(self) -> str:
        """Number, length and rate of the frames: ``450 frames, 15.000 s, 30.00 frames/s``."""
        return f"{len(self)} frame{'s' * (len(self) != 1)}, {self.pace}"

    @property
    def pace(self) -> str:
        """Length and rate of the frames in words."""
        return f"{self.duration_s:.3f} s, {self.frames_per_s:.2f} frames/s"

    def __len__(self) -> int:
        return len(self.times_s)

    @cached_property
    def frame_duration_s(self) -> float:
        """Typical time from one frame to the next, without pauses; 1/30 s for a single frame."""
        if len(self) == 1:
            return 1.0 / 30.0
        steps_s = np.diff(self.times_s)
        # A clock that ticks coarsely gives steps of two lengths, of which neither is the rate.
        share = steps_s / np.quantile(steps_s, 0.5, method="lower")
        return float(steps_s[(_USUAL[0] < share) & (share < _USUAL[1])].mean())

    @property
    def longest_s(self) -> float:
        """Time for which a frame is shown at most: a radar that was stopped for longer saw nothing.

        Cameras that drop some frames show one for as long.
        """
        return _LONGEST_FRAMES * self.frame_duration_s

    @cached_property
    def edges_s(self) -> NDArray[np.float64]:
        """Times at which frames begin, and the end of the last one, (T + 1,)."""
        edges_s = np.append(self.times_s, self.end_s)
        edges_s.flags.writeable = False
        return edges_s

    @property
    def frames_per_s(self) -> float:
        """Typical frame rate."""
        return 1.0 / self.frame_duration_s

    @property
    def start_s(self) -> float:
        """Time of the first frame."""
        return float(self.times_s[0])

    @property
    def end_s(self) -> float:
        """End of the last frame (exclusive)."""
        return float(self.times_s[-1]) + self.frame_duration_s

    @property
    def duration_s(self) -> float:
        """Time from the start of the first frame to the end of the last."""
        return self.end_s - self.start_s

    def frame_at(self, time_s: float) -> int:
        """Frame on screen at ``time_s``, held at both ends."""
        index = int(np.searchsorted(self.times_s, time_s + _TOLERANCE_S, side="right")) - 1
        return min(max(index, 0), len(self) - 1)

    def nearest_frame(self, time_s: float) -> int:
        """Frame whose time is closest to ``time_s`` (the earlier one on a tie)."""
        return int(np.argmin(np.abs(self.times_s - time_s)))

    def covers(self, time_s: float) -> bool:
        """True if some frame is on screen at ``time_s``."""
        return self.start_s - _TOLERANCE_S <= time_s < self.end_s - _TOLERANCE_S

    def shown_at(self, time_s: float) -> int | None:
        """Frame on screen at a time; None outside, and in gaps, in which none is shown."""
        frame = self.frame_at(time_s)
        shown = self.covers(time_s) and time_s - self.times_s[frame] < self.longest_s
        return frame if shown else None

    def time_of(self, frame: int) -> float:
        """Time of ``frame``; it must exist."""
        if not 0 <= frame < len(self):
            raise IndexError(f"frame {frame} of {len(self)}")
        return float(self.times_s[frame])

    def frames_between(self, start_s: float, end_s: float) -> tuple[int, int]:
        """Half-open range of frames on screen during ``[start_s, end_s)``."""
        if end_s <= start_s or end_s <= self.start_s or start_s >= self.end_s:
            return (0, 0)
        first = self.frame_at(start_s)
        last = int(np.searchsorted(self.times_s, end_s - _TOLERANCE_S, side="left"))
        return (first, max(last, first + 1))

    def shifted(self, offset_s: float) -> Timebase:
        """Timebase with all frames ``offset_s`` later."""
        return Timebase(self.times_s + offset_s, self.first_number)


def common_clock(clocks: Sequence[Timebase]) -> Timebase:
    """Frames of the first clock, which keep their numbers, and of others that reach beyond it.

    A clock that does not touch the ones before it is left out: no user wants to
    play through the gap.
    """
    times_s, first_number = clocks[0].times_s, clocks[0].first_number
    start_s, end_s = clocks[0].start_s, clocks[0].end_s
    for clock in clocks[1:]:
        if clock.end_s < start_s or clock.start_s > end_s:
            continue
        # Less than half a frame beyond an end is rounding, not another frame.
        slack_s = 0.5 * min(clock.frame_duration_s, clocks[0].frame_duration_s)
        before = clock.times_s[clock.times_s < min(start_s - slack_s, times_s[0])]
        after = clock.times_s[clock.times_s > max(end_s - slack_s, times_s[-1])]
        times_s = np.concatenate([before, times_s, after])
        first_number -= len(before)
        start_s, end_s = min(start_s, clock.start_s), max(end_s, clock.end_s)
    return Timebase(times_s, first_number)


def frames_that_begin(times_s: NDArray[np.float64], start_s: float, end_s: float) -> slice:
    """Frames that begin during ``[start_s, end_s)``: those that a label holds for."""
    first, stop = np.searchsorted(times_s, np.array([start_s, end_s]) - _TOLERANCE_S).tolist()
    return slice(first, stop)
