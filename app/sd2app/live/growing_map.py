"""Doppler map to which columns are added."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sd2core.maps import DopplerMap
from sd2core.timebase import Timebase

_SPARE_FRAMES = 1024


class GrowingMap:
    """Map that grows at its end; ``start`` is what is there before."""

    def __init__(self, start: DopplerMap) -> None:
        self._like = start
        self._frames = len(start.timebase)
        self._times_s = np.empty(self._frames + _SPARE_FRAMES)
        self._values = np.empty((start.axis.bins, self._times_s.size), np.float32)
        self._times_s[: self._frames] = start.times_s
        self._values[:, : self._frames] = start.values

    @property
    def bins(self) -> int:
        """Number of velocity bins."""
        return self._like.axis.bins

    @property
    def last_s(self) -> float:
        """Time of the last column."""
        return float(self._times_s[self._frames - 1])

    def add(self, time_s: float, values: NDArray[np.float32]) -> bool:
        """Append a column (bins,); False if it is not later than those that are there."""
        if not time_s > self.last_s:
            return False
        if self._frames == self._times_s.size:
            self._times_s = np.concatenate([self._times_s, np.empty_like(self._times_s)])
            self._values = np.concatenate([self._values, np.empty_like(self._values)], axis=1)
        self._times_s[self._frames] = time_s
        self._values[:, self._frames] = values
        self._frames += 1
        return True

    def whole(self) -> DopplerMap:
        """Map of all columns so far."""
        return replace(
            self._like,
            values=self._values[:, : self._frames],
            timebase=Timebase(self._times_s[: self._frames]),
            present=None,
        )
