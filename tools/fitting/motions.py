"""Motions of known truth: swipes at three speeds, standing, walking, turning.

They exist to measure a fit against, so nothing that is fitted or trained may have seen
them: whoever trains on simulated people uses other motions.
"""

from __future__ import annotations

from dataclasses import astuple, dataclass, replace
from typing import Literal, NamedTuple

import numpy as np

from sd2core.body.model import Skeleton
from sd2core.body.rotations import Floats, about
from sd2core.errors import Sd2Error
from sd2core.files.recording_json import Span
from sd2core.simulate.gait import Path, gait
from sd2core.simulate.limbs import (
    HANGING,
    ArmPose,
    Motion,
    minimum_jerk,
    reach,
    relax_fingers,
)
from tools.build_sample.swipes import Move, arm_poses, strokes, with_one_arm

Kind = Literal["swipes", "still", "walk", "turn", "captured"]
Speed = Literal["slow", "normal", "fast"]
Swipe = Literal["left-to-right", "right-to-left", "up-to-down", "down-to-up"]

STROKE_S: dict[Speed, float] = {"slow": 1.25, "normal": 0.72, "fast": 0.42}
"""Shortest and longest duration of a stroke."""

_RAISE_S, _LOWER_S, _HOLD_S = 0.65, 0.7, 0.2
_START_S = 0.25
_RAMP_S = 0.7
"""To reach the speed of a walk, and to stand again."""
_GRID_HZ = 240.0
"""Rate at which the way of a walk is summed."""

# Written for the right arm of the bundled body; see ArmPose. Other places than the
# bundled sample's: wider strokes, higher and lower.
_OUTSIDE = ArmPose(-60.0, -9.0, 0.48, 0.35, 1.0, 0.25, 18.0, -8.0, -7.0)
_ACROSS = ArmPose(35.0, -12.0, 0.42, 0.9, 1.0, 0.0, 8.0, 14.0, 11.0)
_ABOVE = ArmPose(-16.0, 34.0, 0.36, 0.75, 1.0, 0.0, 42.0, -10.0, -3.0)
_BELOW = ArmPose(-2.0, -50.0, 0.50, 0.8, 0.5, 0.6, 58.0, 20.0, 6.0)
_PRESENTED = ArmPose(-8.0, -14.0, 0.36, 0.6, 1.0, 0.1, 30.0, -20.0, 2.0)


@dataclass(frozen=True)
class Action:
    """Action of one simulated person."""

    kind: Kind
    swipes: tuple[Swipe, ...] = ()  # one after another, as the camera sees them
    speed: Speed = "normal"  # see STROKE_S
    hand: Literal["L", "R"] = "R"
    raised: bool = False  # for ``still``: the hand is held in front instead of hanging
    # For ``walk``: how far towards the camera, and how fast in between.
    walk_m: float = 2.5
    walk_mps: float = 1.05
    # For ``turn``: where to, one after another; 0 faces the camera.
    turn_deg: tuple[float, ...] = (75.0, -65.0)
    trial: str = ""  # for ``captured``: the recording of a real person's motion
    # For ``captured``: the part of it that is shown.
    start_s: float = 0.0
    length_s: float = 4.0
    # For ``captured``: 0 shows the person's front at the start, 180 the back; positive turns the
    # person's left side to the camera.
    heading_deg: float = 0.0


class Performance(NamedTuple):
    """A motion and when its gestures are made."""

    motion: Motion
    spans: tuple[Span, ...]


def duration_s(action: Action, seed: int) -> float:
    """Duration of an action, before it is rounded to whole frames; see :func:`perform`."""
    if action.kind == "swipes":
        return _moves(action, np.random.default_rng(seed))[-1].end_s + 0.25
    if action.kind == "walk":
        return _START_S + action.walk_m / action.walk_mps + 0.7 + 0.45
    if action.kind == "turn":
        return _turns(action)[-1][1] + 0.6
    if action.kind == "captured":
        return action.length_s
    return 4.0


def perform(
    skeleton: Skeleton, action: Action, times_s: Floats, seed: int, arm_scale: float = 1.0
) -> Performance:
    """Carry an action out; those of real people are in :mod:`tools.fitting.clips`.

    Parameters
    ----------
    skeleton : Skeleton
        Bundled or shaped.
    times_s : float64 array, shape (T,)
        Multiples of 1/240 s for walking and turning.
    seed : int
        Of where exactly each stroke begins and ends: no two are alike.
    arm_scale : float
        Length of this skeleton's arm to the bundled one's.
    """
    rng = np.random.default_rng(seed)
    times = np.asarray(times_s, dtype=np.float64)
    if action.kind == "walk":
        path = _straight(_START_S, action.walk_m, action.walk_mps)
        return Performance(gait(skeleton, times, path, arm_scale), ())
    if action.kind == "turn":
        return Performance(gait(skeleton, times, _turning(_turns(action)), arm_scale), ())
    if action.kind == "still":
        return Performance(_still(skeleton, action, len(times), arm_scale), ())
    moves = _moves(action, rng)
    arm, sway_s = arm_poses(moves, times), float(rng.uniform(0, 30))
    motion = with_one_arm(skeleton, times, arm, action.hand, arm_scale, sway_s)
    return Performance(motion, strokes(moves))


def _straight(start_s: float, distance_m: float, speed_mps: float) -> Path:
    """Stand, walk a distance towards the camera, stand."""
    cruise_s = distance_m / speed_mps - _RAMP_S
    if cruise_s <= 0:
        raise ValueError("too short a way to reach this speed")
    fine = np.arange(0.0, cruise_s + 2 * _RAMP_S + 1.0 / _GRID_HZ, 1.0 / _GRID_HZ)
    share = minimum_jerk(fine / _RAMP_S) - minimum_jerk((fine - _RAMP_S - cruise_s) / _RAMP_S)
    way = np.concatenate([[0.0], np.cumsum(0.5 * (share[1:] + share[:-1]))])
    way *= distance_m / way[-1]
    return Path(lambda t: np.interp(t, start_s + fine, way), np.zeros_like)


def _turning(turns: tuple[tuple[float, float, float], ...]) -> Path:
    """Turn on the spot: ``(start_s, end_s, to_deg)`` one after another."""

    def yaw_deg(times: Floats) -> Floats:
        yaw, before = np.zeros(len(times)), 0.0
        for start_s, end_s, to_deg in turns:
            yaw += (to_deg - before) * minimum_jerk((times - start_s) / (end_s - start_s))
            before = to_deg
        return yaw

    return Path(np.zeros_like, yaw_deg)


def _moves(action: Action, rng: np.random.Generator) -> list[Move]:
    if not action.swipes:
        raise Sd2Error("An action of swipes names none", "at least one swipe")
    moves: list[Move] = []
    now_s, at = _START_S, ""
    for swipe in action.swipes:
        start, end = (_varied(pose, rng) for pose in _ends(swipe, action.hand))
        if at != swipe:
            moves.append(Move(now_s, now_s + _RAISE_S, start))
            now_s += _RAISE_S + _HOLD_S
        length_s = STROKE_S[action.speed] * float(rng.uniform(0.94, 1.06))
        moves.append(Move(now_s, now_s + length_s, end, swipe))
        now_s += length_s + _HOLD_S
        at = _BACK[swipe]
    moves.append(Move(now_s, now_s + _LOWER_S, HANGING))
    return moves


_BACK: dict[str, str] = {
    "left-to-right": "right-to-left",
    "right-to-left": "left-to-right",
    "up-to-down": "down-to-up",
    "down-to-up": "up-to-down",
}


def _ends(swipe: Swipe, hand: str) -> tuple[ArmPose, ArmPose]:
    """Poses in which a stroke begins and ends. The camera's left is the body's right."""
    if swipe in ("left-to-right", "right-to-left"):
        outward = (swipe == "left-to-right") == (hand == "L")
        return (_ACROSS, _OUTSIDE) if outward else (_OUTSIDE, _ACROSS)
    return (_ABOVE, _BELOW) if swipe == "up-to-down" else (_BELOW, _ABOVE)


def _varied(pose: ArmPose, rng: np.random.Generator) -> ArmPose:
    """The same pose a few degrees and centimetres elsewhere."""
    azimuth, elevation, pronation, flexion, torso = rng.normal(size=5)
    return replace(
        pose,
        azimuth_deg=pose.azimuth_deg + 3.0 * float(np.clip(azimuth, -1.5, 1.5)),
        elevation_deg=pose.elevation_deg + 2.5 * float(np.clip(elevation, -1.5, 1.5)),
        reach_m=pose.reach_m + 0.02 * float(rng.uniform(-1, 1)),
        pronation_deg=pose.pronation_deg + 6.0 * float(pronation),
        flexion_deg=pose.flexion_deg + 4.0 * float(flexion),
        torso_deg=pose.torso_deg + 2.0 * float(torso),
    )


def _still(skeleton: Skeleton, action: Action, frames: int, arm_scale: float) -> Motion:
    """A body that does not move at all: it does not even breathe."""
    rotations = np.tile(np.eye(3), (1, len(skeleton), 1, 1))
    rotations[:, skeleton.index["head"]] = about(np.array([1.0, 0.0, 0.0]), np.array([5.0]))
    relax_fingers(skeleton, rotations)
    for side in "LR":
        pose = _PRESENTED if action.raised and side == action.hand else HANGING
        reach(skeleton, rotations, side, np.array([astuple(pose)]), arm_scale)
    return Motion(np.repeat(rotations, frames, axis=0), np.zeros((frames, 3)))


def _turns(action: Action) -> tuple[tuple[float, float, float], ...]:
    """Turns at about 70 degrees a second, with a moment's rest in between; at last back."""
    turns, now_s, before = [], 0.35, 0.0
    for to_deg in (*action.turn_deg, 0.0):
        length_s = max(abs(to_deg - before) / 70.0, 0.6)
        turns.append((now_s, now_s + length_s, to_deg))
        now_s += length_s + 0.2
        before = to_deg
    return tuple(turns)
