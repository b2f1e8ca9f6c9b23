"""Random people with their habits, and random scenes: camera, sensors, static reflectors."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from sd2core.body.rotations import Floats, about
from sd2core.body.shape import BodyShape, ShapeSpace
from sd2core.fmcw.options import Reflector
from sd2core.radar_config import RadarConfig
from sd2core.sensor import Vector, VirtualSensor, aimed_at, position_from_spherical
from sd2core.simulate.campaign.protocol import VARIED, Protocol

RANGES_M = (1.5, 4.0)
"""Distances of the person from the camera, and of the chest from the other sensors."""

FIXED_M = 2.2
"""Distance of the person from camera and sensor where places do not vary, as in the sample."""

_CAMERA_M = (0.8, 1.6)
_FIXED_CAMERA_M = 1.1
_BESIDE_M = 0.25
_HEADING_DEG = (12.0, 30.0)  # spread, most
_AZIMUTH_DEG, _ELEVATION_DEG = 45.0, (-10.0, 25.0)
_CHEST = 0.75
"""Height of the chest over the stature."""
_REFLECTORS = (3, 8)
_CROSS_SECTION_M2 = (0.05, 5.0)

_SUBJECT = 1  # takes have 0 in this place of the seed


@dataclass(frozen=True, eq=False)
class Subject:
    """One person."""

    name: str
    shape: BodyShape
    hand: Literal["L", "R"]  # Hand that makes most gestures.
    other_hand: float  # Share of the gestures that the other one makes.
    tempo: float  # Time for a stroke, 1 on average.
    size: float  # Width of a stroke, 1 on average.
    held_deg: tuple[float, float]  # Azimuth and elevation that are added to every pose of the arms.
    follow: float  # Motion of the torso with the arm, 1 on average.
    sway_deg: float  # Standard deviation of the lean about the ankles.
    rests: float  # Length of pauses, 1 on average.


def subject_name(number: int) -> str:
    """``s01``, ``s02`` … of the subjects from 0 on."""
    return f"s{number + 1:02d}"


def random_subject(space: ShapeSpace, seed: int, number: int) -> Subject:
    """A person of a campaign; the same for the same seed and number."""
    rng = np.random.default_rng([seed, _SUBJECT, number])
    shape = space.random(rng)
    right = bool(rng.random() < 0.85)
    tempo, size, follow, rests = np.exp(rng.normal(0.0, [0.15, 0.1, 0.3, 0.3]))
    azimuth, elevation = rng.normal(0.0, [4.0, 5.0])
    return Subject(
        subject_name(number),
        shape,
        "R" if right else "L",
        float(rng.uniform(0.0, 0.35)),
        float(tempo),
        float(size),
        (float(azimuth), float(elevation)),
        float(follow),
        float(np.exp(rng.normal(np.log(0.35), 0.4))),
        float(rests),
    )


@dataclass(frozen=True, eq=False)
class Setting:
    """Scene of one take."""

    place_m: Floats  # Point of the floor under the person, in the camera frame.
    heading_deg: float  # From facing along the camera's axis.
    sensors: tuple[VirtualSensor, ...]  # The take's own beside the camera, then others.
    reflectors: tuple[Reflector, ...]

    def turned(self, rng: np.random.Generator) -> Setting:
        """Copy of the scene with the person turned anyhow."""
        return replace(self, heading_deg=float(rng.uniform(-180.0, 180.0)))

    def place(self, transforms: Floats) -> Floats:
        """Transforms (T, B, 3, 4) of a body on the floor's origin, brought here."""
        turn = about(np.array([0.0, 1.0, 0.0]), np.array([self.heading_deg]))[0]
        placed = np.einsum("ij,tbjk->tbik", turn, transforms)
        placed[..., 3] += self.place_m
        return placed


def kept_away(transforms: Floats) -> Floats:
    """Transforms of a body, farther away if it came nearer to the camera than others do."""
    moved = transforms.copy()
    moved[..., 2, 3] += max(0.0, RANGES_M[0] - float(transforms[:, 0, 2, 3].min()))
    return moved


def random_setting(
    rng: np.random.Generator,
    stature_m: float,
    placements: int,
    config: RadarConfig,
    protocol: Protocol = VARIED,
) -> Setting:
    """A setting; the first sensor does not depend on how many there are.

    Parameters
    ----------
    rng : Generator
    stature_m : float
        Of the person: sensors are aimed at the chest.
    placements : int
        Number of sensors.
    config : RadarConfig
        By its wavelength reflectors have their areas.
    protocol : Protocol
        Whether place and heading vary.
    """
    distance_m = float(rng.uniform(RANGES_M[0] + _BESIDE_M, RANGES_M[1]))
    camera_m = float(rng.uniform(*_CAMERA_M))
    across_m = float(rng.uniform(-0.1, 0.1)) * distance_m
    heading = float(np.clip(rng.normal(0.0, _HEADING_DEG[0]), -_HEADING_DEG[1], _HEADING_DEG[1]))
    x, y = rng.uniform(-_BESIDE_M, _BESIDE_M, 2)
    if not protocol.place:
        distance_m, camera_m, across_m, x, y = FIXED_M, _FIXED_CAMERA_M, 0.0, 0.0, 0.0
    if not protocol.heading:
        heading = 0.0
    chest = (across_m, camera_m - _CHEST * stature_m, distance_m)
    reflectors = tuple(
        _reflector(rng, distance_m, camera_m, config) for _ in range(rng.integers(*_REFLECTORS))
    )
    sensors = [aimed_at(VirtualSensor((float(x), float(y), 0.0)), chest)]
    for _ in range(1, placements):
        position = position_from_spherical(
            chest,
            float(rng.uniform(*RANGES_M)),
            float(rng.uniform(-_AZIMUTH_DEG, _AZIMUTH_DEG)),
            float(rng.uniform(*_ELEVATION_DEG)),
        )
        sensors.append(aimed_at(VirtualSensor(position), chest))
    place = np.array([across_m, camera_m, distance_m])
    return Setting(place, heading, tuple(sensors), reflectors)


def _reflector(
    rng: np.random.Generator, distance_m: float, camera_m: float, config: RadarConfig
) -> Reflector:
    """Something of the room beside or behind the person."""
    position: Vector = (
        float(rng.uniform(-2.0, 2.0)),
        camera_m - float(rng.uniform(0.0, 2.2)),
        distance_m + float(rng.uniform(0.3, 3.0)),
    )
    cross_section = float(np.exp(rng.uniform(*np.log(_CROSS_SECTION_M2))))
    # A plate of area A has the cross section 4 π A² / λ².
    area = config.wavelength_m * float(np.sqrt(cross_section / (4.0 * np.pi)))
    return Reflector(position, area)
