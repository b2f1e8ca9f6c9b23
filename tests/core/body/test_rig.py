from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sd2core.body.initial import Pose, initial_pose
from sd2core.body.rig import JOINT, JOINTS, KeypointSpace, Rig
from sd2core.body.rotations import aligning, from_vector, to_vector
from sd2core.body.shape import ShapeSpace
from sd2core.body.track import LANDMARKS

SPACE = ShapeSpace()
seeds = st.integers(0, 2**31)


def rig_of(rng: np.random.Generator) -> Rig:
    shape = SPACE.random(rng)
    return Rig(SPACE.skeleton(shape), KeypointSpace(SPACE).of(shape))


def random_pose(rig: Rig, rng: np.random.Generator, frames: int = 4, size: float = 0.5) -> Pose:
    turns = np.stack(
        [
            from_vector(size * rng.standard_normal((frames, axes.shape[1])) @ axes.T)
            for axes in rig.axes
        ],
        axis=1,
    )
    return Pose(turns, rng.standard_normal((frames, 3)) + np.array([0.0, 1.0, 3.0]))


def positions(rig: Rig, pose: Pose) -> np.ndarray:
    return rig.keypoints.positions(rig.transforms(*pose))


@settings(max_examples=10, deadline=None)
@given(seeds)
def test_jacobian_is_the_derivative(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rig = rig_of(rng)
    pose = random_pose(rig, rng)
    transforms = rig.transforms(*pose)
    jacobian = rig.jacobian(transforms, rig.marks.positions(transforms))
    step = 1e-6
    for freedom in rng.choice(rig.freedoms, 12, replace=False):
        ends = []
        for sign in (1.0, -1.0):
            turns, translation = pose.turns.copy(), pose.translation_m.copy()
            if freedom >= rig.freedoms - 3:
                translation[:, freedom - rig.freedoms + 3] += sign * step
            for number, columns in enumerate(rig.columns):
                if columns.start <= freedom < columns.stop:
                    axis = rig.axes[number][:, freedom - columns.start]
                    turns[:, number] = turns[:, number] @ from_vector(sign * step * axis)
            ends.append(rig.marks.positions(rig.transforms(turns, translation)))
        np.testing.assert_allclose(
            jacobian[..., freedom], (ends[0] - ends[1]) / (2 * step), atol=1e-8
        )


@settings(max_examples=10, deadline=None)
@given(seeds)
def test_initial_pose_finds_the_limbs_of_a_posed_body(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rig = rig_of(rng)
    pose = random_pose(rig, rng, size=0.3)
    # Shoulder girdles are left at rest by the first pose.
    for side in "LR":
        pose.turns[:, JOINT[f"clavicle.{side}"]] = np.eye(3)
    # Three bones of the spine take its turn one after another, so that it bends by 0.3 as well.
    spine = JOINT["spine"]
    pose.turns[:, spine] = from_vector(0.1 * rng.standard_normal((len(pose.turns), 3)))
    seen = positions(rig, pose)
    found = positions(rig, initial_pose(rig, seen, np.ones(seen.shape[:2])))
    away = np.linalg.norm(found - seen, axis=2)
    assert np.median(away) < 0.08
    assert away.max() < 0.30


def test_rest_is_found_exactly() -> None:
    rig = rig_of(np.random.default_rng(0))
    turns = np.tile(np.eye(3), (1, len(JOINTS), 1, 1))
    seen = positions(rig, Pose(turns, np.array([[0.1, 1.0, 2.5]])))
    pose = initial_pose(rig, seen, np.ones((1, len(LANDMARKS))))
    np.testing.assert_allclose(pose.turns, turns, atol=1e-6)
    np.testing.assert_allclose(pose.translation_m, [[0.1, 1.0, 2.5]], atol=1e-6)


@settings(max_examples=20, deadline=None)
@given(seeds)
def test_rotation_vectors_go_both_ways(seed: int) -> None:
    rng = np.random.default_rng(seed)
    vectors = rng.standard_normal((5, 2, 3))
    vectors *= rng.uniform(0.0, 3.1, (5, 2, 1)) / np.linalg.norm(vectors, axis=-1, keepdims=True)
    turns = from_vector(vectors)
    np.testing.assert_allclose(
        turns @ np.swapaxes(turns, -1, -2), np.tile(np.eye(3), (5, 2, 1, 1)), atol=1e-12
    )
    np.testing.assert_allclose(to_vector(turns), vectors, atol=1e-7)


@settings(max_examples=20, deadline=None)
@given(seeds)
def test_aligning_finds_the_rotation(seed: int) -> None:
    rng = np.random.default_rng(seed)
    turn = from_vector(rng.standard_normal((3, 3)))
    rest = rng.standard_normal((3, 4, 3))
    seen = np.einsum("tij,tnj->tni", turn, rest)
    np.testing.assert_allclose(aligning(rest, seen, rng.uniform(0.1, 1, (3, 4))), turn, atol=1e-9)


def test_a_forearm_twists_along_itself() -> None:
    rig = rig_of(np.random.default_rng(2))
    pose = random_pose(rig, np.random.default_rng(3), frames=1, size=0.0)
    axis = rig.axes[JOINT["pronation.R"]][:, 0]
    before = positions(rig, pose)[0]
    pose.turns[:, JOINT["pronation.R"]] = from_vector(0.4 * axis)
    after = positions(rig, pose)[0]
    index, wrist = LANDMARKS.index("index.R"), LANDMARKS.index("wrist.R")
    np.testing.assert_allclose(after[wrist], before[wrist], atol=1e-9)
    # Twice 0.4 rad: two bones share the turn.
    hand = before[index] - before[wrist]
    expected = from_vector(0.8 * axis) @ hand
    np.testing.assert_allclose(after[index] - after[wrist], expected, atol=1e-9)
    assert np.linalg.norm(expected - hand) == pytest.approx(
        2 * np.sin(0.4) * np.linalg.norm(hand - (hand @ axis) * axis)
    )
