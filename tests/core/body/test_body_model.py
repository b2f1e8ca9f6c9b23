from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from sd2core.body import model
from sd2core.body.model import Body, Resolution, vertex_normals
from sd2core.body.rotations import about
from sd2core.errors import Sd2Error
from sd2core.files.resources import resource_path
from tools.build_sample.swipes import posed

SURFACES: tuple[tuple[Resolution, int], ...] = (("low", 1229), ("medium", 5000), ("high", 13348))


@pytest.fixture(scope="module")
def body() -> Body:
    return Body.load("medium")


def at_rest(body: Body, frames: int) -> np.ndarray:
    return np.tile(np.eye(3), (frames, len(body.skeleton), 1, 1))


def random_pose(body: Body, frames: int) -> np.ndarray:
    rng = np.random.default_rng(11)
    turns = at_rest(body, frames)
    for bone in range(len(body.skeleton)):
        axis = rng.normal(size=3)
        turns[:, bone] = about(axis / np.linalg.norm(axis), rng.uniform(-30, 30, frames))
    return turns


@pytest.mark.parametrize(("resolution", "vertices"), SURFACES)
def test_each_surface_is_one_closed_component_facing_outwards(
    resolution: Resolution, vertices: int
) -> None:
    body = Body.load(resolution)
    surface = trimesh.Trimesh(body.vertices_m, body.faces, process=False)
    assert len(body.vertices_m) == vertices
    assert surface.is_watertight
    assert surface.is_winding_consistent
    assert surface.body_count == 1
    assert 0.065 < surface.volume < 0.08  # positive: outwards; litres of an adult


@pytest.mark.parametrize(("resolution", "vertices"), SURFACES)
def test_it_stands_on_the_floor_and_faces_the_camera(resolution: Resolution, vertices: int) -> None:
    body = Body.load(resolution)
    bones = body.skeleton
    assert abs(body.vertices_m[:, 1].max()) < 0.005
    assert -1.9 < body.vertices_m[:, 1].min() < -1.8
    toe, heel = (bones.heads_m[bones.index[name]] for name in ("toe2-1.L", "foot.L"))
    assert toe[2] < heel[2]
    assert bones.heads_m[bones.index["wrist.L"], 0] > 0.3  # its left is on the right of the image


def test_medium_keeps_vertices_of_high() -> None:
    high, medium = Body.load("high"), Body.load("medium")
    rows = {tuple(p): k for k, p in enumerate(high.vertices_m)}
    chosen = np.array([rows[tuple(p)] for p in medium.vertices_m])
    np.testing.assert_array_equal(high.weights[chosen], medium.weights)
    np.testing.assert_array_equal(high.bones[chosen], medium.bones)


def test_weights_add_up_to_one(body: Body) -> None:
    np.testing.assert_allclose(body.weights.sum(axis=1), 1.0, atol=1e-12)
    assert (np.diff(body.weights, axis=1) <= 0).all()


def test_identity_is_the_rest_pose(body: Body) -> None:
    found = posed(body, at_rest(body, 2))
    np.testing.assert_allclose(found, np.stack([body.vertices_m] * 2), atol=1e-12)


def test_turning_the_root_moves_the_body_rigidly(body: Body) -> None:
    turns = at_rest(body, 3)
    angles = np.array([0.0, 40.0, 170.0])
    axis = np.array([2.0, -1.0, 2.0]) / 3.0
    turns[:, 0] = about(axis, angles)
    shift = np.array([[0.0, 0.0, 0.0], [1.0, 2.0, 3.0], [-4.0, 0.5, 9.0]])
    root = body.skeleton.heads_m[0]
    expected = (body.vertices_m - root) @ np.swapaxes(about(axis, angles), 1, 2)
    expected += root + shift[:, None]
    np.testing.assert_allclose(posed(body, turns, shift), expected, atol=1e-12)


def test_bones_keep_their_lengths(body: Body) -> None:
    skeleton = body.skeleton
    transforms = skeleton.transforms(random_pose(body, 5))

    def moved(points: np.ndarray) -> np.ndarray:
        turned = np.einsum("tbij,bj->tbi", transforms[..., :3], points)
        return turned + transforms[..., 3]

    heads, parents = moved(skeleton.heads_m), np.array(skeleton.parents[1:])
    lengths = np.linalg.norm(heads[:, 1:] - heads[:, parents], axis=2)
    rest = np.linalg.norm(skeleton.heads_m[1:] - skeleton.heads_m[parents], axis=1)
    np.testing.assert_allclose(lengths, np.broadcast_to(rest, lengths.shape), atol=1e-12)
    child = skeleton.index["lowerarm01.R"]
    above = transforms[:, skeleton.parents[child]]
    joint = np.einsum("tij,j->ti", above[..., :3], skeleton.heads_m[child]) + above[..., 3]
    np.testing.assert_allclose(heads[:, child], joint, atol=1e-12)


def test_a_vertex_of_one_bone_follows_it_exactly(body: Body) -> None:
    turns = random_pose(body, 2)
    transforms = body.skeleton.transforms(turns)
    vertex = int(np.flatnonzero(body.weights[:, 0] == 1.0)[0])
    bone = transforms[:, body.bones[vertex, 0]]
    expected = bone[..., :3] @ body.vertices_m[vertex] + bone[..., 3]
    np.testing.assert_allclose(posed(body, turns)[:, vertex], expected, atol=1e-12)


def test_normals_point_outwards(body: Body) -> None:
    normals = vertex_normals(body.vertices_m, body.faces)
    reference = trimesh.Trimesh(body.vertices_m, body.faces, process=False)
    inside = reference.contains(body.vertices_m[::50] - 1e-4 * normals[::50])
    outside = reference.contains(body.vertices_m[::50] + 1e-4 * normals[::50])
    assert inside.mean() > 0.98
    assert outside.mean() < 0.02


def test_a_damaged_file_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    broken = tmp_path / "body.npz"
    broken.write_bytes(resource_path("body.npz").read_bytes()[:5000])
    monkeypatch.setattr(model, "resource_path", tmp_path.joinpath)
    with pytest.raises(Sd2Error, match=r"body\.npz cannot be read as a body"):
        Body.load("low")


def test_a_later_version_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(model, "resource_path", tmp_path.joinpath)
    np.savez(tmp_path / "body.npz", meta='{"format": "sd2-body", "version": 99}')
    with pytest.raises(Sd2Error, match="version 99"):
        Body.load("low")
