"""Virtual sensor, its placement and beam, and the velocity axis of Doppler maps.

World frame = camera frame: x right, y down, z forward, metres. Radial velocity
is positive when approaching the sensor.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from sd2core.errors import Sd2Error
from sd2core.numerics.limits import FARTHEST_M, MAX_BINS

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class VelocityAxis:
    """Evenly spaced velocity bins over ``[-v_max_mps, v_max_mps]``, ascending.

    Parameters
    ----------
    bins : int
        Number of bins, 2 to :data:`MAX_BINS`.
    v_max_mps : float
        Outer edge of the last bin.

    Examples
    --------
    >>> import sd2core as sd2
    >>> axis = sd2.VelocityAxis(bins=32, v_max_mps=2.0)
    >>> axis.bin_width_mps, axis.bin_of(0.3)
    (0.125, 18)
    """

    bins: int = 32
    v_max_mps: float = 2.0

    def __post_init__(self) -> None:
        if not (hasattr(self.bins, "__index__") and 2 <= self.bins <= MAX_BINS):
            raise Sd2Error(f"The velocity axis has {self.bins} bins", f"whole, 2 to {MAX_BINS:,}")
        if not (math.isfinite(self.v_max_mps) and self.v_max_mps > 0):
            raise Sd2Error(
                f"The velocity axis ends at {self.v_max_mps} m/s", "a positive velocity in m/s"
            )

    @property
    def words(self) -> str:
        """Text such as ``32 bins over ±2 m/s``."""
        return f"{self.bins} bins over ±{self.v_max_mps:g} m/s"

    @property
    def bin_width_mps(self) -> float:
        """Width of one bin."""
        return 2.0 * self.v_max_mps / self.bins

    @property
    def edges_mps(self) -> NDArray[np.float64]:
        """Bin edges, shape (bins + 1,)."""
        import numpy as np  # not where options are only listed

        return np.arange(self.bins + 1, dtype=np.float64) * self.bin_width_mps - self.v_max_mps

    @property
    def centres_mps(self) -> NDArray[np.float64]:
        """Bin centres, shape (bins,)."""
        import numpy as np

        return (np.arange(self.bins, dtype=np.float64) + 0.5) * self.bin_width_mps - self.v_max_mps

    def checked_bins(self, numbers: Iterable[int], what: str) -> tuple[int, ...]:
        """Numbers of bins in order, each once; Sd2Error where there is no such bin."""
        bins = tuple(sorted({int(number) for number in numbers}))
        if bins and not 0 <= bins[0] <= bins[-1] < self.bins:
            raise Sd2Error(f"{what} is {bins!r:.60}", f"bins from 0 to {self.bins - 1}")
        return bins

    def bin_of(self, velocity_mps: float) -> int | None:
        """Bin of a velocity, or None beyond the axis."""
        if not -self.v_max_mps <= velocity_mps <= self.v_max_mps:
            return None
        return min(int((velocity_mps + self.v_max_mps) / self.bin_width_mps), self.bins - 1)


@dataclass(frozen=True)
class Beam:
    """Pattern of the sensor's antennas, the same of transmitter and receiver.

    Power one way, by the angle from the boresight to the right and upwards: a normal curve in
    each plane, exp(-4 ln 2 (angle / width)²), or a table; a direction beside both planes has
    the product (the pattern of two cuts: Balanis, *Antenna Theory*, 4th ed., section 2.2). An
    echo passes it twice.

    Parameters
    ----------
    azimuth_width_deg, elevation_width_deg : float
        Full widths at half power, from 1 to 360.
    cuts : tuple of (angle_deg, azimuth_db, elevation_db)
        Table, of ascending angles from below to above 0, which the widths were taken from; 0 dB
        is the most, and beyond its ends the last value stays. Empty: normal curves.

    Examples
    --------
    >>> import sd2core as sd2
    >>> narrow = sd2.Beam(56.0, 28.0)
    >>> sd2.VirtualSensor(position_m=(0, 0, 0), azimuth_deg=180, beam=narrow).beam.words
    '56° × 28°'
    """

    __pydantic_config__ = {"extra": "forbid"}  # noqa: RUF012

    azimuth_width_deg: float
    elevation_width_deg: float
    cuts: tuple[tuple[float, float, float], ...] = ()

    def __post_init__(self) -> None:
        for name in ("azimuth_width_deg", "elevation_width_deg"):
            if not 1 <= getattr(self, name) <= 360:
                raise Sd2Error(f"The beam's {name} is {getattr(self, name)}", "1 to 360 degrees")
        cuts = tuple(tuple(map(float, row)) for row in self.cuts)
        object.__setattr__(self, "cuts", cuts)
        for row in cuts:
            if len(row) != 3 or not all(map(math.isfinite, row)):
                raise Sd2Error(f"A row of the beam is {row}", "angle_deg, azimuth_db, elevation_db")
        angles = [row[0] for row in cuts]
        ascending = all(a < b for a, b in pairwise(angles))
        if cuts and not (ascending and -180 <= angles[0] < 0 < angles[-1] <= 180):
            raise Sd2Error(
                f"The beam's angles go from {angles[0]:g} to {angles[-1]:g} degrees",
                "ascending angles from below 0 to above it, within -180 and 180",
            )

    @property
    def words(self) -> str:
        """Text such as ``56° × 28°``."""
        table = ", by a table" if self.cuts else ""
        return f"{self.azimuth_width_deg:.3g}° × {self.elevation_width_deg:.3g}°{table}"


@dataclass(frozen=True)
class VirtualSensor:
    """A radar placed in the camera frame.

    Parameters
    ----------
    position_m : tuple of 3 floats
        x right, y down, z forward; the camera is the origin.
    azimuth_deg, elevation_deg : float
        Direction of the boresight: azimuth to the right of the optical axis,
        elevation above the horizon. (0, 0) looks along +z.
    beam : Beam, optional
        What the antennas weigh directions by; None: all alike.

    Examples
    --------
    >>> import sd2core as sd2
    >>> sensor = sd2.VirtualSensor(position_m=(-1, 0, 2), azimuth_deg=30)
    >>> sensor.position_m
    (-1.0, 0.0, 2.0)
    """

    position_m: Vector = (0.0, 0.0, 0.0)
    azimuth_deg: float = 0.0
    elevation_deg: float = 0.0
    beam: Beam | None = None

    def __post_init__(self) -> None:
        position = tuple(float(value) for value in self.position_m)
        if len(position) != 3 or not all(abs(value) <= FARTHEST_M for value in position):
            raise Sd2Error(
                f"The sensor position is {self.position_m}",
                f"three finite numbers x, y, z in metres, up to {FARTHEST_M:g}",
            )
        object.__setattr__(self, "position_m", position)
        for name in ("azimuth_deg", "elevation_deg"):
            if not math.isfinite(getattr(self, name)):
                raise Sd2Error(f"The sensor's {name} is {getattr(self, name)}", "a finite angle")

    @property
    def words(self) -> str:
        """Text such as ``at x 0, y 0, z 1 m``, with its beam and direction if it has one."""
        x, y, z = self.position_m
        place = f"at x {x:g}, y {y:g}, z {z:g} m"
        if self.beam is None:
            return place
        return (
            f"{place}, beam {self.beam.words}, looking {self.azimuth_deg:.3g}° to the right and"
            f" {self.elevation_deg:.3g}° up"
        )

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> VirtualSensor:
        """Sensor that :meth:`as_dict` gave; keys that it does not know are left out."""
        known = {name: values[name] for name in cls.__dataclass_fields__ if name in values}
        beam = known.pop("beam", None)
        return cls(**known, beam=None if beam is None else Beam(**beam))

    def as_dict(self) -> dict[str, Any]:
        """Plain values; the beam is among them where there is one."""
        return {name: value for name, value in asdict(self).items() if value is not None}

    @property
    def boresight(self) -> Vector:
        """Unit vector along which the sensor looks."""
        return direction_from_angles(self.azimuth_deg, self.elevation_deg)


def direction_from_angles(azimuth_deg: float, elevation_deg: float) -> Vector:
    """Unit vector in the camera frame (x right, y down, z forward)."""
    azimuth, elevation = math.radians(azimuth_deg), math.radians(elevation_deg)
    return (
        math.sin(azimuth) * math.cos(elevation),
        -math.sin(elevation),
        math.cos(azimuth) * math.cos(elevation),
    )


def position_from_spherical(
    target_m: Vector, range_m: float, azimuth_deg: float, elevation_deg: float
) -> Vector:
    """Sensor position at a range and angle as seen from a target.

    Azimuth 0, elevation 0 is on the target's camera side, straight along the
    optical axis; azimuth turns to the right in the image, elevation upwards.

    Parameters
    ----------
    target_m : (float, float, float)
        In the camera frame.
    range_m : float
        From target to sensor.
    azimuth_deg, elevation_deg : float
    """
    towards = direction_from_angles(180.0 - azimuth_deg, elevation_deg)
    return (
        target_m[0] + range_m * towards[0],
        target_m[1] + range_m * towards[1],
        target_m[2] + range_m * towards[2],
    )


def spherical_from_position(target_m: Vector, position_m: Vector) -> tuple[float, float, float]:
    """Invert :func:`position_from_spherical`: ``(range_m, azimuth_deg, elevation_deg)``."""
    dx, dy, dz = (p - t for p, t in zip(position_m, target_m, strict=True))
    range_m = math.hypot(dx, dy, dz)
    if range_m == 0.0:
        return (0.0, 0.0, 0.0)
    azimuth_deg = math.degrees(math.atan2(dx, -dz)) if (dx or dz) else 0.0
    elevation_deg = math.degrees(math.atan2(-dy, math.hypot(dx, dz)))
    return (range_m, azimuth_deg, elevation_deg)


def aimed_at(sensor: VirtualSensor, target_m: Vector) -> VirtualSensor:
    """Sensor with its boresight turned to a target; unchanged on the target itself."""
    dx, dy, dz = (t - p for t, p in zip(target_m, sensor.position_m, strict=True))
    if dx == dy == dz == 0.0:
        return sensor
    return replace(
        sensor,
        azimuth_deg=math.degrees(math.atan2(dx, dz)) if (dx or dz) else 0.0,
        elevation_deg=math.degrees(math.atan2(-dy, math.hypot(dx, dz))),
    )
