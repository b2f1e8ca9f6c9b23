"""The paper's four swipes as the motion of a standing body's right arm.

Directions are as the sensor (and the camera) sees them: a left-to-right swipe goes
from the left of the image to its right, which is from the body's right to its left.

The hand follows minimum-jerk moves (T. Flash and N. Hogan, "The coordination of arm
movements", J. Neurosci. 5, 1985) between poses that are given around the shoulder, so
that a swipe is an arc, as a real one is, and has a radial velocity even where it
crosses the view.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from sd2core.body.model import Body, Skeleton
from sd2core.body.rotations import Floats, applied
from sd2core.files.recording_json import Span
from sd2core.simulate.limbs import (
    HANGING,
    ArmPose,
    Motion,
    minimum_jerk,
    reach,
    relax_fingers,
    turn_torso,
)

DURATION_S = 15.0


class Move(NamedTuple):
    """One arm's way to a pose; a labelled one is a gesture's stroke."""

    start_s: float
    end_s: float
    to: ArmPose
    label: str | None = None


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


def strokes(moves: Sequence[Move]) -> tuple[Span, ...]:
    """The gestures; raising, holding and lowering the hand belong to none."""
    return tuple(
        Span(start_s=move.start_s, end_s=move.end_s, label=move.label)
        for move in moves
        if move.label
    )


SPANS = strokes(_MOVES)


def swipes(skeleton: Skeleton, times_s: ArrayLike) -> Motion:
    """Motion of the whole body at any times, smooth in time.

    Before 0.3 s and after 14.95 s the arm hangs.
    """
    times = np.asarray(times_s, dtype=np.float64)
    return with_one_arm(skeleton, times, arm_poses(_MOVES, times))


def with_one_arm(
    skeleton: Skeleton,
    times_s: Floats,
    arm: Floats,
    hand: Literal["L", "R"] = "R",
    arm_scale: float = 1.0,
    sway_s: float = 0.0,
) -> Motion:
    """Motion of a standing body that moves one arm; the other one hangs.

    Parameters
    ----------
    arm : float64 array, shape (T, parameters)
        Of :func:`arm_poses`, as for the right arm.
    hand : {"L", "R"}
        Whose arm.
    arm_scale : float
        Length of this skeleton's arm to the bundled one's.
    sway_s : float
        Added to the clock by which the body sways.
    """
    rotations = np.tile(np.eye(3), (len(times_s), len(skeleton), 1, 1))
    across, other = (1.0, "L") if hand == "R" else (-1.0, "R")
    turn_torso(skeleton, rotations, times_s + sway_s, across * arm[:, 8])
    relax_fingers(skeleton, rotations)
    reach(skeleton, rotations, hand, arm, arm_scale)
    hanging = np.tile(np.array(astuple(HANGING)), (len(times_s), 1))
    hanging[:, 0] += 1.2 * np.sin(0.9 * times_s)
    reach(skeleton, rotations, other, hanging, arm_scale)
    return Motion(rotations, np.zeros((len(times_s), 3)))


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


def posed(body: Body, rotations: Floats, translation_m: Floats | None = None) -> Floats:
    """Vertices (T, V, 3) by linear blend skinning; arguments of ``Skeleton.transforms``.

    To the same bits on every machine, which the sample's reproducibility rests on.
    """
    transforms = body.skeleton.transforms(rotations, translation_m)  # (T, B, 3, 4)
    slots = []
    for slot in range(body.weights.shape[1]):
        rows = np.flatnonzero(body.weights[:, slot])
        slots.append((rows, body.bones[rows, slot], body.weights[rows, slot, None, None]))
    vertices = np.empty((len(transforms), len(body.vertices_m), 3))
    for frame, bones in enumerate(transforms):
        blend = np.zeros((len(body.vertices_m), 3, 4))
        # Slot after slot instead of a matrix product: the same sum in the same order.
        for rows, numbers, weights in slots:
            blend[rows] += weights * bones[numbers]
        vertices[frame] = applied(blend[..., :3], body.vertices_m) + blend[..., 3]
    return vertices
