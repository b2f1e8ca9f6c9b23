"""Motion of one take of a campaign: gestures in random order, other movements, rest.

Gestures are strokes of an arm between two sides of the body, or between above and below,
as in :mod:`~sd2core.simulate.limbs`, but none like another: poses, speed, path, evenness
of speed, hand and pauses are drawn for each. Between them hands rest, sink, or do
something else. Other takes hold no gesture at all: people stand and move their arms
and trunk at random, or step to and fro. Other protocols leave these other movements out,
have one hand swipe to and fro through a take, or both hang through another.
"""

from __future__ import annotations

import itertools
from dataclasses import astuple, dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sd2core.body.model import Skeleton
from sd2core.body.rotations import Floats, about, applied, product
from sd2core.simulate.campaign.protocol import VARIED, Protocol
from sd2core.simulate.campaign.scene import Subject
from sd2core.simulate.gait import Path, gait
from sd2core.simulate.limbs import (
    HANGING,
    ArmPose,
    Motion,
    arm_length_m,
    minimum_jerk,
    reach,
    relax_fingers,
    turn_torso,
)
from sd2core.simulate.people.arms import STYLES
from sd2core.simulate.people.motion import Deed, random_motion
from sd2core.simulate.people.signals import wander
from sd2core.simulate.people.walking import Mode

LABELS = ("background", "left-to-right", "right-to-left", "up-to-down", "down-to-up")
"""Directions as the camera sees them; its left is the body's right."""

Kind = Literal["gestures", "moving", "pacing", "resting", "captured"]
KINDS: dict[Kind, float] = {"gestures": 0.74, "moving": 0.18, "pacing": 0.08}
"""Contents of a take, each with its probability."""
_IN_TURN: tuple[Kind, ...] = ("gestures", "gestures", "resting")
"""Contents of takes without other movements, so that classes have equally many."""
_TO_AND_FRO = ((1, 2), (3, 4))
"""Labels of the two kinds of swipes, in turn."""

# Written for the right arm of the bundled body; see ArmPose.
_ENDS: dict[str, tuple[ArmPose, ArmPose]] = {
    # From the body's right to its left, then from above to below.
    "across": (
        ArmPose(-60.0, -12.0, 0.47, 0.35, 1.0, 0.25, 20.0, -8.0, -6.0),
        ArmPose(36.0, -15.0, 0.42, 0.9, 1.0, 0.0, 10.0, 12.0, 9.0),
    ),
    "down": (
        ArmPose(-13.0, 25.0, 0.34, 0.75, 1.0, 0.0, 43.0, -10.0, -3.0),
        ArmPose(-4.0, -46.0, 0.50, 0.8, 0.5, 0.6, 60.0, 18.0, 5.0),
    ),
}
_ELSEWHERE = (
    ArmPose(20.0, 35.0, 0.27, 0.9, 0.9, 0.1, 60.0, 10.0, 2.0),  # to the face
    ArmPose(-15.0, 52.0, 0.33, 1.0, 0.5, 0.2, 60.0, 10.0, 0.0),  # to the head
    ArmPose(-50.0, -58.0, 0.36, 1.0, 0.2, 0.8, 0.0, 20.0, 0.0),  # to the hip
    ArmPose(12.0, -24.0, 0.33, 0.7, 1.0, 0.1, 40.0, 10.0, 3.0),  # in front of the chest
    ArmPose(-80.0, -22.0, 0.51, 0.3, 1.0, 0.3, 0.0, 0.0, -5.0),  # out to the side
    ArmPose(-4.0, -8.0, 0.52, 0.6, 1.0, 0.0, 20.0, 0.0, 10.0),  # ahead
    ArmPose(30.0, -48.0, 0.40, 0.8, 0.6, 0.3, 20.0, 10.0, 6.0),  # before the belly
)
_SPREAD = np.array([9.0, 7.0, 0.03, 0.12, 0.12, 0.12, 12.0, 8.0, 3.0])
_BOW = np.array([4.0, 7.0, 0.035, 0.0, 0.0, 0.0, 8.0, 10.0, 2.0])
_REACH_M = (0.23, 0.528)
_STROKES_S = (0.42, 1.35)
_MOVES_S = (0.5, 1.2)
_SWIPE, _ELSE, _SINK = 0.72, 0.15, 0.07
"""Probability that a gesture, another movement or a sinking hand comes next; otherwise rest."""
_SMALL = Deed("stand", (STYLES["rest"], STYLES["rest"]), False, natural=True)
_ARMS = ("talk", "slow", "strokes", "rest", "up and aside")
_STEPS_M, _STEPS_MPS = (0.15, 0.6), (0.35, 0.9)


class Performance(NamedTuple):
    """Motion of one take and the label of each frame, an index into :data:`LABELS`."""

    motion: Motion
    label: NDArray[np.int8]
    kind: Kind


@dataclass(frozen=True, eq=False)
class Move:
    """One arm's way to a pose."""

    start_s: float
    end_s: float
    to: Floats  # Fields of :class:`~sd2core.simulate.limbs.ArmPose`, (9,).
    bow: Floats  # Distance of the way from the straight one in its middle, (9,).
    skew: float  # 1: fastest in the middle of the time; below 1 earlier.
    label: int = 0


def perform(
    rng: np.random.Generator,
    subject: Subject,
    skeleton: Skeleton,
    base: Skeleton,
    times_s: Floats,
    kind: Kind | None = None,
    *,
    protocol: Protocol = VARIED,
    number: int = 0,
) -> Performance:
    """Motion of one person in one take, on the floor's origin, facing -z.

    Parameters
    ----------
    rng : Generator
    subject : Subject
    skeleton : Skeleton
        The subject's.
    base : Skeleton
        Of the bundled body, for which poses of arms were written.
    times_s : float64 array, shape (T,)
        Multiples of 1/240 s.
    kind : Kind, optional
        By default drawn, or without other movements it follows from the take's number.
    protocol : Protocol
    number : int
        Of the take; the one kind of swipe of a take to and fro follows from it as well.
    """
    drawn: Kind = rng.choice(list(KINDS), p=list(KINDS.values()))
    kind = kind or (drawn if protocol.others else _IN_TURN[number % len(_IN_TURN)])
    label = np.zeros(len(times_s), np.int8)
    scale = arm_length_m(skeleton) / arm_length_m(base)
    if kind == "moving":
        motion = _moving(rng, subject, skeleton, times_s)
    elif kind == "pacing":
        motion = gait(skeleton, times_s, _to_and_fro(rng, float(times_s[-1])), scale)
    else:
        arms: dict[str, list[Move]] = {"L": [], "R": []}
        if kind == "gestures":
            arms = plan_arms(rng, subject, float(times_s[-1]), protocol, number)
        motion = _gesturing(rng, subject, skeleton, times_s, arms, scale)
        for move in (*arms["L"], *arms["R"]):
            if move.label:
                label[(times_s >= move.start_s) & (times_s < move.end_s)] = move.label
    return Performance(motion, label, kind)


def plan_arms(
    rng: np.random.Generator,
    subject: Subject,
    duration_s: float,
    protocol: Protocol = VARIED,
    number: int = 0,
) -> dict[str, list[Move]]:
    """Moves of both arms until there is no time for another; one arm moves at a time.

    Parameters
    ----------
    rng : Generator
    subject : Subject
    duration_s : float
        Of the take.
    protocol : Protocol
    number : int
        Of the take; the one kind of swipe of a take to and fro follows from it.

    Returns
    -------
    dict
        Moves of ``"L"`` and of ``"R"``, in order of time.
    """
    to_and_fro = protocol.order == "to-and-fro"
    swipe = _SWIPE if protocol.others else 1.0
    alternating = itertools.cycle(_TO_AND_FRO[number % len(_IN_TURN) % len(_TO_AND_FRO)])
    arms: dict[str, list[Move]] = {"L": [], "R": []}
    at: dict[str, Floats] = {"L": _HANGS, "R": _HANGS}
    now_s = float(rng.uniform(0.1, 1.0))

    def move(hand: str, to: Floats, length_s: float, bow: float = 1.0, label: int = 0) -> None:
        nonlocal now_s
        way = bow * _BOW * rng.standard_normal(len(_BOW))
        skew = float(np.exp(rng.normal(0.0, 0.15)))
        arms[hand].append(Move(now_s, now_s + length_s, to, way, skew, label))
        at[hand] = to
        now_s += length_s

    while now_s < duration_s - 1.0:
        hand = subject.hand
        if rng.random() < subject.other_hand and not to_and_fro:
            hand = "L" if hand == "R" else "R"
        drawn = rng.random()
        if drawn < swipe:
            label = next(alternating) if to_and_fro else int(rng.integers(1, len(LABELS)))
            start, end = _stroke(rng, subject, hand, label)
            if np.abs(at[hand] - start)[:2].max() > 25.0:
                move(hand, start, _length_s(rng, _MOVES_S, subject))
                now_s += float(rng.uniform(0.0, 0.35)) * subject.rests
            move(hand, end, _length_s(rng, _STROKES_S, subject), label=label)
            now_s += float(rng.uniform(0.05, 0.5)) * subject.rests
        elif drawn < _SWIPE + _ELSE:
            pose = np.array(astuple(_ELSEWHERE[rng.integers(len(_ELSEWHERE))]))
            move(hand, _varied(rng, pose), _length_s(rng, _MOVES_S, subject))
            now_s += float(rng.uniform(0.1, 0.9)) * subject.rests
        elif drawn < _SWIPE + _ELSE + _SINK:
            move(hand, _HANGS, _length_s(rng, _MOVES_S, subject))
            now_s += float(rng.uniform(0.2, 1.2)) * subject.rests
        else:
            now_s += float(rng.uniform(0.4, 1.6)) * subject.rests
    return arms


def arm_through_time(moves: list[Move], times_s: Floats) -> Floats:
    """Parameters of an arm that hangs at first, (T, 9)."""
    before = _HANGS
    poses = np.tile(before, (len(times_s), 1))
    for move in moves:
        phase = np.clip((times_s - move.start_s) / (move.end_s - move.start_s), 0.0, 1.0)
        share = minimum_jerk(phase**move.skew)
        poses += share[:, None] * (move.to - before)
        # 64 x³ (1 - x)³: 1 in the middle, and smooth at both ends.
        poses += (64.0 * (share * (1.0 - share)) ** 3)[:, None] * move.bow
        before = move.to
    poses[:, 2] = np.clip(poses[:, 2], *_REACH_M)
    return poses


_HANGS = np.array(astuple(HANGING))


def _stroke(
    rng: np.random.Generator, subject: Subject, hand: str, label: int
) -> tuple[Floats, Floats]:
    """Poses in which a stroke begins and ends."""
    name = LABELS[label]
    sideways = name in ("left-to-right", "right-to-left")
    first, last = (np.array(astuple(pose)) for pose in _ENDS["across" if sideways else "down"])
    # A wider or narrower stroke, all of it somewhere else.
    size = subject.size * float(np.exp(rng.normal(0.0, 0.12)))
    middle = 0.5 * (first + last)
    first, last = middle + size * (first - middle), middle + size * (last - middle)
    moved = 0.6 * _SPREAD * rng.standard_normal(len(_SPREAD))
    moved[:2] += subject.held_deg
    ends = [_varied(rng, pose + moved, 0.6) for pose in (first, last)]
    outwards = name == "down-to-up" or (sideways and (name == "left-to-right") == (hand == "L"))
    return (ends[1], ends[0]) if outwards else (ends[0], ends[1])


def _varied(rng: np.random.Generator, pose: Floats, share: float = 1.0) -> Floats:
    varied = pose + share * _SPREAD * np.clip(rng.standard_normal(len(pose)), -2.0, 2.0)
    varied[2] = np.clip(varied[2], *_REACH_M)
    varied[1] = np.clip(varied[1], -80.0, 70.0)
    return varied


def _length_s(rng: np.random.Generator, bounds_s: tuple[float, float], subject: Subject) -> float:
    return float(np.exp(rng.uniform(*np.log(bounds_s)))) * subject.tempo


def _gesturing(
    rng: np.random.Generator,
    subject: Subject,
    skeleton: Skeleton,
    times_s: Floats,
    arms: dict[str, list[Move]],
    scale: float,
) -> Motion:
    rotations = np.tile(np.eye(3), (len(times_s), len(skeleton), 1, 1))
    poses = {side: arm_through_time(moves, times_s) for side, moves in arms.items()}
    for pose in poses.values():
        # Hands are never quite still, raised less than hanging.
        raised = np.clip((pose[:, 1] + 80.0) / 60.0, 0.2, 1.0)[:, None]
        pose[:, :3] += raised * [0.5, 0.5, 0.002] * wander(rng, times_s, 2.0, 3)
    across_deg = subject.follow * (poses["R"][:, 8] - poses["L"][:, 8])
    turn_torso(skeleton, rotations, times_s + float(rng.uniform(0.0, 60.0)), across_deg)
    relax_fingers(skeleton, rotations)
    for side, pose in poses.items():
        reach(skeleton, rotations, side, pose, scale)
    lean = subject.sway_deg * wander(rng, times_s, 0.5, 2)
    x, _, z = np.eye(3)
    rotations[:, 0] = product(about(x, lean[:, 0]), about(z, 0.6 * lean[:, 1]))
    # The root turns about the floor's origin.
    root = np.broadcast_to(skeleton.heads_m[0], (len(rotations), 3))
    return Motion(rotations, np.asarray(applied(rotations[:, 0], root) - root))


def _moving(
    rng: np.random.Generator, subject: Subject, skeleton: Skeleton, times_s: Floats
) -> Motion:
    legs: Mode = "shift" if rng.random() < 0.4 else "stand"
    if rng.random() < 0.25:
        deed = _SMALL
    else:
        one, other = (STYLES[name] for name in rng.choice(_ARMS, 2))
        deed = Deed(legs, (one, other), False, natural=True)
    return random_motion(rng, skeleton, subject.shape.stature_m, times_s, deed)


def _to_and_fro(rng: np.random.Generator, duration_s: float) -> Path:
    """Steps towards the camera and back, with pauses."""
    starts, lengths, places = [], [], [0.0]
    now_s = float(rng.uniform(0.2, 1.0))
    while now_s < duration_s:
        side = -np.sign(places[-1]) if places[-1] else rng.choice([-1.0, 1.0])
        places.append(float(side * rng.uniform(*_STEPS_M)))
        way_m = abs(places[-1] - places[-2])
        # A minimum-jerk move is 1.875 times as fast in its middle as on average.
        lengths.append(1.875 * way_m / float(rng.uniform(*_STEPS_MPS)))
        starts.append(now_s)
        now_s += lengths[-1] + float(rng.uniform(0.0, 1.5))

    def forward_m(times: Floats) -> Floats:
        gone = np.full(len(times), places[0])
        for start_s, length_s, before, after in zip(
            starts, lengths, places[:-1], places[1:], strict=True
        ):
            gone += (after - before) * minimum_jerk((times - start_s) / length_s)
        return gone

    return Path(forward_m, np.zeros_like)
