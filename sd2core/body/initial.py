"""A first pose from lifted landmarks, limb by limb in closed form.

Every joint is turned so that the vectors between its landmarks come nearest to those
seen; bone lengths are the body's own. Elbows and knees take their angle from the
angle between the bones.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sd2core.body.rig import JOINT, JOINTS, Rig
from sd2core.body.rotations import Floats, aligning, applied, from_vector, to_vector, transposed
from sd2core.body.track import LANDMARK

_FACE = ("nose", "ear.L", "ear.R", "eye_outer.L", "eye_outer.R", "mouth.L", "mouth.R")


class Pose(NamedTuple):
    """Rotation of every joint (T, J, 3, 3) and translation (T, 3) in metres."""

    turns: Floats
    translation_m: Floats

    def at(self, frames: NDArray[np.intp] | slice) -> Pose:
        """The pose of some frames."""
        return Pose(self.turns[frames], self.translation_m[frames])


def initial_pose(rig: Rig, seen_m: Floats, trust: Floats) -> Pose:
    """Pose whose limbs lie along landmarks (T, 33, 3) in the camera frame, weighted by trust."""
    frames = len(seen_m)
    pose = Pose(np.tile(np.eye(3), (frames, len(JOINTS), 1, 1)), np.zeros((frames, 3)))
    fit = _Fitting(rig, pose, seen_m, trust)
    fit.ball("root", _pairs("hip.L", "hip.R") + _across("hip", "shoulder"))
    # A third of the turn between pelvis and shoulders in each of three places.
    fit.shared("spine", _pairs("shoulder.L", "shoulder.R") + _across("hip", "shoulder"), 3)
    face = [(LANDMARK["nose"], LANDMARK[other]) for other in _FACE[1:]]
    fit.shared("head", face + _pairs("ear.L", "ear.R"), 3)
    for side in "LR":
        arm = [f"{part}.{side}" for part in ("shoulder", "elbow", "wrist")]
        fit.hinge(f"elbow.{side}", arm)
        fit.ball(f"shoulder.{side}", _pairs(*arm[:2]) + _pairs(*arm[1:]))
        fit.hand(side)
        leg = [f"{part}.{side}" for part in ("hip", "knee", "ankle")]
        fit.hinge(f"knee.{side}", leg)
        fit.ball(f"hip.{side}", _pairs(*leg[:2]) + _pairs(*leg[1:]))
        foot = [f"{part}.{side}" for part in ("ankle", "heel", "foot_index")]
        fit.ball(f"ankle.{side}", _pairs(foot[0], foot[2]) + _pairs(foot[1], foot[2]))
    points_m = rig.keypoints.positions(rig.transforms(pose.turns, pose.translation_m))
    weights = trust[..., None] + 1e-9
    pose.translation_m[:] = ((seen_m - points_m) * weights).sum(axis=1) / weights.sum(axis=1)
    return pose


def _pairs(first: str, second: str) -> list[tuple[int, int]]:
    return [(LANDMARK[first], LANDMARK[second])]


def _across(low: str, high: str) -> list[tuple[int, int]]:
    return [(LANDMARK[f"{low}.{a}"], LANDMARK[f"{high}.{b}"]) for a in "LR" for b in "LR"]


class _Fitting:
    """Turns joints one after the other, parents first."""

    def __init__(self, rig: Rig, pose: Pose, seen_m: Floats, trust: Floats) -> None:
        self.rig, self.pose, self.seen_m, self.trust = rig, pose, seen_m, trust

    def ball(self, name: str, pairs: list[tuple[int, int]]) -> None:
        self.pose.turns[:, JOINT[name]] = self._turn(name, pairs)

    def shared(self, name: str, pairs: list[tuple[int, int]], places: int) -> None:
        vector = to_vector(self._turn(name, pairs))
        self.pose.turns[:, JOINT[name]] = from_vector(vector / places)

    def hinge(self, name: str, chain: list[str]) -> None:
        """Bend until the angle between the two bones is the one seen."""
        first, middle, last = (LANDMARK[point] for point in chain)
        rest = self.rig.keypoints.rest_m
        at_rest = _angle(rest[middle] - rest[first], rest[last] - rest[middle])
        seen = _angle(
            self.seen_m[:, middle] - self.seen_m[:, first],
            self.seen_m[:, last] - self.seen_m[:, middle],
        )
        axis = self.rig.axes[JOINT[name]][:, 0]
        self.pose.turns[:, JOINT[name]] = from_vector((seen - at_rest)[:, None] * axis)

    def hand(self, side: str) -> None:
        """Wrist and twist of the forearm: half of the twist at each of its places."""
        knuckles = [f"{part}.{side}" for part in ("index", "pinky", "thumb")]
        pairs = [(LANDMARK[f"wrist.{side}"], LANDMARK[point]) for point in knuckles]
        pairs += _pairs(f"pinky.{side}", f"index.{side}")
        turn = self._turn(f"wrist.{side}", pairs)
        axis = self.rig.axes[JOINT[f"pronation.{side}"]][:, 0]
        vector = to_vector(turn)
        half = np.clip(0.5 * vector @ axis, -0.8, 0.8)[:, None] * axis
        twist = from_vector(half)
        self.pose.turns[:, JOINT[f"pronation.{side}"]] = twist
        # What is left of the turn after both halves, in the frame that they leave.
        self.pose.turns[:, JOINT[f"wrist.{side}"]] = transposed(twist @ twist) @ turn

    def _turn(self, name: str, pairs: list[tuple[int, int]]) -> Floats:
        """Rotation of the first of a joint's bones, relative to its parent, (T, 3, 3)."""
        skeleton = self.rig.skeleton
        transforms = self.rig.transforms(self.pose.turns, self.pose.translation_m)
        bone = skeleton.index[JOINTS[JOINT[name]].bones[0]]
        parent = skeleton.parents[bone]
        start, end = (np.array(rows) for rows in zip(*pairs, strict=True))
        # Vectors as the joints below it have them already, seen from this bone.
        points_m = self.rig.keypoints.positions(transforms)
        own = transposed(transforms[:, bone, :, :3])[:, None]
        rest = applied(own, points_m[:, end] - points_m[:, start])
        above = transforms[:, parent, :, :3] if parent >= 0 else np.eye(3)[None]
        seen = applied(transposed(above)[:, None], self.seen_m[:, end] - self.seen_m[:, start])
        weights = np.minimum(self.trust[:, start], self.trust[:, end]) + 1e-3
        return aligning(rest, seen, weights)


def _angle(first: Floats, second: Floats) -> Floats:
    cross = np.linalg.norm(np.cross(first, second), axis=-1)
    return np.asarray(np.arctan2(cross, (first * second).sum(axis=-1)))
