"""The paper's four swipes as the motion of a standing body's right arm.

Directions are as the sensor (and the camera) sees them: a left-to-right swipe goes
from the left of the image to its right, which is from the body's right to its left.

The hand follows minimum-jerk moves (T. Flash and N. Hogan, "The coordination of arm
movements", J. Neurosci. 5, 1985) between poses that are given around the shoulder, so
that a swipe is an arc, as a real one is, and has a radial velocity even where it
crosses the view. The arm follows by closed-form inverse kinematics; torso and head go
along a little, and the chest breathes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple, dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from sd2core.body.model import Skeleton
from sd2core.body.rotations import Floats, about, applied, frame, product, transposed

DURATION_S = 15.0


class GestureSpan(NamedTuple):
    """Time span of one gesture: half-open ``[start_s, end_s)``."""

    start_s: float
    end_s: float
    label: str


class Motion(NamedTuple):
    """Rotations (T, B, 3, 3) and translation (T, 3) for :meth:`sd2core.body.model.Body.pose`."""

    rotations: Floats
    translation_m: Floats


@dataclass(frozen=True)
class ArmPose:
    """Pose of one arm: place of the wrist seen from the shoulder, elbow, hand, torso.

    ``elbow_out``, ``elbow_down`` and ``elbow_back`` are the direction in which the elbow bends out
    of the line from shoulder to wrist.
    """

    azimuth_deg: float  # From straight ahead, positive across the body.
    elevation_deg: float  # Positive upwards.
    reach_m: float  # From shoulder to wrist.
    elbow_out: float
    elbow_down: float
    elbow_back: float
    pronation_deg: float  # Turn of the hand about the forearm, thumb inwards.
    flexion_deg: float  # Bend of the hand towards its palm.
    torso_deg: float  # Turn of the upper body, positive across (the arm's side comes forward).


class Move(NamedTuple):
    """One arm's way to a pose; a labelled one is a gesture's stroke."""

    start_s: float
    end_s: float
    to: ArmPose
    label: str | None = None


HANGING = ArmPose(-10.0, -80.0, 0.525, 0.5, 0.0, 1.0, -28.0, 5.0, 0.0)
_LEFT = ArmPose(-64.0, -13.0, 0.46, 0.35, 1.0, 0.25, 20.0, -8.0, -6.0)
_RIGHT = ArmPose(36.0, -15.0, 0.42, 0.9, 1.0, 0.0, 10.0, 12.0, 9.0)
_UP = ArmPose(-14.0, 22.0, 0.32, 0.75, 1.0, 0.0, 45.0, -10.0, -3.0)
_DOWN = ArmPose(-4.0, -44.0, 0.50, 0.8, 0.5, 0.6, 60.0, 18.0, 5.0)
_LEFT_AGAIN = ArmPose(-58.0, -18.0, 0.47, 0.35, 1.0, 0.25, 24.0, -8.0, -5.0)
_RIGHT_AGAIN = ArmPose(38.0, -18.0, 0.43, 0.9, 1.0, 0.0, 10.0, 12.0, 8.0)
_UP_AGAIN = ArmPose(-10.0, 17.0, 0.33, 0.75, 1.0, 0.0, 42.0, -8.0, -3.0)
_DOWN_AGAIN = ArmPose(-8.0, -47.0, 0.50, 0.8, 0.5, 0.6, 62.0, 20.0, 4.0)

_MOVES = (
    Move(0.3, 1.35, _LEFT),
    Move(1.6, 2.8, _RIGHT, "left-to-right"),
    Move(3.05, 4.25, _LEFT, "right-to-left"),
    Move(4.45, 5.2, _UP),
    Move(5.45, 6.45, _DOWN, "up-to-down"),
    Move(6.7, 7.7, _UP, "down-to-up"),
    Move(7.95, 8.9, _DOWN_AGAIN, "up-to-down"),
    Move(9.15, 10.15, _UP_AGAIN, "down-to-up"),
    Move(10.35, 11.1, _LEFT_AGAIN),
    Move(11.35, 12.5, _RIGHT_AGAIN, "left-to-right"),
    Move(12.75, 13.9, _LEFT_AGAIN, "right-to-left"),
    Move(14.0, 14.95, HANGING),
)

SPANS = tuple(
    GestureSpan(move.start_s, move.end_s, move.label) for move in _MOVES if move.label is not None
)
"""The strokes themselves; raising, holding and lowering the hand belong to no gesture."""


def minimum_jerk(phase: ArrayLike) -> Floats:
    """Share of the way at a share of the time, held at 0 and 1 outside."""
    x = np.clip(np.asarray(phase, dtype=np.float64), 0.0, 1.0)
    return x * x * x * (10.0 + x * (6.0 * x - 15.0))


def swipes(skeleton: Skeleton, times_s: ArrayLike) -> Motion:
    """Motion of the whole body at any times, smooth in time.

    Before 0.3 s and after 14.95 s the arm hangs.
    """
    times = np.asarray(times_s, dtype=np.float64)
    arm = arm_poses(_MOVES, times)  # (T, parameters)
    rotations = np.tile(np.eye(3), (len(times), len(skeleton), 1, 1))
    turn_torso(skeleton, rotations, times, arm[:, 8])
    relax_fingers(skeleton, rotations)
    reach(skeleton, rotations, "R", arm)
    hanging = np.tile(np.array(astuple(HANGING)), (len(times), 1))
    hanging[:, 0] += 1.2 * np.sin(0.9 * times)
    reach(skeleton, rotations, "L", hanging)
    return Motion(rotations, np.zeros((len(times), 3)))


def arm_poses(moves: Sequence[Move], times: Floats) -> Floats:
    """Parameters of the arm through time: hanging, plus every move so far.

    The moves follow one another. Columns of the result are the fields of :class:`ArmPose`.
    """
    before = np.array(astuple(HANGING))
    poses = np.tile(before, (len(times), 1))
    for move in moves:
        after = np.array(astuple(move.to))
        share = minimum_jerk((times - move.start_s) / (move.end_s - move.start_s))
        poses += share[:, None] * (after - before)
        before = after
    return poses


def turn_torso(skeleton: Skeleton, rotations: Floats, times: Floats, across_deg: Floats) -> None:
    """Sway, breathing and what the torso does for the arm; the head stays on the camera."""
    index = skeleton.index
    # Degrees and Hz: quiet breaths, 16 a minute, and a slow sway of no common period.
    breath = np.sin(2.0 * np.pi * 0.27 * times)
    yaw = -across_deg + 0.5 * np.sin(2.0 * np.pi * 0.13 * times + 0.4)
    roll = 0.5 * np.sin(2.0 * np.pi * 0.17 * times)
    pitch = 0.35 * np.sin(2.0 * np.pi * 0.11 * times + 1.0)
    x, y, z = np.eye(3)
    rotations[:, index["spine04"]] = product(about(y, 0.4 * yaw), about(z, roll))
    rotations[:, index["spine03"]] = product(about(y, 0.6 * yaw), about(x, 0.45 * breath + pitch))
    rotations[:, index["spine01"]] = about(x, -0.45 * breath)
    rotations[:, index["clavicle.R"]] = about(z, 0.8 * breath + 0.8)
    rotations[:, index["clavicle.L"]] = about(z, -0.8 * breath - 0.8)
    rotations[:, index["neck01"]] = about(y, -0.4 * yaw)
    rotations[:, index["head"]] = product(about(y, -0.45 * yaw), about(x, 5.0 - pitch))


def relax_fingers(skeleton: Skeleton, rotations: Floats) -> None:
    """Curl the fingers a little, each about the line of the knuckles."""
    index = skeleton.index
    for side in "LR":
        knuckles = (
            skeleton.heads_m[index[f"finger5-1.{side}"]]
            - skeleton.heads_m[index[f"finger2-1.{side}"]]
        )
        axis = knuckles / np.linalg.norm(knuckles) * (1.0 if side == "R" else -1.0)
        for finger in range(2, 6):
            for joint, angle_deg in ((1, 6.0), (2, 14.0), (3, 10.0)):
                rotations[:, index[f"finger{finger}-{joint}.{side}"]] = about(
                    axis, np.array([angle_deg])
                )


def reach(
    skeleton: Skeleton, rotations: Floats, side: str, arm: Floats, scale: float = 1.0
) -> None:
    """Bring one wrist to its place: shoulder, elbow and wrist rotations in closed form.

    ``rotations``, (T, B, 3, 3), are those of the whole body, which faces the camera; those of the
    arm are replaced. ``arm`` comes from :func:`arm_poses`; ``scale`` is the length of this arm to
    that for which the poses were written.
    """
    index, heads = skeleton.index, skeleton.heads_m
    upper, lower = index[f"upperarm01.{side}"], index[f"lowerarm01.{side}"]
    forearm, wrist = index[f"lowerarm02.{side}"], index[f"wrist.{side}"]
    across = 1.0 if side == "R" else -1.0
    above = skeleton.transforms(rotations)[:, index[f"shoulder01.{side}"]]  # (T, 3, 4)
    shoulder = applied(above[..., :3], heads[upper]) + above[..., 3]
    azimuth, elevation = np.radians(arm[:, 0]), np.radians(arm[:, 1])
    towards = np.stack(
        [
            across * np.sin(azimuth) * np.cos(elevation),
            -np.sin(elevation),
            -np.cos(azimuth) * np.cos(elevation),
        ],
        axis=1,
    )
    pole = arm[:, 3:6] * np.array([-across, 1.0, 1.0])
    upper_rest, lower_rest = heads[lower] - heads[upper], heads[wrist] - heads[lower]
    target = shoulder + scale * arm[:, 2:3] * towards
    upper_turn, lower_turn = bend(shoulder, target, upper_rest, lower_rest, pole)
    rotations[:, upper] = product(transposed(above[..., :3]), upper_turn)
    rotations[:, lower] = product(transposed(upper_turn), lower_turn)
    # The forearm's two bones share the turn of the hand, as radius and ulna do.
    along = heads[wrist] - heads[forearm]
    along = along / np.linalg.norm(along)
    half = about(along, -across * 0.5 * arm[:, 6])
    rotations[:, forearm] = half
    knuckles = heads[index[f"finger5-1.{side}"]] - heads[index[f"finger2-1.{side}"]]
    flexion = about(across * knuckles / np.linalg.norm(knuckles), arm[:, 7])
    rotations[:, wrist] = product(half, flexion)


def arm_length_m(skeleton: Skeleton) -> float:
    """From shoulder over elbow to wrist, by the bones at rest."""
    heads, index = skeleton.heads_m, skeleton.index
    shoulder, elbow, wrist = (
        heads[index[f"{bone}.R"]] for bone in ("upperarm01", "lowerarm01", "wrist")
    )
    return float(np.linalg.norm(elbow - shoulder) + np.linalg.norm(wrist - elbow))


def bend(
    start: Floats, end: Floats, upper_rest: Floats, lower_rest: Floats, pole: Floats
) -> tuple[Floats, Floats]:
    """Turn the two bones of a limb so that it reaches from one place to another.

    ``start`` and ``end`` are (T, 3); ``upper_rest`` and ``lower_rest``, (3,), are the two bones at
    rest, which is not straight; ``pole`` is as for :func:`elbow_position`. Returns whole rotations
    of the two bones from rest, (T, 3, 3).
    """
    elbow = elbow_position(
        start, end, float(np.linalg.norm(upper_rest)), float(np.linalg.norm(lower_rest)), pole
    )
    hinge = np.cross(elbow - start, end - elbow)
    rest_hinge = np.cross(upper_rest, lower_rest)[None]
    upper_turn = product(
        frame(elbow - start, hinge), transposed(frame(upper_rest[None], rest_hinge))
    )
    lower_turn = product(frame(end - elbow, hinge), transposed(frame(lower_rest[None], rest_hinge)))
    return upper_turn, lower_turn


def elbow_position(
    shoulder: Floats, wrist: Floats, upper_m: float, lower_m: float, pole: Floats
) -> Floats:
    """Elbow of an arm with two bones of known lengths, bent towards a pole, (T, 3).

    Shoulder and wrist are further apart than ``|upper_m - lower_m|`` and nearer than their sum; the
    pole, (T, 3), is not along the line between them.
    """
    line = wrist - shoulder
    distance = np.linalg.norm(line, axis=1, keepdims=True)
    line = line / distance
    along = (distance**2 + upper_m**2 - lower_m**2) / (2.0 * distance)
    aside = pole - (pole * line).sum(axis=1, keepdims=True) * line
    aside = aside / np.linalg.norm(aside, axis=1, keepdims=True)
    elbow: Floats = shoulder + along * line + np.sqrt(upper_m**2 - along**2) * aside
    return elbow
