"""Postures: read from a body, changed, and read again."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sd2core.body.model import Skeleton, load_skeleton
from sd2core.body.rotations import Floats, from_vector
from sd2core.simulate.campaign.posture import (
    LIMBS,
    Group,
    all_groups,
    change_posture,
    least_turn,
    posture,
)
from tools.fitting.error_measurement import errors

FRAMES = 5


@pytest.fixture(scope="module")
def skeleton() -> Skeleton:
    return load_skeleton()


@pytest.fixture(scope="module")
def posed(skeleton: Skeleton) -> Floats:
    """A body whose every bone is turned a little, 2.5 m away."""
    rng = np.random.default_rng(1)
    turns = from_vector(0.25 * rng.standard_normal((FRAMES, len(skeleton), 3)))
    return skeleton.transforms(turns, np.tile([0.3, 1.0, 2.5], (FRAMES, 1)))


def no_change() -> dict[tuple[Group, str], Floats]:
    sizes = {"place": 3, "trunk": 9, "arm": 12, "leg": 9}
    return {key: np.zeros((FRAMES, sizes[key[0]])) for key in all_groups()}


def test_a_body_that_is_not_changed_stays(skeleton: Skeleton, posed: Floats) -> None:
    held = change_posture(skeleton, posed, posture(skeleton, posed), no_change())
    np.testing.assert_allclose(held, posed, atol=1e-12)


def test_what_is_changed_is_read_again(skeleton: Skeleton, posed: Floats) -> None:
    true, change = posture(skeleton, posed), no_change()
    rng = np.random.default_rng(2)
    for key, values in change.items():
        values += 0.1 * rng.standard_normal(values.shape)
        if key[0] in LIMBS:
            # Only along the unit sphere can a direction change.
            directions = true.limbs[key]
            wanted = directions + values.reshape(directions.shape)
            wanted /= np.linalg.norm(wanted, axis=2, keepdims=True)
            values[:] = (wanted - directions).reshape(values.shape)
    held = change_posture(skeleton, posed, true, change)
    found = posture(skeleton, held, true.axes)
    for key, values in change.items():
        np.testing.assert_allclose(errors(found, true, *key), values, atol=1e-9)


def test_bones_keep_their_lengths_and_stay_together(skeleton: Skeleton, posed: Floats) -> None:
    change = no_change()
    change["arm", "R"] += 0.3
    change["trunk", ""] += 0.2
    held = change_posture(skeleton, posed, posture(skeleton, posed), change)
    turns = held[..., :3]
    np.testing.assert_allclose(
        turns @ np.swapaxes(turns, -1, -2), np.broadcast_to(np.eye(3), turns.shape), atol=1e-9
    )
    for bone, parent in enumerate(skeleton.parents):
        if parent >= 0:
            head = skeleton.heads_m[bone]
            by_itself = turns[:, bone] @ head + held[:, bone, :, 3]
            by_parent = turns[:, parent] @ head + held[:, parent, :, 3]
            np.testing.assert_allclose(by_itself, by_parent, atol=1e-9)


def test_both_sides_are_told_alike(skeleton: Skeleton) -> None:
    rest = skeleton.transforms(
        np.tile(np.eye(3), (1, len(skeleton), 1, 1)), np.array([[0, 0, 3.0]])
    )
    found = posture(skeleton, rest)
    for group in LIMBS:
        np.testing.assert_allclose(found.limbs[group, "L"], found.limbs[group, "R"], atol=0.01)


def test_depth_is_along_the_line_of_sight(skeleton: Skeleton) -> None:
    """A body beside the camera's axis: a metre further along the ray is a metre of depth."""
    rest = np.tile(np.eye(3), (1, len(skeleton), 1, 1))
    place = np.array([[1.0, 0.5, 2.0]]) - skeleton.heads_m[0]
    near = skeleton.transforms(rest, place)
    ray = np.array([1.0, 0.5, 2.0]) / np.linalg.norm([1.0, 0.5, 2.0])
    far = skeleton.transforms(rest, place + ray)
    true = posture(skeleton, near)
    np.testing.assert_allclose(
        errors(posture(skeleton, far, true.axes), true, "place"), [[0, 0, 1]], atol=1e-12
    )


directions = st.lists(st.floats(-1, 1), min_size=3, max_size=3).filter(
    lambda v: np.linalg.norm(v) > 0.1
)


@given(directions, directions)
def test_the_least_turn_is_the_angle_between(before: list[float], after: list[float]) -> None:
    a, b = (np.array(v) / np.linalg.norm(v) for v in (before, after))
    if a @ b < -0.999:
        return  # opposite: no turn is the least
    turn = least_turn(a, b)
    np.testing.assert_allclose(turn @ a, b, atol=1e-7)
    np.testing.assert_allclose(np.trace(turn), 1.0 + 2.0 * a @ b, atol=1e-7)
