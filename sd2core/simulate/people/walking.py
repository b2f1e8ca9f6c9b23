"""Paths of a person's pelvis and feet: standing, stepping, walking, turning, sitting."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from sd2core.body.rotations import Floats
from sd2core.simulate.people.signals import Moves, follow, smooth_share, wander

Mode = Literal["stand", "shift", "walk", "turn", "sit"]
"""Action of the legs."""

_STEP = 0.36
"""Statures."""


@dataclass(frozen=True, eq=False)
class Footwork:
    """Pelvis and feet on the floor, in statures."""

    place: Floats  # Pelvis, (T, 2): x, z on the floor.
    heading_deg: Floats  # Turn about the vertical; 0 faces towards -z.
    sink: Floats  # Distance of the pelvis below its height when standing.
    feet: Floats  # x, z and height above its rest of left and right ankle, (T, 2, 3).
    feet_heading_deg: Floats  # (T, 2).
    stride: Floats  # -1 to 1: how far ahead the left foot is, for the arms to swing by.


def footwork(
    rng: np.random.Generator, times_s: Floats, mode: Mode, *, still: bool = False
) -> Footwork:
    """Random footwork.

    Parameters
    ----------
    rng : Generator
    times_s : float64 array, shape (T,)
    mode : {"stand", "shift", "walk", "turn", "sit"}
    still : bool
        Leaves a breath of sway only.
    """
    count = len(times_s)
    place = np.zeros((count, 2))
    heading = np.zeros(count)
    sway = rng.uniform(0.0005, 0.002) if still else rng.uniform(0.002, 0.012)
    if mode == "walk":
        heading, place = _walk(rng, times_s)
    elif mode == "turn":
        starts = times_s[0] + np.cumsum(rng.uniform(0.3, 1.5, 2))
        turns = rng.uniform(-200.0, 200.0, 2)
        poses = np.concatenate([[0.0], np.cumsum(turns)])[:, None]
        moves = Moves(starts, np.abs(turns) / rng.uniform(60.0, 200.0, 2) + 0.4, np.ones(2))
        heading = follow(times_s, moves, poses)[:, 0]
    elif mode == "shift":
        place = rng.uniform(0.02, 0.08) * wander(rng, times_s, 0.5, 2)
        heading = rng.uniform(0.0, 10.0) * wander(rng, times_s, 0.4, 1)[:, 0]
    # Need for steps, 0 to 1, smooth.
    speed = np.linalg.norm(np.gradient(place, times_s, axis=0), axis=1)
    turning = np.abs(np.gradient(heading, times_s)) / 90.0
    busy = smooth_share((speed / 0.35 + turning - 0.15) / 0.85, np.ones(()))
    place = place + sway * wander(rng, times_s, 0.6, 2)
    apart = rng.uniform(0.045, 0.11)
    feet, feet_heading, stride = _feet(times_s, place, heading, busy, apart)
    sink = np.full(count, rng.uniform(0.002, 0.02)) + 0.02 * busy * (1.0 + stride**2) / 2.0
    if mode == "sit":
        sink = sink + rng.uniform(0.23, 0.27)
        ahead = rng.uniform(0.18, 0.27, 2)
        feet[..., 1] -= ahead
        feet[..., 0] *= rng.uniform(1.0, 2.0)
    if mode == "shift" and rng.random() < 0.3:
        sink = sink + rng.uniform(0.01, 0.07) * (
            1.0 + wander(rng, times_s, 0.8, 1)[:, 0].clip(-1, 3)
        )
    return Footwork(place, heading, sink, feet, feet_heading, stride * busy)


def _walk(rng: np.random.Generator, times_s: Floats) -> tuple[Floats, Floats]:
    """Heading and place of someone walking with changes of speed and direction."""
    step_s = float(np.diff(times_s).mean())
    changes = np.sort(rng.uniform(times_s[0], times_s[-1], 3))
    speeds = rng.uniform(0.15, 0.95, 4)[:, None]
    if rng.random() < 0.5:
        speeds[rng.integers(4)] = 0.0
    ramps = rng.uniform(0.5, 1.2, 3)
    speed = follow(times_s, Moves(changes, ramps, np.ones(3)), speeds)[:, 0]
    headings = np.cumsum(rng.normal(0.0, [40.0, 30.0, 30.0, 30.0]))[:, None]
    heading = follow(times_s, Moves(changes, ramps + 0.4, np.ones(3)), headings)[:, 0]
    backwards = -1.0 if rng.random() < 0.15 else 1.0
    angle = np.radians(heading)
    along = np.stack([-np.sin(angle), -np.cos(angle)], axis=1)
    place = np.cumsum(backwards * speed[:, None] * along, axis=0) * step_s
    return heading, place - place[len(place) // 2]


def _feet(
    times_s: Floats, place: Floats, heading_deg: Floats, busy: Floats, apart: float
) -> tuple[Floats, Floats, Floats]:
    """Feet that stand while the pelvis passes over them, then swing to the next place."""
    speed = np.linalg.norm(np.gradient(place, times_s, axis=0), axis=1)
    rate = busy * (0.55 + speed / (2.0 * _STEP))  # strides per second
    phase = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(times_s))])
    feet = np.empty((len(times_s), 2, 3))
    turned = np.empty((len(times_s), 2))
    swing = 0.4
    for foot, side in enumerate((1.0, -1.0)):
        own = phase + 0.5 * foot + 0.15
        number = np.floor(own)
        within = own - number
        # Stands where the pelvis is in the middle of its stance.
        middles = np.arange(number.min() - 1.0, number.max() + 3.0) + 0.5 * (1.0 - swing)
        at = np.interp(middles - 0.5 * foot - 0.15, phase, times_s)
        beyond = middles - 0.5 * foot - 0.15
        points = np.stack([np.interp(at, times_s, place[:, axis]) for axis in (0, 1)], axis=1)
        # Before and after the take: straight on.
        points += _beyond(phase, times_s, place, beyond)
        angles = np.radians(np.interp(at, times_s, heading_deg))
        points += side * apart * np.stack([np.cos(angles), -np.sin(angles)], axis=1)
        row = (number - number.min()).astype(np.intp) + 1
        share = smooth_share((within - (1.0 - swing)) / swing, np.ones(()))
        feet[:, foot, :2] = points[row] + share[:, None] * (points[row + 1] - points[row])
        feet[:, foot, 2] = 0.06 * busy * np.sin(np.pi * share) ** 2
        degrees = np.degrees(angles)
        turned[:, foot] = degrees[row] + share * (degrees[row + 1] - degrees[row])
    stride = np.sin(2.0 * np.pi * (phase + 0.15 - 0.2))
    return feet, turned, stride


def _beyond(phase: Floats, times_s: Floats, place: Floats, wanted: Floats) -> Floats:
    """Offsets that let places held at the ends of a take go straight on."""
    result = np.zeros((len(wanted), 2))
    for end, step in ((0, 1), (-1, -1)):
        rate = (phase[end + step] - phase[end]) * step
        if rate > 1e-6:
            drift = (place[end + step] - place[end]) * step / rate
            over = wanted - phase[end]
            over = np.minimum(over, 0.0) if end == 0 else np.maximum(over, 0.0)
            result += over[:, None] * np.clip(drift, -1.0, 1.0)
    return result
