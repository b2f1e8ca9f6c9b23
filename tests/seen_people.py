"""Simulated people as a good landmark model sees them, before anything is repaired."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from sd2core.body.raw_track import RawTrack
from sd2core.body.rig import KeypointSpace
from sd2core.body.shape import ShapeSpace
from sd2core.body.track import LANDMARK, TORSO_CORNERS
from sd2core.simulate.people.arms import STYLES
from sd2core.simulate.people.motion import Deed, random_motion

FOCAL_PX = 600.0
FACE = 11
"""Landmarks of the face come first."""

_DEEDS = (
    Deed("walk", (STYLES["rest"], STYLES["rest"]), still=False),
    Deed("stand", (STYLES["rest"], STYLES["strokes"]), still=False),
    Deed("shift", (STYLES["talk"], STYLES["wave"]), still=False),
)


@lru_cache(maxsize=16)
def somebody(seed: int, frames: int = 90, frames_per_s: float = 30.0) -> RawTrack:
    """Somebody who walks (seeds 0, 3, 6 …) or gestures, 4 m away; not to be changed."""
    rng = np.random.default_rng(seed)
    space, times_s = ShapeSpace(), np.arange(frames) / frames_per_s
    shape = space.random(rng)
    skeleton = space.skeleton(shape)
    motion = random_motion(rng, skeleton, shape.stature_m, times_s, _DEEDS[seed % len(_DEEDS)])
    places_m = KeypointSpace(space).of(shape).positions(skeleton.transforms(*motion))
    centre_m = places_m[0, TORSO_CORNERS].mean(axis=0)
    places_m = places_m - centre_m + np.array([0.0, 0.0, 4.0])
    around_m = places_m - places_m[:, TORSO_CORNERS[2:]].mean(axis=1, keepdims=True)
    pixels = FOCAL_PX * places_m[..., :2] / places_m[..., 2:] + [320.0, 240.0]
    # A face that is turned away is not seen.
    nose, ears = LANDMARK["nose"], [LANDMARK["ear.L"], LANDMARK["ear.R"]]
    away = places_m[:, nose, 2] > places_m[:, ears, 2].mean(axis=1)
    visibility = np.full((frames, 33), 1.0, np.float32)
    visibility[away, :FACE] = 0.1
    return RawTrack(
        times_s=times_s,
        present=np.ones(frames, bool),
        bridged=np.zeros(frames, bool),
        image_px=(pixels + rng.standard_normal(pixels.shape)).astype(np.float32),
        depth_px=(0.8 * around_m[..., 2] * FOCAL_PX / 4.0).astype(np.float32),
        world_m=(around_m * [1.0, 1.0, 0.8]).astype(np.float32),
        visibility=visibility,
    )
