"""People of a simulated campaign: their shapes and habits of movement."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from sd2core.body.shape import BodyShape, ShapeSpace

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
