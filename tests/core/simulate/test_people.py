"""Random people and their motion."""

from __future__ import annotations

import numpy as np
import pytest

from sd2core.body.shape import ShapeSpace
from sd2core.simulate.people.arms import STYLES
from sd2core.simulate.people.motion import Deed, random_motion
from sd2core.simulate.people.signals import Moves, follow, wander
from sd2core.simulate.people.walking import Mode

TIMES = np.arange(45) / 30.0


def test_moves_go_from_pose_to_pose_and_hold() -> None:
    moves = Moves(np.array([0.2, 1.0]), np.array([0.5, 0.4]), np.array([1.0, 1.2]))
    poses = np.array([[0.0, 1.0], [2.0, -1.0], [3.0, 5.0]])
    found = follow(np.array([0.0, 0.8, 0.95, 2.0]), moves, poses)
    np.testing.assert_allclose(found, poses[[0, 1, 1, 2]])


def test_wandering_is_slow_and_of_the_stated_size() -> None:
    times = np.arange(0.0, 400.0, 0.05)
    signal = wander(np.random.default_rng(0), times, 0.5, 3)
    np.testing.assert_allclose(signal.std(axis=0), 1.0, atol=0.15)
    power = np.abs(np.fft.rfft(signal, axis=0)) ** 2
    fast = np.fft.rfftfreq(len(times), 0.05) > 0.6
    assert power[fast].sum() < 0.02 * power.sum()


@pytest.mark.parametrize("legs", ["stand", "walk", "turn", "sit", "shift"])
def test_bones_keep_their_lengths_and_feet_stay_on_the_floor(legs: Mode) -> None:
    rng = np.random.default_rng(3)
    space = ShapeSpace()
    shape = space.random(rng)
    skeleton = space.skeleton(shape)
    deed = Deed(legs, (STYLES["strokes"], STYLES["wave"]), False)
    motion = random_motion(rng, skeleton, shape.stature_m, TIMES, deed)
    transforms = skeleton.transforms(*motion)
    heads = (transforms[..., :3] @ skeleton.heads_m[..., None])[..., 0] + transforms[..., 3]
    ankles = heads[:, [skeleton.index["foot.L"], skeleton.index["foot.R"]], 1]
    assert ankles.max() < skeleton.heads_m[skeleton.index["foot.L"], 1] + 0.04
    for bone in ("lowerarm01.L", "wrist.R", "lowerleg01.R"):
        row = skeleton.index[bone]
        parent = skeleton.parents[row]
        length = np.linalg.norm(heads[:, row] - heads[:, parent], axis=1)
        np.testing.assert_allclose(length, length[0])
    turns = motion.rotations
    np.testing.assert_allclose(turns @ np.swapaxes(turns, -1, -2), np.eye(3) + 0 * turns, atol=1e-9)


@pytest.mark.parametrize("seed", range(3))
def test_the_feet_of_a_walker_stay_below_the_body(seed: int) -> None:
    """Also where the take begins and ends within a step."""
    rng = np.random.default_rng(seed)
    space = ShapeSpace()
    shape = space.random(rng)
    skeleton = space.skeleton(shape)
    deed = Deed("walk", (STYLES["strokes"], STYLES["wave"]), False)
    transforms = skeleton.transforms(*random_motion(rng, skeleton, shape.stature_m, TIMES, deed))
    heads = (transforms[..., :3] @ skeleton.heads_m[..., None])[..., 0] + transforms[..., 3]
    ankles = heads[:, [skeleton.index["foot.L"], skeleton.index["foot.R"]]]
    away_m = np.linalg.norm((ankles - heads[:, :1])[..., [0, 2]], axis=-1)
    assert away_m.max() < 0.5


def test_a_still_deed_is_still() -> None:
    rng = np.random.default_rng(4)
    space = ShapeSpace()
    shape = space.random(rng)
    skeleton = space.skeleton(shape)
    deed = Deed("stand", (STYLES["rest"], STYLES["strokes"]), True)
    transforms = skeleton.transforms(*random_motion(rng, skeleton, 1.7, TIMES, deed))
    heads = (transforms[..., :3] @ skeleton.heads_m[..., None])[..., 0] + transforms[..., 3]
    assert np.abs(np.gradient(heads, 1.0 / 30.0, axis=0)).max() < 0.08


def test_hands_below_the_chin_stay_outside_the_trunk() -> None:
    """An upright elliptic column about the spine, whichever way the chest is turned."""
    space = ShapeSpace()
    deed = Deed("stand", (STYLES["strokes"], STYLES["strokes"]), False)
    times_s = np.arange(90) / 30.0
    for seed in range(6):
        rng = np.random.default_rng(seed)
        shape = space.random(rng)
        skeleton = space.skeleton(shape)
        motion = random_motion(rng, skeleton, shape.stature_m, times_s, deed)
        transforms, index = skeleton.transforms(*motion), skeleton.index
        heads = (transforms[..., :3] @ skeleton.heads_m[..., None])[..., 0] + transforms[..., 3]
        chest = transforms[:, index["spine01"], :, :3]
        half_m = skeleton.heads_m[index["upperarm01.L"], 0]
        for side in "LR":
            upper_arm, wrist = (index[f"{name}.{side}"] for name in ("upperarm01", "wrist"))
            reach_m = np.einsum("tji,tj->ti", chest, heads[:, wrist] - heads[:, upper_arm])
            at_m = skeleton.heads_m[upper_arm] + reach_m
            below = at_m[:, 1] > skeleton.heads_m[upper_arm, 1] + 0.1
            from_spine_m = (at_m - skeleton.heads_m[index["spine02"]])[below]
            across, ahead = from_spine_m[:, 0], from_spine_m[:, 2]
            assert np.hypot(across / half_m, ahead / (0.85 * half_m)).min(initial=2.0) > 1.0
