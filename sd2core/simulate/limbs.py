"""Limbs of a standing body brought to places, by inverse kinematics in closed form.

An arm is posed by the place of its wrist around the shoulder; torso and head go along a
little, and the chest breathes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from sd2core.body.model import Skeleton
from sd2core.body.rotations import Floats, about, applied, frame, product, transposed

_KNEES_REACH = 0.995


class Motion(NamedTuple):
    """Rotations (T, B, 3, 3) and translation (T, 3) for :meth:`Skeleton.transforms`."""

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


HANGING = ArmPose(-10.0, -80.0, 0.525, 0.5, 0.0, 1.0, -28.0, 5.0, 0.0)


def minimum_jerk(phase: ArrayLike) -> Floats:
    """Share of the way at a share of the time, held at 0 and 1 outside."""
    x = np.clip(np.asarray(phase, dtype=np.float64), 0.0, 1.0)
    return x * x * x * (10.0 + x * (6.0 * x - 15.0))


def turn_torso(skeleton: Skeleton, rotations: Floats, times: Floats, across_deg: Floats) -> None:
    """Sway, breathing and what the torso does for the arm; the head stays on the camera.

    Parameters
    ----------
    skeleton : Skeleton
    rotations : float64 array, shape (T, B, 3, 3)
        Those of spine, collar bones, neck and head are written.
    times : float64 array, shape (T,)
        Seconds.
    across_deg : float64 array, shape (T,)
        Turn of the upper body; positive: its right side comes forward.
    """
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
        axis = _knuckles(skeleton, side)
        for finger in range(2, 6):
            for joint, angle_deg in ((1, 6.0), (2, 14.0), (3, 10.0)):
                rotations[:, index[f"finger{finger}-{joint}.{side}"]] = about(
                    axis, np.array([angle_deg])
                )


def reach(
    skeleton: Skeleton, rotations: Floats, side: str, arm: Floats, scale: float = 1.0
) -> None:
    """Bring one wrist to its place: shoulder, elbow and wrist rotations in closed form.

    Parameters
    ----------
    skeleton : Skeleton
    rotations : float64 array, shape (T, B, 3, 3)
        Of the whole body, which faces the camera; those of the arm are replaced.
    side : {"L", "R"}
    arm : float64 array, shape (T, 9)
        The fields of :class:`ArmPose`.
    scale : float
        Length of this arm to that for which the poses were written.
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
    half = about(_unit(heads[wrist] - heads[forearm]), -across * 0.5 * arm[:, 6])
    rotations[:, forearm] = half
    rotations[:, wrist] = product(half, about(_knuckles(skeleton, side), arm[:, 7]))


def arm_length_m(skeleton: Skeleton) -> float:
    """From shoulder over elbow to wrist, by the bones at rest."""
    return skeleton.length_m("upperarm01.R", "lowerarm01.R", "wrist.R")


def bend(
    start: Floats, end: Floats, upper_rest: Floats, lower_rest: Floats, pole: Floats
) -> tuple[Floats, Floats]:
    """Turn the two bones of a limb so that it reaches from one place to another.

    Parameters
    ----------
    start, end : float64 array, shape (T, 3)
    upper_rest, lower_rest : float64 array, shape (3,)
        The two bones at rest, which is not straight.
    pole : float64 array, shape (T, 3)
        As for :func:`elbow_position`.

    Returns
    -------
    upper_turn, lower_turn : float64 array, shape (T, 3, 3)
        Whole rotations of the two bones from rest.
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

    Parameters
    ----------
    shoulder, wrist : float64 array, shape (T, 3)
        Further apart than ``|upper_m - lower_m|`` and nearer than their sum.
    upper_m, lower_m : float
        Lengths of upper arm and forearm.
    pole : float64 array, shape (T, 3)
        Direction in which the elbow bends; not along the line between shoulder and wrist.
    """
    line = wrist - shoulder
    distance = np.linalg.norm(line, axis=1, keepdims=True)
    line = line / distance
    along = (distance**2 + upper_m**2 - lower_m**2) / (2.0 * distance)
    aside = pole - (pole * line).sum(axis=1, keepdims=True) * line
    aside = aside / np.linalg.norm(aside, axis=1, keepdims=True)
    return shoulder + along * line + np.sqrt(upper_m**2 - along**2) * aside


def turn_about(axis: int, angle_deg: Floats) -> Floats:
    """Rotations about x (0), y (1) or z (2), (T, 3, 3)."""
    return about(np.eye(3)[axis], angle_deg)


def place_limb(
    skeleton: Skeleton,
    rotations: Floats,
    bones: tuple[str, str, str],
    root: Floats,
    target_m: Floats,
    pole: Floats,
    stretch: float = _KNEES_REACH,
) -> Floats:
    """Bring the end of a limb of two bones to a place.

    Parameters
    ----------
    skeleton : Skeleton
    rotations : float64 array, shape (T, B, 3, 3)
        Those of the first two bones are written.
    bones : (str, str, str)
        Thigh, shank, foot; or upper arm, forearm, wrist.
    root : float64 array, shape (T, 3, 4)
        Transform of the parent of the limb.
    target_m : float64 array, shape (T, 3)
        Brought nearer where it is out of reach.
    pole : float64 array, shape (T, 3)
        Direction in which the joint bends.
    stretch : float
        Reach as a share of the limb's length.

    Returns
    -------
    float64 array, shape (T, 3, 3)
        Turn of the second bone against rest, in the axes of ``target_m``.
    """
    first, second, end = (skeleton.index[bone] for bone in bones)
    heads = skeleton.heads_m
    upper_rest, lower_rest = heads[second] - heads[first], heads[end] - heads[second]
    upper, lower = float(np.linalg.norm(upper_rest)), float(np.linalg.norm(lower_rest))
    start = applied(root[..., :3], heads[first]) + root[..., 3]
    line = target_m - start
    far = np.linalg.norm(line, axis=1, keepdims=True)
    reach = np.clip(far, 1.05 * abs(upper - lower) + 0.02, stretch * (upper + lower))
    target = start + line * (reach / far)
    upper_turn, lower_turn = bend(start, target, upper_rest, lower_rest, pole)
    rotations[:, first] = product(transposed(root[..., :3]), upper_turn)
    # The thigh's two bones turn as one: what lies between them is the identity.
    rotations[:, second] = product(transposed(upper_turn), lower_turn)
    return lower_turn


def turn_hand(
    skeleton: Skeleton, rotations: Floats, side: str, angles_deg: Floats, curl: Floats
) -> None:
    """Turn, bend and close one hand.

    Parameters
    ----------
    skeleton : Skeleton
    rotations : float64 array, shape (T, B, 3, 3)
        Those of forearm, wrist and fingers are written.
    side : {"L", "R"}
    angles_deg : float64 array, shape (T, 3)
        Pronation, flexion, deviation.
    curl : float64 array, shape (T, 2)
        Of fingers and thumb, 0 open to 1 closed.
    """
    index, heads = skeleton.index, skeleton.heads_m
    across = 1.0 if side == "R" else -1.0
    forearm, wrist = index[f"lowerarm02.{side}"], index[f"wrist.{side}"]
    along = _unit(heads[wrist] - heads[forearm])
    knuckles = _knuckles(skeleton, side)
    half = about(along, -across * 0.5 * angles_deg[:, 0])
    rotations[:, forearm] = half
    palm = _unit(np.cross(along, knuckles))
    bend = product(about(knuckles, angles_deg[:, 1]), about(palm, angles_deg[:, 2]))
    rotations[:, wrist] = product(half, bend)
    curl = np.clip(curl, 0.0, 1.0)
    for finger in range(1, 6):
        amount = curl[:, 0] if finger > 1 else 0.5 * curl[:, 1]
        for joint, most_deg in ((1, 70.0), (2, 85.0), (3, 55.0)):
            bone = index.get(f"finger{finger}-{joint}.{side}")
            if bone is not None:
                rotations[:, bone] = about(knuckles, 4.0 + most_deg * amount)


def _knuckles(skeleton: Skeleton, side: str) -> Floats:
    """Axis about which fingers and hand bend, (3,): the line of the knuckles."""
    index, heads = skeleton.index, skeleton.heads_m
    line = _unit(heads[index[f"finger5-1.{side}"]] - heads[index[f"finger2-1.{side}"]])
    return line if side == "R" else -line


def _unit(vector: Floats) -> Floats:
    return np.asarray(vector / np.linalg.norm(vector))
