"""A Doppler map that is filled stretch by stretch, each frame with its quality."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sd2core.doppler.synthesizer import Stretch
from sd2core.sensor import VirtualSensor

ROUGH, AS_DRAGGED, FINAL = 1, 2, 3
"""How good a frame is: a preview, what a hand gets that moves the sensor (or what was
final for another plan), what the plan in use gives. 0 is not computed."""

View = tuple[int, int]


@dataclass(eq=False)
class Canvas:
    """What is known of the map so far.

    Parameters
    ----------
    values : float32 array, shape (bins, T)
    rank : uint8 array, shape (T,)
        See :data:`FINAL`.
    sensor : VirtualSensor or None
        Placement that all of it is for.
    """

    values: NDArray[np.float32]
    rank: NDArray[np.uint8]
    sensor: VirtualSensor | None = None

    @classmethod
    def blank(cls, bins: int, frames: int) -> Canvas:
        """Nothing known."""
        return cls(
            np.zeros((bins, frames), np.float32),
            np.zeros(frames, np.uint8),
        )

    @property
    def frames(self) -> int:
        """Number of frames T."""
        return len(self.rank)

    @property
    def full(self) -> bool:
        """Whether every frame holds something."""
        return bool(self.frames and self.rank.min() > 0)

    @property
    def final(self) -> bool:
        """Whether every frame is as good as it gets."""
        return bool(self.frames and self.rank.min() >= FINAL)

    def paint(self, sensor: VirtualSensor, start: int, stretch: Stretch, rank: int) -> None:
        """Take a stretch over; what was there for another placement is forgotten."""
        if sensor != self.sensor:
            self.sensor = sensor
            self.rank[:] = 0
        inside = slice(start, start + stretch.values.shape[1])
        self.values[:, inside] = stretch.values
        self.rank[inside] = rank

    def demote(self) -> None:
        """What was final no longer is, but stays until it is replaced."""
        np.minimum(self.rank, AS_DRAGGED, out=self.rank)

    def ranks_for(self, sensor: VirtualSensor) -> NDArray[np.uint8]:
        """A copy of the ranks as far as they hold for a placement."""
        return self.rank.copy() if sensor == self.sensor else np.zeros_like(self.rank)


def pieces(rank: NDArray[np.uint8], below: int, start: int, stop: int, size: int) -> Iterator[View]:
    """Stretches of at most ``size`` frames from ``start`` to ``stop`` whose rank is below.

    ``rank`` may change while iterating.
    """
    while start < stop:
        if rank[start] >= below:
            start += 1
            continue
        inside = rank[start : min(stop, start + size)] < below
        end = start + (len(inside) if inside.all() else int(inside.argmin()))
        yield start, end
        start = end
