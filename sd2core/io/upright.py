"""Upright pictures: what a video's display matrix asks for."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

_NUMBERS = 9
_SLANTED = 0.01
"""Share of an axis that may lie along another one before a turn is no quarter turn."""


@dataclass(frozen=True)
class Upright:
    """Quarter turns and mirroring of stored pictures: along which axes they are shown.

    Parameters
    ----------
    swaps : bool
        Rows become columns, before the picture is reversed.
    down, right : int
        -1 where the shown picture is reversed from top to bottom, or from left to right.
    """

    swaps: bool = False
    down: int = 1
    right: int = 1
    notes: tuple[str, ...] = ()

    @classmethod
    def of(cls, frame: Any) -> Upright:
        """Read the display matrix of a frame of PyAV; as stored without one.

        A stored place (x, y) is shown at (a x + c y, b x + d y), with a, b and c, d in the first
        two rows of the matrix.
        """
        found = frame.side_data.get("DISPLAYMATRIX")
        numbers = np.frombuffer(b"" if found is None else bytes(found), np.int32)
        if numbers.size < _NUMBERS:
            return cls()
        (a, b), (c, d) = numbers[:_NUMBERS].reshape(3, 3)[:2, :2].astype(float).tolist()
        size = max(map(abs, (a, b, c, d)))
        if size == 0.0:
            return cls()
        swaps = abs(a) + abs(d) < abs(b) + abs(c)
        across, along = ((b, c), (a, d)) if swaps else ((d, a), (b, c))
        notes = []
        if max(map(abs, along)) > _SLANTED * size:
            notes.append(
                f"The file asks for a rotation by {frame.rotation}°; only quarter turns are made."
            )
        if a * d - b * c < 0:
            notes.append("The file asks for a mirrored picture, and is shown so.")
        down, right = (-1 if one < 0 else 1 for one in across)
        return cls(swaps, down, right, tuple(notes))

    def picture(self, rgb: NDArray[Any]) -> NDArray[Any]:
        """Turn a stored picture, (height, width, 3)."""
        turned = rgb.swapaxes(0, 1) if self.swaps else rgb
        return turned[:: self.down, :: self.right]
