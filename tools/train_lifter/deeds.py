"""Random actions of the people that the lifter is trained on, and cameras that see them."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from sd2core.body.camera import PinholeCamera
from sd2core.body.rotations import Floats, applied
from sd2core.body.track import LANDMARKS, TORSO_CORNERS
from sd2core.simulate.limbs import turn_about
from sd2core.simulate.people.arms import STYLES, ArmStyle
from sd2core.simulate.people.motion import Deed
from sd2core.simulate.people.walking import Mode
from tools.motion_capture.catalogue import moved_transforms

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


_SIZES = ((640, 480), (640, 480), (640, 360), (480, 640))
_PHONES = ((640, 480), (640, 360), (480, 640), (360, 640))
_UPPER_BODY = tuple(
    LANDMARKS.index(name) for name in ("nose", "shoulder.L", "shoulder.R", "elbow.L", "elbow.R")
)


@dataclass(frozen=True, eq=False)
class View:
    """A camera, and how the world is moved into its frame."""

    camera: PinholeCamera
    turn: Floats  # (3, 3)
    shift_m: Floats  # (3,), a point x of the world is at ``turn @ x + shift_m`` in the camera frame

    def points(self, points_m: Floats) -> Floats:
        """Points (..., 3) of the world in the camera frame."""
        return np.asarray(applied(self.turn, points_m) + self.shift_m)

    def transforms(self, transforms: Floats) -> Floats:
        """Transforms of bones (T, B, 3, 4) that end in the camera frame."""
        return moved_transforms(transforms, self.turn, self.shift_m)


def random_view(rng: np.random.Generator, keypoints_m: Floats) -> View | None:
    """A camera that sees the upper body of a person all the time.

    Keypoints (T, 33, 3) are on the floor of the world, y down, facing about -z. None where no
    camera of a hundred sees it: the person walks too far.
    """
    upper = keypoints_m[:, _UPPER_BODY]
    hips = keypoints_m[:, [LANDMARKS.index("hip.L"), LANDMARKS.index("hip.R")]].mean(axis=1)
    middle = upper.mean(axis=(0, 1))
    for _ in range(100):
        camera = _camera(rng, _SIZES, 75.0)
        # Half of the people near, as before a webcam, the rest anywhere.
        distance = rng.uniform(1.2, 2.2) if rng.random() < 0.5 else rng.uniform(1.5, 5.0)
        aside = rng.uniform(-0.3, 0.3) * distance * camera.width / camera.focal_px
        above = rng.uniform(0.5, 1.9)
        # Seen from the front mostly, from anywhere sometimes.
        azimuth = rng.normal(0.0, 25.0) if rng.random() < 0.95 else rng.uniform(-180.0, 180.0)
        around = turn_about(1, np.array([azimuth]))[0]
        at = middle + around @ np.array([-aside, -above - middle[1], -distance])
        slope = rng.uniform(-0.3, 0.3) * camera.height / camera.focal_px
        pitch = math.degrees(math.atan2(middle[1] - at[1], distance) - math.atan(slope))
        if abs(pitch) > 17.0:
            continue
        view = _tilted(camera, at, around, pitch, rng.normal(0.0, 1.5))
        if _sees(view, upper, hips):
            return view
    return None


def random_view_around(rng: np.random.Generator, keypoints_m: Floats) -> View | None:
    """A camera anywhere around a person, of a phone or a webcam, that sees the trunk.

    Headings are uniform over the circle, heights 0.4 to 2.5 m above the floor, distances 1 to 6 m.
    Three of five see the whole body most of the time; the others may cut off arms and legs.
    Keypoints (T, 33, 3) are in the world, y down, the floor at 0. None where no camera of a hundred
    sees it.
    """
    middle = keypoints_m[:, TORSO_CORNERS].mean(axis=(0, 1))
    whole = rng.random() < 0.6
    for _ in range(100):
        camera = _camera(rng, _PHONES, 80.0)
        distance = rng.uniform(1.0, 6.0)
        aside = rng.uniform(-0.25, 0.25) * distance * camera.width / camera.focal_px
        around = turn_about(1, np.array([rng.uniform(-180.0, 180.0)]))[0]
        at = middle + around @ np.array([-aside, 0.0, -distance])
        at[1] = -rng.uniform(0.4, 2.5)
        slope = rng.uniform(-0.25, 0.25) * camera.height / camera.focal_px
        pitch = math.degrees(math.atan2(middle[1] - at[1], distance) - math.atan(slope))
        if abs(pitch) > 30.0:
            continue
        view = _tilted(camera, at, around, pitch, rng.normal(0.0, 2.0))
        seen_m = view.points(keypoints_m)
        if seen_m[..., 2].min() < 0.7:
            continue
        places_px = camera.project(seen_m)
        inside = np.all((places_px >= 0.0) & (places_px <= [camera.width, camera.height]), axis=2)
        if inside[:, TORSO_CORNERS].mean() > 0.97 and (not whole or inside.mean() > 0.95):
            return view
    return None


def _camera(
    rng: np.random.Generator, sizes: tuple[tuple[int, int], ...], widest_deg: float
) -> PinholeCamera:
    """A camera with a picture of one of some sizes, that sees 45 degrees or more."""
    width, height = sizes[rng.integers(len(sizes))]
    field = math.radians(rng.uniform(45.0, widest_deg))
    return PinholeCamera(width, height, max(width, height) / 2.0 / math.tan(field / 2.0))


def _tilted(
    camera: PinholeCamera, at: Floats, around: Floats, pitch_deg: float, roll_deg: float
) -> View:
    """View from a place (3,), turned about the vertical, then up or down, then aside."""
    turn = turn_about(0, np.array([pitch_deg]))[0] @ around.T
    turn = turn_about(2, np.array([roll_deg]))[0] @ turn
    return View(camera, turn, -turn @ at)


def _sees(view: View, upper: Floats, hips: Floats) -> bool:
    seen, below = view.points(upper), view.points(hips)
    if seen[..., 2].min() < 0.7 or below[..., 2].min() < 0.7:
        return False
    size = np.array([view.camera.width, view.camera.height])
    upper_px, hips_px = view.camera.project(seen), view.camera.project(below)
    inside = np.all((upper_px >= 0.02 * size) & (upper_px <= 0.98 * size), axis=2)
    return bool(
        np.all(inside[:, :3])
        and np.mean(inside[:, 3:]) > 0.7
        and (hips_px[:, 1] < 1.25 * size[1]).all()
        and (np.ptp(upper_px[:, :3, 1], axis=1) > 12.0).all()
    )
