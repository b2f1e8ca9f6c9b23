"""Random actions of the people that the lifter is trained on."""

from __future__ import annotations

from typing import Literal

import numpy as np

from sd2core.simulate.people.arms import GESTURE_STYLES, HELD_OUT_STYLES, TRAINING_STYLES
from sd2core.simulate.people.motion import Deed
from sd2core.simulate.people.walking import MODES

Manner = Literal["any", "natural", "gestures"]
"""Manner of motion: elbows any way they can be, elbows as people have them, or standing or
sitting before the camera and making strokes with one hand or both."""

_STILL = 0.14
"""Share of takes without motion."""


def random_deed(
    rng: np.random.Generator, *, held_out: bool = False, manner: Manner = "any"
) -> Deed:
    """Random action; ``held_out`` takes the arms' styles from those kept for testing."""
    if manner == "gestures" and not held_out:
        return _gestures(rng)
    styles = list(HELD_OUT_STYLES if held_out else TRAINING_STYLES)
    legs = str(rng.choice(list(MODES), p=list(MODES.values())))
    if held_out and legs in ("walk", "turn") and rng.random() < 0.5:
        legs = "stand"
    one, other = (str(name) for name in rng.choice(styles, 2))
    drawn = rng.random()
    if drawn < 0.3:
        other = one
    elif drawn < 0.6 and not held_out:
        other = "rest"
    arms = (one, other) if rng.random() < 0.5 else (other, one)
    still = bool(rng.random() < _STILL)
    return Deed("stand" if still and legs != "sit" else legs, arms, still, manner != "any")


def _gestures(rng: np.random.Generator) -> Deed:
    legs = str(rng.choice(["stand", "shift", "sit"], p=[0.75, 0.15, 0.1]))
    one = str(rng.choice(list(GESTURE_STYLES)))
    other = str(rng.choice(["rest", one], p=[0.85, 0.15]))
    arms = (one, other) if rng.random() < 0.5 else (other, one)
    return Deed(legs, arms, bool(rng.random() < _STILL / 2), natural=True, calm=True)
