"""Random actions of the people that the lifter is trained on."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np

from sd2core.simulate.people.arms import STYLES, ArmStyle
from sd2core.simulate.people.motion import Deed
from sd2core.simulate.people.walking import Mode

Manner = Literal["any", "natural", "gestures", "forearms"]
"""Manner of simulated motion: elbows any way they can be, elbows as people have them, or standing
or sitting before the camera and making strokes with one hand or both: with arms that sweep about
the shoulder, or with forearms that turn about elbows that stay."""

LEGS: dict[Mode, float] = {"stand": 0.56, "shift": 0.18, "walk": 0.14, "turn": 0.05, "sit": 0.07}
"""Actions of the legs, each with its probability."""

GESTURE_STYLES = {
    "gestures": ArmStyle(0.3, 1.3, 0.75, 0.5, (("reach", 0.88), ("hang", 0.12)), 0.05),
    "out and back": ArmStyle(0.3, 1.3, 0.75, 0.5, (("reach", 0.95), ("hang", 0.05)), 0.0, True),
}
"""Styles of a person who gestures before a sensor; trained on too."""

HELD_OUT_STYLES = {
    "boxing": ArmStyle(0.25, 0.5, 0.4, 0.5, (("forward", 0.6), ("guard", 0.4)), 0.0, True),
    "directing": ArmStyle(0.45, 1.1, 0.6, 0.8, (("low", 0.4), ("up", 0.3), ("aside", 0.3)), 0.0),
    "signing": ArmStyle(0.25, 0.6, 0.3, 0.4, (("chest", 0.4), ("face", 0.4), ("across", 0.2)), 0.5),
}
"""Styles that the lifter is tested on: these never occur in training."""

_ALL = STYLES | GESTURE_STYLES | HELD_OUT_STYLES

_STILL = 0.14
"""Share of takes without motion."""


def random_deed(
    rng: np.random.Generator, *, held_out: bool = False, manner: Manner = "any"
) -> Deed:
    """Random action; ``held_out`` takes the arms' styles from those kept for testing."""
    if manner in ("gestures", "forearms") and not held_out:
        return replace(_gestures(rng), elbows_rest=manner == "forearms")
    styles = list(HELD_OUT_STYLES if held_out else STYLES)
    legs: Mode = rng.choice(list(LEGS), p=list(LEGS.values()))
    if held_out and legs in ("walk", "turn") and rng.random() < 0.5:
        legs = "stand"
    one, other = (str(name) for name in rng.choice(styles, 2))
    drawn = rng.random()
    if drawn < 0.3:
        other = one
    elif drawn < 0.6 and not held_out:
        other = "rest"
    arms = _on_sides(rng, one, other)
    still = bool(rng.random() < _STILL)
    return Deed("stand" if still and legs != "sit" else legs, arms, still, manner != "any")


def _gestures(rng: np.random.Generator) -> Deed:
    legs: Mode = rng.choice(["stand", "shift", "sit"], p=[0.75, 0.15, 0.1])
    one = str(rng.choice(list(GESTURE_STYLES)))
    other = str(rng.choice(["rest", one], p=[0.85, 0.15]))
    arms = _on_sides(rng, one, other)
    return Deed(legs, arms, bool(rng.random() < _STILL / 2), natural=True, calm=True)


def _on_sides(rng: np.random.Generator, one: str, other: str) -> tuple[ArmStyle, ArmStyle]:
    names = (one, other) if rng.random() < 0.5 else (other, one)
    return _ALL[names[0]], _ALL[names[1]]
