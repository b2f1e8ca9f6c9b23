"""Random motion of one arm: where wrist and elbow go, and how the hand is turned."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sd2core.body.rotations import Floats
from sd2core.simulate.limbs import elbow_position
from sd2core.simulate.people.signals import Moves, envelope, follow, wander

PARAMETERS = 11
"""Parameters of an arm: place of the wrist (3), direction in which the elbow bends (3),
pronation, flexion and deviation of the hand in degrees, curl of fingers and thumb (0 to 1)."""

_TURN = ([25.0, 0.0, 0.0], [50.0, 22.0, 9.0])
"""Mean and spread of pronation, flexion and deviation."""

_NATURAL_TURN = ([25.0, 0.0, 0.0], [30.0, 16.0, 6.0])

_SWEEPS = 0.7

_ELBOW_RESTS = 0.6

_UPPER = 0.54
"""Share of the upper arm in an arm's length."""

_NATURAL = {"any": 0.35}
"""Factor on the probability of a zone in natural motion."""

_FASTEST = 7.0
"""Arm lengths per second; 4 to 5 m/s."""


@dataclass(frozen=True)
class ArmStyle:
    """Style of an arm's motion.

    The time of one move is drawn evenly in its logarithm, from ``shortest_s`` to ``longest_s``.
    """

    shortest_s: float = 0.3
    longest_s: float = 1.4
    hold: float = 0.5  # Chance that the arm rests between two moves.
    longest_hold_s: float = 0.8
    # Names of :data:`ZONES`, and how likely each is the next target.
    zones: tuple[tuple[str, float], ...] = (("any", 0.35), ("front", 0.55), ("hang", 0.1))
    wave: float = 0.15  # Chance of one oscillation per second.
    returns: bool = False  # True if every second target is the one before: strokes out and back.


# Azimuth from straight ahead (positive away from the body's middle), elevation, and reach
# as a share of the arm's length: bounds of boxes.
ZONES = {
    "any": ((-75.0, 105.0), (-85.0, 75.0), (0.42, 0.985)),
    "front": ((-70.0, 50.0), (-60.0, 25.0), (0.45, 0.97)),
    "chest": ((-65.0, 25.0), (-50.0, 5.0), (0.40, 0.75)),
    "face": ((-60.0, 40.0), (0.0, 65.0), (0.40, 0.75)),
    "up": ((-30.0, 90.0), (25.0, 82.0), (0.60, 0.985)),
    "aside": ((45.0, 120.0), (-45.0, 30.0), (0.70, 0.985)),
    "across": ((-80.0, -40.0), (-40.0, 10.0), (0.40, 0.85)),
    "forward": ((-35.0, 25.0), (-35.0, 15.0), (0.80, 0.985)),
    "guard": ((-50.0, 10.0), (-40.0, 10.0), (0.35, 0.50)),
    "reach": ((-55.0, 75.0), (-60.0, 45.0), (0.55, 0.97)),
    "low": ((-40.0, 60.0), (-80.0, -40.0), (0.75, 0.98)),
    "hang": ((-30.0, 60.0), (-89.0, -78.0), (0.93, 0.985)),
}

STYLES = {
    "strokes": ArmStyle(),
    "quick": ArmStyle(0.28, 0.7, 0.6, 0.5, (("front", 0.75), ("any", 0.25)), 0.0),
    "slow": ArmStyle(0.8, 2.5, 0.5, 1.0, (("any", 0.5), ("front", 0.5)), 0.1),
    "talk": ArmStyle(
        0.3, 0.8, 0.4, 0.6, (("chest", 0.5), ("front", 0.3), ("face", 0.1), ("low", 0.1)), 0.3
    ),
    "wave": ArmStyle(0.5, 1.2, 0.8, 1.5, (("any", 0.4), ("front", 0.4), ("up", 0.2)), 0.7),
    "up and aside": ArmStyle(0.4, 1.2, 0.5, 0.6, (("up", 0.4), ("aside", 0.4), ("hang", 0.2))),
    "across": ArmStyle(0.3, 1.0, 0.4, 0.5, (("across", 0.4), ("aside", 0.4), ("front", 0.2))),
    "rest": ArmStyle(0.6, 1.5, 0.9, 3.0, (("hang", 0.8), ("any", 0.2)), 0.02),
}
"""Styles of arms in motion, by name."""


def still_arm(rng: np.random.Generator, times_s: Floats) -> Floats:
    """An arm in one pose, (T, PARAMETERS)."""
    zone = "hang" if rng.random() < 0.5 else "any"
    return np.tile(_target(rng, zone), (len(times_s), 1))


def moving_arm(
    rng: np.random.Generator,
    times_s: Floats,
    style: ArmStyle,
    *,
    natural: bool = False,
    elbows_rest: bool = False,
) -> Floats:
    """Parameters of an arm through time, (T, PARAMETERS).

    The first three are the wrist's place seen from the shoulder in arm lengths:
    away from the body's middle, down, ahead. ``natural`` arms let their elbows hang
    and mostly sweep about the shoulder, others hold them any way; with ``elbows_rest``
    the forearm often turns about an elbow that stays.
    """
    straight = rng.random() < (1.0 - _SWEEPS if natural else 0.5)
    names = [name for name, _ in style.zones]
    chances = np.array([share for _, share in style.zones])
    if natural:
        chances = chances * [_NATURAL.get(name, 1.0) for name in names]
    poses = [_target(rng, names[rng.choice(len(names), p=chances / chances.sum())], natural)]
    starts, lengths = [], []
    now = times_s[0] + rng.uniform(-1.0, 0.5)
    while now < times_s[-1]:
        if style.returns and len(poses) % 2 == 0:
            target = poses[-2] + np.where(np.arange(PARAMETERS) < 3, 0.04, 0.0) * (
                rng.standard_normal(PARAMETERS)
            )
        else:
            zone = names[rng.choice(len(names), p=chances / chances.sum())]
            target = _target(rng, zone, natural)
            # An arm sweeps about its shoulder more often than it stretches on the way.
            if natural and zone != "hang" and poses[-1][2] < 0.95 and rng.random() < _SWEEPS:
                target[2] = np.clip(poses[-1][2] + 0.08 * rng.standard_normal(), 0.4, 0.97)
        if elbows_rest and poses[-1][1] > -75.0 and rng.random() < _ELBOW_RESTS:
            target[:6] = _about_elbow(rng, poses[-1])
        far = float(np.linalg.norm(_place(target) - _place(poses[-1])))
        length = float(np.exp(rng.uniform(np.log(style.shortest_s), np.log(style.longest_s))))
        length = max(length, 1.9 * far / _FASTEST)
        starts.append(now)
        lengths.append(length)
        poses.append(target)
        # Without a hold, the next move may begin before this one ends.
        pause = rng.uniform(0.0, style.longest_hold_s) if rng.random() < style.hold else 0.0
        now += length * (rng.uniform(0.75, 1.0) if pause == 0.0 else 1.0) + pause
    moves = Moves(np.array(starts), np.array(lengths), np.exp(rng.normal(0.0, 0.15, len(starts))))
    table = np.array(poses)
    if straight:
        table[:, :3] = [_place(pose) for pose in poses]
        arm = follow(times_s, moves, table)
    else:
        arm = follow(times_s, moves, table)
        arm[:, :3] = _places(arm[:, :3])
    if style.wave:
        _add_waves(rng, times_s, arm, style.wave)
    arm[:, :3] += rng.uniform(0.0, 0.02) * wander(rng, times_s, 1.5, 3)
    arm[:, 6:9] += rng.uniform(0.0, 10.0) * wander(rng, times_s, 2.0, 3)
    return arm


def _target(rng: np.random.Generator, zone: str, natural: bool = False) -> Floats:
    """One pose; the wrist by azimuth, elevation (degrees) and reach."""
    if natural:
        return _natural_target(rng, zone)
    low, high = np.array(ZONES[zone]).T
    hanging = zone == "hang"
    elbow = rng.normal([0.6, 0.7, 0.6], [0.25, 0.4, 0.3])
    if hanging:
        elbow = rng.normal([0.45, 0.0, 0.8], [0.25, 0.1, 0.2])
    mean, sd = ([-20.0, 0.0, 0.0], [30.0, 22.0, 9.0]) if hanging else _TURN
    turn = rng.normal(mean, sd)
    turn = np.clip(turn, [-80.0, -55.0, -22.0], [95.0, 55.0, 22.0])
    curl = rng.beta(0.8, 1.0) if not hanging else rng.uniform(0.1, 0.5)
    thumb = np.clip(curl + rng.normal(0.0, 0.25), 0.0, 1.0)
    return np.concatenate([rng.uniform(low, high), elbow, turn, [curl, thumb]])


def _natural_target(rng: np.random.Generator, zone: str) -> Floats:
    """One pose with the elbow where people have it: below the hand, further out if it is high."""
    low, high = np.array(ZONES[zone]).T
    place = rng.uniform(low, high)
    if zone == "hang":
        elbow = rng.normal([0.45, 0.0, 0.9], [0.15, 0.05, 0.15])
    else:
        raised = np.clip((place[1] + 10.0) / 60.0, 0.0, 1.0)
        elbow = rng.normal([0.5 + 0.4 * raised, 1.0 - 0.3 * raised, 0.3], [0.22, 0.15, 0.2])
    mean, sd = ([-25.0, 4.0, 0.0], [12.0, 8.0, 4.0]) if zone == "hang" else _NATURAL_TURN
    turn = np.clip(rng.normal(mean, sd), [-60.0, -45.0, -18.0], [90.0, 45.0, 18.0])
    curl = rng.uniform(0.05, 0.45) if rng.random() < 0.75 else rng.uniform(0.4, 1.0)
    thumb = np.clip(curl + rng.normal(0.0, 0.2), 0.0, 1.0)
    return np.concatenate([place, elbow, turn, [curl, thumb]])


def _about_elbow(rng: np.random.Generator, pose: Floats) -> Floats:
    """Wrist and elbow, with the forearm turned about the elbow of another pose."""
    shoulder, wrist = np.zeros((1, 3)), _places(pose[None, :3])
    # Poles point away from the body's middle, down, back; places ahead.
    pole = pose[None, 3:6] * np.array([1.0, 1.0, -1.0])
    elbow = elbow_position(shoulder, wrist, _UPPER, 1.0 - _UPPER, pole)[0]
    for _ in range(30):
        azimuth, elevation = np.radians(rng.uniform([-110.0, -80.0], [60.0, 85.0]))
        level = np.cos(elevation)
        way = np.array([np.sin(azimuth) * level, -np.sin(elevation), np.cos(azimuth) * level])
        place = elbow + (1.0 - _UPPER) * way
        reach = float(np.linalg.norm(place))
        if 0.4 < reach < 0.97:
            break
    else:
        return pose[:6]
    spherical = [
        np.degrees(np.arctan2(place[0], place[2])),
        np.degrees(np.arcsin(-place[1] / reach)),
        reach,
    ]
    return np.concatenate([spherical, elbow * np.array([1.0, 1.0, -1.0]) / _UPPER])


def _place(pose: Floats) -> Floats:
    return _places(pose[None, :3])[0]


def _places(spherical: Floats) -> Floats:
    """Away from the middle, down, ahead: of azimuth, elevation in degrees and reach, (n, 3)."""
    azimuth, elevation = np.radians(spherical[:, 0]), np.radians(spherical[:, 1])
    level = np.cos(elevation)
    unit = np.stack([np.sin(azimuth) * level, -np.sin(elevation), np.cos(azimuth) * level], axis=1)
    return np.asarray(spherical[:, 2:3] * unit)


def _add_waves(rng: np.random.Generator, times_s: Floats, arm: Floats, per_second: float) -> None:
    """Add waving and circling of the wrist, and shaking of the hand."""
    length = times_s[-1] - times_s[0]
    for _ in range(rng.poisson(per_second * length)):
        start = rng.uniform(times_s[0] - 0.5, times_s[-1] - 0.3)
        end = start + rng.uniform(0.8, 3.0)
        frequency = np.exp(rng.uniform(np.log(0.5), np.log(3.0)))
        size = min(rng.uniform(0.05, 0.45), 0.75 * _FASTEST / (2.0 * np.pi * frequency))
        shape = envelope(times_s, start, end, min(0.35, 0.3 / frequency + 0.1))[:, None]
        angle = 2.0 * np.pi * frequency * times_s[:, None] + rng.uniform(0.0, 2.0 * np.pi)
        axes = np.linalg.qr(rng.standard_normal((3, 3)))[0]
        roundness = rng.choice([0.0, 0.3, 1.0])
        path = np.sin(angle) * axes[0] + roundness * np.cos(angle) * axes[1]
        arm[:, :3] += size * shape * path
        turn = rng.normal(0.0, [15.0, 12.0, 6.0])
        arm[:, 6:9] += shape * np.sin(angle + rng.uniform(0.0, 2.0 * np.pi)) * turn
