"""Sensor placements around a body, a grid or a random cloud, and the cost of their maps.

A place is a range, an azimuth and an elevation as seen from the body, in the convention of
:func:`sd2core.sensor.position_from_spherical` and of the sensor panel: 0°, 0° is on the
camera's side; azimuth turns to the right in the image, elevation upwards. A spec knows no
body: the same one serves many recordings, each with a target of its own.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import MISSING, dataclass, fields
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_write_text
from sd2core.files.texts import errors_in, read_json, read_toml
from sd2core.options.bounds import AZIMUTH_DEG, ELEVATION_DEG, RANGE_M
from sd2core.sensor import Beam, Vector, VirtualSensor, position_from_spherical

FORMAT = "sd2-placements"
VERSION = 1

MAX_PLACEMENTS = 10_000
"""More than that around one body are hardly told apart, and take days."""

_DIGITS = 6
"""Places are rounded to micrometres and microdegrees: the same on every machine."""

Interval = tuple[float, float]


@dataclass(frozen=True, order=True)
class Place:
    """One place of a sensor, as seen from the body."""

    range_m: float  # distance from the target
    azimuth_deg: float = 0.0  # above -180 up to 180
    elevation_deg: float = 0.0  # from -90 to 90

    def sensor(self, target_m: Vector, beam: Beam | None = None) -> VirtualSensor:
        """Sensor at this place, aimed at the target."""
        return VirtualSensor(
            position_from_spherical(target_m, self.range_m, self.azimuth_deg, self.elevation_deg),
            azimuth_deg=-self.azimuth_deg,
            elevation_deg=-self.elevation_deg,
            beam=beam,
        )

    @property
    def words(self) -> str:
        """Text such as ``2.2 m, azimuth 30°, elevation -10°``."""
        # Adding 0.0 makes -0.0 plain.
        azimuth_deg, elevation_deg = (
            round(angle, 1) + 0.0 for angle in (self.azimuth_deg, self.elevation_deg)
        )
        return (
            f"{round(self.range_m, 2):g} m, azimuth {azimuth_deg:g}°, elevation {elevation_deg:g}°"
        )


class _Spec:
    """Base class of grid and cloud."""

    kind: ClassVar[str]

    def places(self) -> tuple[Place, ...]:
        """Distinct places."""
        raise NotImplementedError

    def sensors(self, target_m: Vector, beam: Beam | None = None) -> tuple[VirtualSensor, ...]:
        """A sensor per place, aimed at a point in the camera frame, in metres."""
        return tuple(place.sensor(target_m, beam) for place in self.places())

    def as_dict(self) -> dict[str, Any]:
        """Plain values for JSON and TOML that :func:`placements_from_dict` reads."""
        return {"kind": self.kind} | {
            name: list(value) if isinstance(value, tuple) else value
            for name, value in vars(self).items()
        }


@dataclass(frozen=True)
class PlacementGrid(_Spec):
    """Every combination of ranges, azimuths and elevations; each place once.

    Parameters
    ----------
    ranges_m : sequence of float
        From 0.05 to 1000.
    azimuths_deg : sequence of float
        From -360 to 360; -180 and 180 are one place.
    elevations_deg : sequence of float
        From -90 to 90; straight above and below, all azimuths are one place.

    Raises
    ------
    Sd2Error
        When a list is empty, a number is out of bounds, or there are more than 10000 places.
    """

    kind = "grid"

    ranges_m: tuple[float, ...]
    azimuths_deg: tuple[float, ...] = (0.0,)
    elevations_deg: tuple[float, ...] = (0.0,)

    def __post_init__(self) -> None:
        for name in ("ranges_m", "azimuths_deg", "elevations_deg"):
            object.__setattr__(self, name, _numbers(name, getattr(self, name)))
        for name, values in _bounded(self.ranges_m, self.azimuths_deg, self.elevations_deg):
            if not values:
                raise Sd2Error(f"The placements have no {name}", "one number or more")
        count = len(self.ranges_m) * len(self.azimuths_deg) * len(self.elevations_deg)
        if count > MAX_PLACEMENTS:
            raise Sd2Error(
                f"There are {count} placements", f"at most {MAX_PLACEMENTS} around one body"
            )

    def places(self) -> tuple[Place, ...]:
        """Distinct places by range, then azimuth, then elevation, in the given order."""
        return _unique(
            (range_m, azimuth_deg, elevation_deg)
            for range_m in self.ranges_m
            for azimuth_deg in self.azimuths_deg
            for elevation_deg in self.elevations_deg
        )


@dataclass(frozen=True)
class PlacementCloud(_Spec):
    """Random places: uniform per solid angle within the angles, and uniform in range.

    Parameters
    ----------
    count : int
        From 1 to 10000. A larger cloud of the same seed begins with the smaller one.
    range_m, azimuth_deg, elevation_deg : pair of float
        From and to. Bounds as those of a grid; azimuths span at most 360°, and
        150 to 210 is behind the body.
    seed : int
        The same seed makes the same places.

    Raises
    ------
    Sd2Error
        When a number is out of bounds or an interval the wrong way round.
    """

    kind = "cloud"

    count: int
    range_m: Interval
    azimuth_deg: Interval = (0.0, 0.0)
    elevation_deg: Interval = (0.0, 0.0)
    seed: int = 0

    def __post_init__(self) -> None:
        for name, least, most in (("count", 1, MAX_PLACEMENTS), ("seed", 0, 2**63 - 1)):
            value = getattr(self, name)
            if type(value) is not int or not least <= value <= most:
                raise Sd2Error(
                    f"The {name} of the placements is {value!r}",
                    f"an integer from {least} to {most}",
                )
        for name in ("range_m", "azimuth_deg", "elevation_deg"):
            object.__setattr__(self, name, _interval(name, getattr(self, name)))
        _bounded(self.range_m, self.azimuth_deg, self.elevation_deg)
        if self.azimuth_deg[1] - self.azimuth_deg[0] > 360.0:
            raise Sd2Error(
                f"The azimuths of the placements go from {self.azimuth_deg[0]:g}°"
                f" to {self.azimuth_deg[1]:g}°",
                "at most once around, 360°",
            )

    def places(self) -> tuple[Place, ...]:
        """Distinct places in the order they are drawn."""
        drawn = np.random.default_rng(self.seed).random((self.count, 3))
        azimuth_deg = self.azimuth_deg[0] + drawn[:, 1] * (
            self.azimuth_deg[1] - self.azimuth_deg[0]
        )
        # A band of the sphere is as large as the sines of its elevations are apart.
        low, high = (math.sin(math.radians(edge)) for edge in self.elevation_deg)
        sines = np.clip(low + drawn[:, 2] * (high - low), -1.0, 1.0)
        elevation_deg = np.clip(np.degrees(np.arcsin(sines)), *self.elevation_deg)
        range_m = self.range_m[0] + drawn[:, 0] * (self.range_m[1] - self.range_m[0])
        return _unique(
            zip(range_m.tolist(), azimuth_deg.tolist(), elevation_deg.tolist(), strict=True)
        )


Placements = PlacementGrid | PlacementCloud


def placements_from_dict(content: object) -> Placements:
    """Inverse of ``as_dict``: placements from a mapping as JSON or TOML hold it.

    Keys that have a default may be absent; others than those of ``as_dict`` are refused.
    Raises Sd2Error if a key is missing or unknown, or a value is not what it should be.
    """
    if not isinstance(content, Mapping):
        raise Sd2Error(f"The placements are {content!r}", 'a table with kind = "grid" or "cloud"')
    given = dict(content)
    name = given.pop("kind", None)
    kind = next((kind for kind in (PlacementGrid, PlacementCloud) if kind.kind == name), None)
    if kind is None:
        raise Sd2Error(f"The kind of the placements is {name!r}", '"grid" or "cloud"')
    wanted = {field.name for field in fields(kind)}
    needed = {field.name for field in fields(kind) if field.default is MISSING}
    for problem, keys in (("no", needed - given.keys()), ("an unknown", given.keys() - wanted)):
        if keys:
            raise Sd2Error(
                f"The placements have {problem} {sorted(map(str, keys))[0]}",
                f"for a {name}: {', '.join(sorted(wanted))}",
            )
    return kind(**given)


def read_placements(file: Path) -> Placements:
    """Read a spec: JSON of :func:`write_placements` or by hand, or TOML (``.toml``).

    Raises Sd2Error, which names the file, if it cannot be read or holds something else.
    """
    file = Path(file)
    read: Callable[..., Any] = read_toml if file.suffix.lower() == ".toml" else read_json
    content = read(file, "placements as JSON or TOML", "`sd2 placements` writes such a file")
    if isinstance(content, dict):
        name, version = content.pop("format", FORMAT), content.pop("version", VERSION)
        if name != FORMAT or type(version) is not int or version != VERSION:
            raise Sd2Error(
                f"{file} has the format {name!r}, version {version!r}",
                f"the format {FORMAT!r}, version {VERSION}",
            )
    with errors_in(file):
        return placements_from_dict(content)


def write_placements(file: Path, placements: Placements) -> None:
    """Write a spec as JSON, atomically."""
    content = {"format": FORMAT, "version": VERSION, **placements.as_dict()}
    atomic_write_text(Path(file), json.dumps(content, indent=2) + "\n")


def _unique(raw: Iterable[tuple[float, float, float]]) -> tuple[Place, ...]:
    return tuple(dict.fromkeys(_place(*values) for values in raw))


def _place(range_m: float, azimuth_deg: float, elevation_deg: float) -> Place:
    """Place in its canonical form; adding 0.0 turns -0.0 into 0.0."""
    elevation_deg = round(elevation_deg, _DIGITS) + 0.0
    azimuth_deg = round(math.remainder(azimuth_deg, 360.0), _DIGITS) + 0.0
    if azimuth_deg == -180.0:
        azimuth_deg = 180.0
    if abs(elevation_deg) == 90.0:  # straight above or below
        azimuth_deg = 0.0
    return Place(round(range_m, _DIGITS), azimuth_deg, elevation_deg)


def _numbers(name: str, values: object) -> tuple[float, ...]:
    if not isinstance(values, (list, tuple)):
        raise Sd2Error(f"The {name} of the placements are {values!r}", "a list of numbers")
    for value in values:
        # No finite bound is wider; an integer beyond it may not even be a float.
        if type(value) not in (int, float) or not abs(value) < 1e9:
            raise Sd2Error(f"The {name} of the placements hold {value!r}", "finite numbers")
    return tuple(float(value) for value in values)


def _interval(name: str, values: object) -> Interval:
    numbers = _numbers(name, values)
    if len(numbers) != 2 or not numbers[0] <= numbers[1]:
        raise Sd2Error(
            f"The {name} of the placements is {list(numbers)}", "two numbers, the smaller one first"
        )
    return (numbers[0], numbers[1])


def _bounded(
    ranges_m: tuple[float, ...], azimuths_deg: tuple[float, ...], elevations_deg: tuple[float, ...]
) -> tuple[tuple[str, tuple[float, ...]], ...]:
    """Names and values, after a check of all bounds."""
    for name, values, bounds, unit in (
        ("range", ranges_m, RANGE_M, " m"),
        ("azimuth", azimuths_deg, AZIMUTH_DEG, "°"),
        ("elevation", elevations_deg, ELEVATION_DEG, "°"),
    ):
        for value in values:
            if value not in bounds:
                raise Sd2Error(
                    f"A placement has the {name} {value:g}{unit}",
                    f"{bounds.low:g} to {bounds.high:g}{unit}",
                )
    return (("ranges", ranges_m), ("azimuths", azimuths_deg), ("elevations", elevations_deg))


_VALUE_BYTES, _TIME_BYTES = 4, 8
"""Single precision for values, double for times."""


@dataclass(frozen=True)
class PlacementCost:
    """Time and memory of one map per placement."""

    maps: int
    frames: int  # of each map
    frame_ms: float  # measured time per frame on all cores of the plan that holds the tolerance
    bins: int = 32  # of a map, along velocity

    @property
    def total_s(self) -> float:
        """Seconds for all maps, without the preparation of the clip."""
        return self.maps * (1e-3 * self.frame_ms * self.frames)

    @property
    def total_bytes(self) -> int:
        """Bytes of the values and times of all maps, before compression."""
        return self.maps * self.frames * (_VALUE_BYTES * self.bins + _TIME_BYTES)
