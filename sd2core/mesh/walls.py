"""Walls, floors and ceilings that mirror waves."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.sensor import direction_from_angles

DIRECTIONS: Mapping[str, tuple[float, float]] = {
    "floor": (0.0, -90.0),
    "ceiling": (0.0, 90.0),
    "ahead": (0.0, 0.0),
    "right": (90.0, 0.0),
    "left": (-90.0, 0.0),
    "behind": (180.0, 0.0),
}
"""Azimuth and elevation of usual walls, seen from the camera."""

DISTANCES_M = 1e-3, 1000.0
"""Least and greatest distance of a wall from the camera."""

LOSSES_DB = 0.0, 100.0
"""Least and greatest loss of a reflection."""

MAX_WALLS = 20
"""In one scene; each is counted as often as the body itself."""


@dataclass(frozen=True)
class Wall:
    """A plane without end that mirrors waves; the camera is before it.

    Parameters
    ----------
    distance_m : float
        From the camera, along the perpendicular.
    azimuth_deg, elevation_deg : float
        Direction of that perpendicular: (0, 0) is a wall straight ahead, azimuth 90 one to the
        right, elevation -90 a floor.
    loss_db : float
        Power that a reflection takes, from 0 to 100; of concrete at 60 GHz and normal incidence
        8.2 (Recommendation ITU-R P.2040).

    Examples
    --------
    >>> import sd2core as sd2
    >>> sd2.Wall(1.1, elevation_deg=-90).words
    'floor at 1.1 m, 8.2 dB'
    """

    __pydantic_config__ = {"extra": "forbid"}  # noqa: RUF012

    distance_m: float
    azimuth_deg: float = 0.0
    elevation_deg: float = 0.0
    loss_db: float = 8.2

    def __post_init__(self) -> None:
        for value, (low, high), what, unit in (
            (self.distance_m, DISTANCES_M, "distance", "m"),
            (self.azimuth_deg, (-360.0, 360.0), "azimuth", "degrees"),
            (self.elevation_deg, (-90.0, 90.0), "elevation", "degrees"),
            (self.loss_db, LOSSES_DB, "loss", "dB"),
        ):
            if not low <= value <= high:
                raise Sd2Error(f"The {what} of a wall is {value}", f"{low:g} to {high:g} {unit}")

    @classmethod
    def named(cls, direction: str, distance_m: float, loss_db: float = loss_db) -> Wall:
        """Wall in one of :data:`DIRECTIONS`."""
        azimuth_deg, elevation_deg = DIRECTIONS[direction]
        return cls(distance_m, azimuth_deg, elevation_deg, loss_db)

    @property
    def name(self) -> str:
        """Name: floor, ceiling, or its direction."""
        for name, angles in DIRECTIONS.items():
            if angles == (self.azimuth_deg, self.elevation_deg):
                return name if name in ("floor", "ceiling") else f"wall {name}"
        up = f", {self.elevation_deg:g}° up" if self.elevation_deg else ""
        return f"wall {self.azimuth_deg:g}° to the right{up}"

    @property
    def words(self) -> str:
        """Text such as ``floor at 1.1 m, 8.2 dB``."""
        return f"{self.name} at {self.distance_m:g} m, {self.loss_db:g} dB"

    @cached_property
    def outward(self) -> NDArray[np.float64]:
        """Unit vector from the room into the wall, (3,)."""
        return np.array(direction_from_angles(self.azimuth_deg, self.elevation_deg))

    def before_m(self, points_m: NDArray[Any]) -> NDArray[np.float64]:
        """Distance before the wall of points (..., 3) in the camera frame; negative: behind it."""
        return np.asarray(self.distance_m - points_m @ self.outward)

    def mirrored(self, points_m: NDArray[Any]) -> NDArray[np.float64]:
        """Images of points (..., 3) in the camera frame."""
        return np.asarray(points_m + 2.0 * self.before_m(points_m)[..., None] * self.outward)
