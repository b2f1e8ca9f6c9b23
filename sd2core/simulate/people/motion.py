"""Random motion of a whole body: torso, head, arms and legs together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sd2core.body.model import Skeleton
from sd2core.body.rotations import Floats, applied, product, transposed
from sd2core.simulate.limbs import Motion, place_limb, turn_about, turn_hand
from sd2core.simulate.people.arms import ArmStyle, moving_arm, still_arm
from sd2core.simulate.people.signals import wander
from sd2core.simulate.people.walking import Footwork, Mode, footwork

_SPINE = ("spine05", "spine04", "spine03", "spine02", "spine01")
_NECK = ("neck01", "neck02", "neck03", "head")
_FASTEST_MPS = {"lowerarm01": 4.5, "wrist": 6.5, "foot": 6.0}


@dataclass(frozen=True)
class Deed:
    """Action of a person in one take."""

    legs: Mode
    arms: tuple[ArmStyle, ArmStyle]  # Left and right.
    still: bool  # True for nothing but breath and sway.
    # True for elbows and trunk as people have them, not in any possible position.
    natural: bool = False
    elbows_rest: bool = False  # True if forearms often turn about elbows that stay.
    calm: bool = False  # True if the trunk does little of its own.


def random_motion(
    rng: np.random.Generator, skeleton: Skeleton, stature_m: float, times_s: Floats, deed: Deed
) -> Motion:
    """Motion of one take, its middle near the origin of the floor, facing -z.

    Drawn again where it would be too fast for anybody: near a straight arm the side
    to which the elbow bends may jump.

    Parameters
    ----------
    rng : Generator
    skeleton : Skeleton
    stature_m : float
        Of the person with this skeleton.
    times_s : float64 array, shape (T,)
    deed : Deed
    """
    while True:
        motion = _drawn(rng, skeleton, stature_m, times_s, deed)
        transforms = skeleton.transforms(*motion)
        if all(
            _speed(skeleton, transforms, times_s, bone).max() < fastest
            for bone, fastest in _FASTEST_MPS.items()
        ):
            return motion


def _speed(skeleton: Skeleton, transforms: Floats, times_s: Floats, bone: str) -> Floats:
    """Speeds of the heads of a bone on both sides, (2, T - 1), metres per second."""
    rows = [skeleton.index[f"{bone}.{side}"] for side in "LR"]
    moved = transforms[:, rows]
    places = applied(moved[..., :3], skeleton.heads_m[rows]) + moved[..., 3]
    steps = np.diff(places, axis=0) / np.diff(times_s)[:, None, None]
    return np.asarray(np.linalg.norm(steps, axis=2).T)


def _drawn(
    rng: np.random.Generator, skeleton: Skeleton, stature_m: float, times_s: Floats, deed: Deed
) -> Motion:
    count = len(times_s)
    feet = footwork(rng, times_s, deed.legs, still=deed.still)
    arms = [
        still_arm(rng, times_s)
        if deed.still
        else moving_arm(rng, times_s, style, natural=deed.natural, elbows_rest=deed.elbows_rest)
        for style in deed.arms
    ]
    if deed.arms[0] == deed.arms[1] and rng.random() < 0.5:
        arms[1] = arms[0].copy()  # both hands the same, mirrored
    if deed.legs == "walk" and rng.random() < 0.6:
        for arm, back in zip(arms, (-1.0, 1.0), strict=True):
            arm[:, 2] += rng.uniform(0.05, 0.35) * back * feet.stride
    rotations = np.tile(np.eye(3), (count, len(skeleton), 1, 1))
    liveliness = 0.05 if deed.still else rng.uniform(*((0.05, 0.4) if deed.calm else (0.2, 1.0)))
    lean_deg = (1.5, 3.0) if deed.natural else (4.0, 7.0)
    _turn_trunk(rng, skeleton, rotations, times_s, arms, liveliness, lean_deg)
    translation = _stand(skeleton, rotations, stature_m, feet)
    _step(skeleton, rotations, stature_m, feet, translation)
    for side, arm in zip("LR", arms, strict=True):
        _reach(skeleton, rotations, side, arm)
    return Motion(rotations, translation)


def _turn_trunk(
    rng: np.random.Generator,
    skeleton: Skeleton,
    rotations: Floats,
    times_s: Floats,
    arms: list[Floats],
    liveliness: float,
    lean_deg: tuple[float, float],
) -> None:
    """Lean, twist and breathe; shoulders and trunk go some way with the arms."""
    index = skeleton.index
    lean = rng.normal(0.0, [6.0, 7.0, 3.0])
    lean[0] = rng.normal(*lean_deg)
    slow = wander(rng, times_s, rng.uniform(0.2, 0.9), 3) * rng.uniform(0.5, 7.0, 3)
    angles = lean + liveliness * slow  # (T, 3): forwards, twist, aside
    follow_arms = rng.uniform(-5.0, 22.0) * (liveliness > 0.1)
    ahead = arms[0][:, 2] - arms[1][:, 2]
    angles[:, 1] += follow_arms * (ahead - ahead.mean())
    angles[:, 0] += rng.uniform(0.0, 6.0) * (arms[0][:, 2] + arms[1][:, 2] - 0.8)
    breath = rng.uniform(0.2, 0.7) * np.sin(
        2.0 * np.pi * (rng.uniform(0.2, 0.35) * times_s + rng.random())
    )
    shares = rng.dirichlet(np.full(len(_SPINE), 4.0))
    for bone, share in zip(_SPINE, shares, strict=True):
        turn = product(turn_about(1, share * angles[:, 1]), turn_about(0, share * angles[:, 0]))
        rotations[:, index[bone]] = product(turn, turn_about(2, share * angles[:, 2]))
    rotations[:, index["spine02"]] = product(rotations[:, index["spine02"]], turn_about(0, -breath))
    gaze = (
        liveliness
        * wander(rng, times_s, rng.uniform(0.3, 1.2), 3)
        * rng.uniform(0.0, [12.0, 28.0, 8.0])
    )
    gaze += rng.normal([6.0, 0.0, 0.0], [8.0, 14.0, 4.0])
    gaze[:, 1] -= rng.uniform(0.0, 1.0) * angles[:, 1]
    for bone in _NECK:
        turn = product(turn_about(1, gaze[:, 1] / 4), turn_about(0, gaze[:, 0] / 4))
        rotations[:, index[bone]] = product(turn, turn_about(2, gaze[:, 2] / 4))
    shrug = liveliness * rng.uniform(0.0, 4.0) * wander(rng, times_s, 0.7, 2)
    for number, (side, sign) in enumerate((("L", 1.0), ("R", -1.0))):
        up = -14.0 * np.minimum(arms[number][:, 1], 0.0) * rng.uniform(0.4, 1.4)
        up = up + shrug[:, number] + breath + rng.normal(0.0, 2.0)
        forward = 8.0 * rng.uniform(0.0, 1.5) * (arms[number][:, 2] - 0.3) + rng.normal(0.0, 3.0)
        rotations[:, index[f"clavicle.{side}"]] = product(
            turn_about(2, -sign * up), turn_about(1, sign * forward)
        )


def _stand(skeleton: Skeleton, rotations: Floats, stature_m: float, feet: Footwork) -> Floats:
    """Turn the root and put it over the feet; returns the translation."""
    rotations[:, 0] = turn_about(1, feet.heading_deg)
    translation = np.empty((len(rotations), 3))
    translation[:, 0] = stature_m * feet.place[:, 0]
    translation[:, 1] = stature_m * feet.sink
    translation[:, 2] = stature_m * feet.place[:, 1]
    return translation


def _step(
    skeleton: Skeleton, rotations: Floats, stature_m: float, feet: Footwork, translation: Floats
) -> None:
    """Bring the feet to their places; the translation is lowered where they are out of reach."""
    heads, index = skeleton.heads_m, skeleton.index
    forward = turn_about(1, feet.heading_deg) @ np.array([0.0, 0.0, -1.0])
    legs, targets = [], []
    for number, side in enumerate("LR"):
        ankle = heads[index[f"foot.{side}"]]
        target = np.empty((len(rotations), 3))
        target[:, 0] = stature_m * feet.feet[:, number, 0]
        target[:, 1] = ankle[1] - stature_m * feet.feet[:, number, 2]
        target[:, 2] = stature_m * feet.feet[:, number, 1] + heads[0][2]
        targets.append(target)
        hip = heads[index[f"upperleg01.{side}"]]
        legs.append((f"upperleg01.{side}", f"lowerleg01.{side}", f"foot.{side}"))
        longest = 0.99 * skeleton.length_m(*legs[-1])
        over = target - (hip + translation)
        level = np.minimum(np.hypot(over[:, 0], over[:, 2]), 0.9 * longest)
        high = np.sqrt(longest**2 - level**2)
        translation[:, 1] = np.maximum(translation[:, 1], target[:, 1] - hip[1] - high)
    transforms = skeleton.transforms(rotations, translation)
    for number, side in enumerate("LR"):
        out = np.array([0.15 if side == "L" else -0.15, 0.0, 0.0])
        turn = place_limb(
            skeleton,
            rotations,
            legs[number],
            transforms[:, index[f"pelvis.{side}"]],
            targets[number],
            forward + turn_about(1, feet.heading_deg) @ out,
        )
        foot = product(
            turn_about(1, feet.feet_heading_deg[:, number]),
            turn_about(0, 600.0 * feet.feet[:, number, 2]),
        )
        rotations[:, index[legs[number][-1]]] = product(transposed(turn), foot)


def _reach(skeleton: Skeleton, rotations: Floats, side: str, arm: Floats) -> None:
    """Bring one wrist to its place, outside the trunk."""
    index, heads = skeleton.index, skeleton.heads_m
    bones = (f"upperarm01.{side}", f"lowerarm01.{side}", f"wrist.{side}")
    length = skeleton.length_m(*bones)
    out = 1.0 if side == "L" else -1.0
    chest = skeleton.transforms(rotations)
    shoulder = index[f"shoulder01.{side}"]
    turn = chest[:, index["spine01"], :, :3]
    axes = np.array([out, 1.0, -1.0])
    start = applied(chest[:, shoulder, :, :3], heads[index[bones[0]]]) + chest[:, shoulder, :, 3]
    wanted = heads[index[bones[0]]] + length * arm[:, :3] * axes
    wanted = _outside_trunk(skeleton, wanted) - heads[index[bones[0]]]
    target = start + applied(turn, wanted)
    pole = applied(turn, arm[:, 3:6] * np.array([out, 1.0, 1.0]))
    place_limb(skeleton, rotations, bones, chest[:, shoulder], target, pole)
    turn_hand(skeleton, rotations, side, arm[:, 6:9], arm[:, 9:11])


def _outside_trunk(skeleton: Skeleton, points: Floats) -> Floats:
    """Wrists at rest axes, pushed out of an upright elliptic column around the trunk."""
    heads, index = skeleton.heads_m, skeleton.index
    shoulder = heads[index["upperarm01.L"]]
    middle = heads[index["spine02"]]
    wide, deep = 1.0 * shoulder[0] + 0.02, 0.85 * shoulder[0] + 0.03
    x, z = points[:, 0] / wide, (points[:, 2] - middle[2]) / deep
    radius = np.sqrt(x**2 + z**2 + 1e-6)
    below_chin = 0.5 + 0.5 * np.tanh((points[:, 1] - shoulder[1] + 0.08) / 0.08)
    # A soft maximum with 1: no kink where the wrist touches the column.
    wanted = 0.5 * (radius + 1.0 + np.sqrt((radius - 1.0) ** 2 + 0.02))
    push = 1.0 + below_chin * (wanted / radius - 1.0)
    pushed = points.copy()
    pushed[:, 0] *= push
    # Rather to the front than to the back.
    pushed[:, 2] = middle[2] + deep * (z * push) - below_chin * deep * 0.3 * np.exp(-(radius**2))
    return pushed
