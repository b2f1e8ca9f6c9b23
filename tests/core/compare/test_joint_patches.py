from __future__ import annotations

import numpy as np
import pytest

from sd2core.body.model import Body, Resolution, own_resolution
from sd2core.body.rotations import about
from sd2core.compare.joints import (
    GROUPS,
    JOINTS,
    carry_patches,
    own_patches,
    rows_of,
)
from sd2core.errors import Sd2Error
from sd2core.mesh.sequence import MeshSequence
from sd2core.timebase import Timebase
from tools.build_sample.swipes import posed

BONES = {
    "pelvis": "root",
    "shoulder.R": "upperarm01.R",
    "elbow.L": "lowerarm01.L",
    "wrist.R": "wrist.R",
    "knee.L": "lowerleg01.L",
    "ankle.R": "foot.R",
}


def bent(resolution: Resolution) -> tuple[np.ndarray, np.ndarray, Body]:
    """Vertices and bones' heads of a body that bends its arms, turns and walks off."""
    body = Body.load(resolution)
    angle = np.linspace(0.0, 60.0, 8)
    turns = np.tile(np.eye(3), (8, len(body.skeleton), 1, 1))
    for bone in ("lowerarm01.L", "lowerarm01.R", "upperleg01.L", "root"):
        turns[:, body.skeleton.index[bone]] = about(np.array([1.0, 0.0, 0.0]), -0.7 * angle)
    move = np.linspace(0, 1, 8)[:, None] * np.array([0.5, 0.0, -1.0]) + [0.0, 1.0, 3.0]
    transforms = body.skeleton.transforms(turns, move)
    heads = (transforms[..., :3] @ body.skeleton.heads_m[..., None])[..., 0] + transforms[..., 3]
    return posed(body, turns, move), heads, body


def sequence(vertices: np.ndarray, faces: np.ndarray | None) -> MeshSequence:
    return MeshSequence(vertices, faces, Timebase(np.arange(len(vertices)) / 30.0))


def test_every_joint_once_and_groups_of_them() -> None:
    assert len(set(JOINTS)) == len(JOINTS) == 18
    for group in GROUPS.values():
        assert [JOINTS[row] for row in rows_of(group)] == list(group)


@pytest.mark.parametrize("resolution", ["low", "medium", "high"])
def test_patches_give_the_joints_of_the_body_at_rest(resolution: Resolution) -> None:
    body = Body.load(resolution)
    joints = own_patches(resolution).positions(body.vertices_m)
    for joint, bone in BONES.items():
        np.testing.assert_allclose(
            joints[JOINTS.index(joint)],
            body.skeleton.heads_m[body.skeleton.index[bone]],
            atol=1e-9,
        )


@pytest.mark.parametrize("resolution", ["low", "medium", "high"])
def test_patches_follow_the_joints(resolution: Resolution) -> None:
    vertices, heads, body = bent(resolution)
    joints = own_patches(resolution).positions(vertices)
    for joint, bone in BONES.items():
        away = np.linalg.norm(
            joints[:, JOINTS.index(joint)] - heads[:, body.skeleton.index[bone]], axis=1
        )
        assert away.max() < 0.02, joint


def test_no_patch_hangs_on_few_vertices() -> None:
    for resolution in ("low", "medium", "high"):
        for weights in own_patches(resolution).weights:
            assert weights.sum() == pytest.approx(1.0)
            assert (weights**2).sum() < 0.15


def test_a_surface_of_ours_is_known_by_its_faces() -> None:
    body = Body.load("low")
    vertices = body.vertices_m[None]
    assert own_resolution(sequence(vertices, body.faces)) == "low"
    assert own_resolution(sequence(vertices, body.faces[::-1].copy())) is None
    assert own_resolution(sequence(vertices, None)) is None


@pytest.mark.parametrize("aside", [(0.0, 0.0, 0.0), (0.3, -0.1, 0.8)])
def test_another_surface_takes_the_patches_over(aside: tuple[float, float, float]) -> None:
    """The fine surface, shuffled and shifted, stands in for one that is not ours."""
    coarse, _, body = bent("medium")
    fine, heads, _ = bent("high")
    shuffled = fine[:, np.random.default_rng(0).permutation(fine.shape[1])] + np.array(aside)
    carried = carry_patches(own_patches("medium"), coarse, shuffled)
    assert carried.distance_m < 0.01
    joints = carried.patches.positions(shuffled)
    for joint, bone in BONES.items():
        away = np.linalg.norm(
            joints[:, JOINTS.index(joint)] - heads[:, body.skeleton.index[bone]] - aside, axis=1
        )
        assert away.max() < 0.025, joint


def test_the_frame_in_which_both_are_closest_is_used() -> None:
    coarse, _, _ = bent("low")
    other = coarse.copy()
    rng = np.random.default_rng(1)
    for frame in (0, 1, 2, 4, 5, 6, 7):
        other[frame] += rng.normal(scale=0.03, size=other[frame].shape)
    assert carry_patches(own_patches("low"), coarse, other).frame == 3


@pytest.mark.parametrize("scale", [0.001, 0.4, 1000.0])
def test_another_scale_is_refused(scale: float) -> None:
    coarse, _, _ = bent("low")
    with pytest.raises(Sd2Error, match="cm apart"):
        carry_patches(own_patches("low"), coarse, scale * coarse)
