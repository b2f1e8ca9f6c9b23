"""Cost of the maps of many placements, from the time of one frame."""

from __future__ import annotations

from dataclasses import dataclass

_VALUE_BYTES, _TIME_BYTES = 4, 8
"""Single precision for values, double for times."""


@dataclass(frozen=True)
class PlacementCost:
    """Time and memory of one map per placement.

    Parameters
    ----------
    maps, frames : int
        Maps, and frames of each.
    frame_ms : float
        Measured time per frame on all cores of the plan that holds the tolerance.
    bins : int
        Velocity bins of a map.
    """

    maps: int
    frames: int
    frame_ms: float
    bins: int = 32

    @property
    def map_s(self) -> float:
        """Seconds per map."""
        return 1e-3 * self.frame_ms * self.frames

    @property
    def total_s(self) -> float:
        """Seconds for all maps, without the preparation of the clip."""
        return self.maps * self.map_s

    @property
    def total_bytes(self) -> int:
        """Bytes of the values and times of all maps, before compression."""
        return self.maps * self.frames * (_VALUE_BYTES * self.bins + _TIME_BYTES)
