"""Random cameras that see a person in a random part of their picture."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sd2core.body.camera import PinholeCamera
from sd2core.body.rotations import Floats, applied
from sd2core.body.track import LANDMARKS, TORSO_CORNERS
from sd2core.simulate.limbs import turn_about
from tools.motion_capture.bodies import moved_transforms

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
