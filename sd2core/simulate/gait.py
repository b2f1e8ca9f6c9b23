"""Walking and turning: feet that stay where they stand, legs that reach them.

Footholds are planned first, where the body will be in the middle of each stance;
pelvis and legs follow, by the same closed form as the arm. So no foot slides, whatever
the path. The numbers (cadence, double support, pelvis, swing of the arms) are those of
an unhurried adult gait (J. Perry and J. M. Burnfield, "Gait Analysis", 2nd ed., 2010),
rounded.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import astuple
from typing import NamedTuple

import numpy as np

from sd2core.body.model import Skeleton
from sd2core.body.rotations import Floats, about, applied, product, transposed
from sd2core.simulate.limbs import (
    HANGING,
    Motion,
    minimum_jerk,
    place_limb,
    reach,
    relax_fingers,
    turn_torso,
)

_STEP_S = 0.54
_SWING_S = 0.41
_HALF_BASE = 0.080
"""Half the distance of the ankles, as a share of the length of a leg."""
_LIFT = 0.075
_STRETCH = 0.992
"""A leg reaches no further than this share of its length: knees do not lock."""
_TOE_OFF_DEG = 32.0
_STRIKE_DEG = 14.0
_ARM_SWING_DEG = 20.0
GRID_HZ = 240.0
"""Frame rates divide it."""
_DOWN = np.array([0.0, 1.0, 0.0])
_ACROSS = np.array([1.0, 0.0, 0.0])


class Path(NamedTuple):
    """Path of the body's middle over the floor, at any times; both map (T,) to (T,)."""

    forward_m: Callable[[Floats], Floats]  # Towards the camera.
    yaw_deg: Callable[[Floats], Floats]  # From facing the camera, about the axis that points down.


class Step(NamedTuple):
    """One foot's way from one foothold to the next."""

    side: int
    start_s: float
    end_s: float
    place_m: Floats  # (2,): across, forward
    yaw_deg: float


def plan_steps(path: Path, duration_s: float, half_base_m: float) -> list[Step]:
    """Steps, left and right in turn, wherever standing still would leave a foot behind."""
    steps: list[Step] = []
    footholds = [_foothold(path, 0.0, side, half_base_m) for side in (0, 1)]
    start_s, side = 0.0, 0
    while start_s < duration_s:
        # A foot stands from its landing until it is lifted again: two steps later.
        middle_s = start_s + _SWING_S + 0.5 * (2 * _STEP_S - _SWING_S)
        place, yaw = _foothold(path, middle_s, side, half_base_m)
        before, yaw_before = footholds[side]
        if np.hypot(*(place - before)) > 0.015 or abs(yaw - yaw_before) > 3.0:
            steps.append(Step(side, start_s, start_s + _SWING_S, place, yaw))
            footholds[side] = (place, yaw)
            start_s += _STEP_S
        else:
            # Whatever foot has to go first may go at any time.
            start_s += _STEP_S if steps and steps[-1].end_s > start_s - _STEP_S else 0.02
        side = 1 - side
    return steps


def gait(skeleton: Skeleton, times_s: Floats, path: Path, arm_scale: float = 1.0) -> Motion:
    """Motion of the whole body along a path.

    The translation moves the body from the origin; its floor is at y = 0.

    Parameters
    ----------
    skeleton : Skeleton
    times_s : float64 array, shape (T,)
        Multiples of 1 / :data:`GRID_HZ`, from 0 on.
    path : Path
    arm_scale : float
        As the scale of :func:`sd2core.simulate.limbs.reach`.

    Raises
    ------
    ValueError
        For other times.
    """
    duration_s = float(times_s[-1]) + 1.0
    fine = np.arange(0.0, duration_s, 1.0 / GRID_HZ)
    rotations = np.tile(np.eye(3), (len(fine), len(skeleton), 1, 1))
    leg_m = skeleton.length_m("upperleg01.L", "lowerleg01.L", "foot.L")
    steps = plan_steps(path, float(times_s[-1]), _HALF_BASE * leg_m)
    feet = [_foot(skeleton, fine, steps, path, side, leg_m) for side in (0, 1)]
    pace = _smoothed(np.abs(np.gradient(path.forward_m(fine), fine)), 0.15)
    # +1 while the left foot is ahead, -1 while the right one is.
    lead = _smoothed(np.clip((feet[0].ahead_m - feet[1].ahead_m) / 0.5, -1.0, 1.0), 0.05)
    yaw_deg = path.yaw_deg(fine)
    _turn_trunk(skeleton, rotations, fine, yaw_deg, lead, pace)
    translation = _pelvis_way(skeleton, rotations, feet, path.forward_m(fine), lead, leg_m)
    for side, foot in enumerate(feet):
        _stand(skeleton, rotations, translation, "LR"[side], foot, yaw_deg)
    # Arms are posed on a body that faces the camera, and turn with the trunk.
    _swing_arms(skeleton, rotations, lead, pace, arm_scale)
    rows = np.clip(np.rint(np.asarray(times_s) * GRID_HZ).astype(int), 0, len(fine) - 1)
    if np.allclose(rows / GRID_HZ, times_s, atol=1e-9):
        return Motion(rotations[rows], translation[rows])
    raise ValueError(f"times must be multiples of 1/{GRID_HZ:g} s")


class _Foot(NamedTuple):
    ankle_m: Floats  # (T, 3) in the body's world: floor at y = 0
    turn: Floats  # (T, 3, 3)
    pitch_deg: Floats  # (T,) positive: heel up
    ahead_m: Floats  # (T,) before the body's middle


def _foothold(path: Path, time_s: float, side: int, half_base_m: float) -> tuple[Floats, float]:
    at = np.array([time_s])
    yaw_deg = float(path.yaw_deg(at)[0])
    across = (1.0 if side == 0 else -1.0) * half_base_m * _heading(yaw_deg)[0]
    return across + np.array([0.0, float(path.forward_m(at)[0])]), yaw_deg


def _heading(yaw_deg: float) -> Floats:
    """The body's left and its front on the floor, (2, 2) in (across, forward)."""
    c, s = np.cos(np.radians(yaw_deg)), np.sin(np.radians(yaw_deg))
    return np.array([[c, s], [-s, c]])


def _foot(
    skeleton: Skeleton, times: Floats, steps: list[Step], path: Path, side: int, leg_m: float
) -> _Foot:
    """One foot through time: flat while it stands, rolled off and set down around a swing."""
    index, heads = skeleton.index, skeleton.heads_m
    ankle_rest = heads[index[f"foot.{'LR'[side]}"]]
    toe = heads[index[f"toe3-1.{'LR'[side]}"]]
    ball = np.array([toe[0], 0.0, toe[2]]) - [ankle_rest[0], 0.0, ankle_rest[2]]
    heel = np.array([0.0, 0.0, 0.055 * leg_m / 0.9])
    place, yaw = _foothold(path, 0.0, side, _HALF_BASE * leg_m)
    places, yaws = np.tile(place, (len(times), 1)), np.full(len(times), yaw)
    height, pitch = np.zeros(len(times)), np.zeros(len(times))
    for step in steps:
        if step.side != side:
            continue
        phase = (times - step.start_s) / (step.end_s - step.start_s)
        share = minimum_jerk(phase)
        length = float(np.hypot(*(step.place_m - place)))
        vigour = min(length / 0.9, 1.0)
        places += share[:, None] * (step.place_m - place)
        yaws += share * (step.yaw_deg - yaw)
        x = np.clip(phase, 0.0, 1.0)
        height += (0.4 + 0.6 * vigour) * _LIFT * leg_m * 64.0 * (x * (1.0 - x)) ** 3
        # Heel up before the swing, toes up at its end, flat soon after.
        up = minimum_jerk((phase + 0.75) / 0.8) - minimum_jerk((phase - 0.05) / 0.6)
        toes = minimum_jerk((phase - 0.55) / 0.4) - minimum_jerk((phase - 0.95) / 0.3)
        pitch += vigour * (_TOE_OFF_DEG * up - _STRIKE_DEG * toes)
        place, yaw = step.place_m, step.yaw_deg
    turn = product(about(_DOWN, yaws), about(_ACROSS, pitch))
    pivot = np.where(pitch[:, None] > 0, ball, heel)
    from_ankle = pivot - np.array([0.0, ankle_rest[1], 0.0])
    flat = applied(about(_DOWN, yaws), np.broadcast_to(pivot, (len(times), 3)))
    ankle = flat - applied(turn, from_ankle)
    ankle += np.stack([places[:, 0], -height, -places[:, 1]], axis=1)
    ahead = places[:, 1] - path.forward_m(times)
    return _Foot(ankle, turn, pitch, ahead)


def _turn_trunk(
    skeleton: Skeleton,
    rotations: Floats,
    times: Floats,
    yaw_deg: Floats,
    lead: Floats,
    pace: Floats,
) -> None:
    index = skeleton.index
    turn_torso(skeleton, rotations, times, np.zeros(len(times)))
    pelvis = yaw_deg - 4.5 * lead * np.clip(pace, 0.0, 1.0)
    rotations[:, 0] = product(about(_DOWN, pelvis), about(_ACROSS, 2.0 * np.clip(pace, 0.0, 1.0)))
    against = 9.0 * lead * np.clip(pace, 0.0, 1.0)
    for bone, share in (("spine04", 0.4), ("spine03", 0.6), ("neck01", -0.5)):
        rotations[:, index[bone]] = product(
            about(_DOWN, share * against), rotations[:, index[bone]]
        )
    # The head looks ahead of a turn.
    ahead = np.clip(0.12 * np.gradient(yaw_deg, times), -18.0, 18.0)
    rotations[:, index["head"]] = product(
        about(_DOWN, _smoothed(ahead, 0.1)), rotations[:, index["head"]]
    )


def _pelvis_way(
    skeleton: Skeleton,
    rotations: Floats,
    feet: list[_Foot],
    forward: Floats,
    lead: Floats,
    leg_m: float,
) -> Floats:
    """Path of the root, (T, 3): as high as both legs allow, a little over the standing foot."""
    translation = np.zeros((len(forward), 3))
    loads = np.stack([-foot.ankle_m[:, 1] for foot in feet])
    # The lower ankle carries: towards its side by up to 2 cm.
    carried = np.clip((loads[1] - loads[0]) / 0.06, -1.0, 1.0)
    translation[:, 0] = _smoothed(0.02 * carried, 0.09)
    translation[:, 2] = -forward
    above = skeleton.transforms(rotations, translation)
    drop = np.zeros(len(forward))
    for side, foot in zip("LR", feet, strict=True):
        bone = skeleton.index[f"pelvis.{side}"]
        hip = applied(above[:, bone, :, :3], skeleton.heads_m[skeleton.index[f"upperleg01.{side}"]])
        hip = hip + above[:, bone, :, 3]
        aside = np.hypot(foot.ankle_m[:, 0] - hip[:, 0], foot.ankle_m[:, 2] - hip[:, 2])
        tallest = np.sqrt(np.maximum((_STRETCH * leg_m) ** 2 - aside**2, 0.0))
        drop = np.maximum(drop, (foot.ankle_m[:, 1] - hip[:, 1]) - tallest)
    # The smooth curve stays above the needed drop: widest in a window, then rounded.
    from scipy.ndimage import maximum_filter1d

    translation[:, 1] = _smoothed(maximum_filter1d(drop, int(0.24 * GRID_HZ)), 0.06)
    return translation


def _stand(
    skeleton: Skeleton,
    rotations: Floats,
    translation: Floats,
    side: str,
    foot: _Foot,
    yaw_deg: Floats,
) -> None:
    """Bring one ankle to its place and turn the foot."""
    index = skeleton.index
    above = skeleton.transforms(rotations, translation)[:, index[f"pelvis.{side}"]]
    knees = np.tile([0.06 if side == "L" else -0.06, 0.0, -1.0], (len(above), 1))
    pole = applied(about(_DOWN, yaw_deg), knees)
    bones = (f"upperleg01.{side}", f"lowerleg01.{side}", f"foot.{side}")
    shank = place_limb(skeleton, rotations, bones, above, foot.ankle_m, pole, stretch=0.999)
    rotations[:, index[bones[-1]]] = product(transposed(shank), foot.turn)
    # Toes stay on the floor while the heel leaves it.
    flat = about(_ACROSS, -0.9 * np.clip(foot.pitch_deg, 0.0, None))
    for toe in range(1, 6):
        rotations[:, index[f"toe{toe}-1.{side}"]] = flat


def _swing_arms(
    skeleton: Skeleton, rotations: Floats, lead: Floats, pace: Floats, arm_scale: float
) -> None:
    index = skeleton.index
    relax_fingers(skeleton, rotations)
    turned = rotations[:, 0].copy()
    rotations[:, 0] = np.eye(3)
    vigour = np.clip(pace / 1.1, 0.0, 1.2)
    for side, sign in (("L", 1.0), ("R", -1.0)):
        arm = np.tile(np.array(astuple(HANGING)), (len(lead), 1))
        # The arm goes with the other leg, further ahead than back, bent more ahead.
        ahead = -sign * lead * vigour
        arm[:, 2] -= 0.030 * np.clip(ahead, 0.0, None) + 0.012 * vigour
        reach(skeleton, rotations, side, arm, arm_scale)
        upper = index[f"upperarm01.{side}"]
        swing = about(_ACROSS, -(_ARM_SWING_DEG * ahead - 2.0 * vigour))
        rotations[:, upper] = product(swing, rotations[:, upper])
    rotations[:, 0] = turned


def _smoothed(values: Floats, sigma_s: float) -> Floats:
    from scipy.ndimage import gaussian_filter1d

    return gaussian_filter1d(values, sigma_s * GRID_HZ, mode="nearest")
