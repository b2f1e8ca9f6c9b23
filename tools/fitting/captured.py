"""Motion of real people for the clips of known motion: on another body, before a camera."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sd2core.body.model import Skeleton
from sd2core.body.rig import KeypointSpace, Rig
from sd2core.body.rotations import Floats, applied
from sd2core.body.shape import BodyShape, ShapeSpace
from sd2core.errors import Sd2Error
from sd2core.mocap.body_motion import RATE_HZ, BodyMotion, Role
from sd2core.simulate.limbs import turn_about
from tools.fitting.motions import Action
from tools.motion_capture.bodies import moved_transforms

_REMEDY = "Make it: python -m tools.motion_capture drive DATA/motion MOTIONS"


def captured_transforms(
    space: ShapeSpace,
    shape: BodyShape,
    action: Action,
    place_m: Floats,
    motions: Path | None,
    role: Role,
) -> Floats:
    """Transforms (T, B, 3, 4) of a body's bones in the camera frame.

    The middle of the way lies at ``place_m`` (3,): to the right, of the floor below the camera,
    ahead. Raises Sd2Error without the recording, if it is for another use than ``role``, or if it
    is shorter than the action.
    """
    if motions is None:
        raise Sd2Error(f"The motion {action.trial} is not at hand", "--motions MOTIONS", _REMEDY)
    path = motions / f"{action.trial}.npz"
    if not path.is_file():
        raise Sd2Error(f"{path} does not exist", "a motion of that name", _REMEDY)
    motion = BodyMotion.load(path)
    if motion.role != role:
        raise Sd2Error(f"{path} is a motion to {motion.role}", f"one to {role}")
    start = round(action.start_s * RATE_HZ)
    frames = slice(start, start + round(action.length_s * RATE_HZ))
    if len(motion) < frames.stop:
        raise Sd2Error(f"{path} has {len(motion)} frames", f"{frames.stop} or more")
    whole = space.skeleton(shape)
    rig = Rig(whole, KeypointSpace(space).of(shape))
    pose = motion.pose_on(whole, space.skeleton(motion.shape), frames)
    transforms = whole.transforms(rig.body_rotations(pose.turns), pose.translation_m)
    return _before_camera(whole, transforms, action.heading_deg, place_m)


def _before_camera(
    skeleton: Skeleton, transforms: Floats, heading_deg: float, place_m: Floats
) -> Floats:
    """Turned about the vertical until the start has the wanted heading, then moved."""
    root = skeleton.heads_m[0]
    ahead = -transforms[0, 0, :, 2]  # at rest the body looks along -z
    facing_deg = np.degrees(np.arctan2(-ahead[0], -ahead[2]))
    turn = turn_about(1, np.array([heading_deg - facing_deg]))[0]
    way_m = applied(turn, applied(transforms[:, 0, :, :3], root) + transforms[:, 0, :, 3])
    middle_m = 0.5 * (way_m.min(axis=0) + way_m.max(axis=0))
    return moved_transforms(transforms, turn, place_m - middle_m * [1.0, 0.0, 1.0])
