"""Parts of the body are found by the surface alone."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from sd2core.body.model import Body
from sd2core.body.parts import body_parts, parts_by_shape
from sd2core.body.rotations import about
from sd2core.files.resources import resource_path
from sd2core.io.mesh import load_mesh
from sd2core.mesh.decimation import decimate
from sd2core.mesh.sequence import MeshSequence
from sd2core.mesh.vertex_parts import PARTS
from sd2core.timebase import Timebase


def still(vertices_m: np.ndarray, faces: np.ndarray | None) -> MeshSequence:
    return MeshSequence(vertices_m[None], faces, Timebase(np.zeros(1)))


def known(body: Body) -> np.ndarray:
    parts = body_parts(still(body.vertices_m, body.faces))
    assert parts is not None
    assert parts.names == PARTS
    return parts.numbers


def test_the_bundled_body_has_every_part_on_its_own_side() -> None:
    body = Body.load("low")
    numbers = known(body)
    wrist = body.skeleton.heads_m[body.skeleton.index["wrist.L"]]
    side = np.sign(wrist[0])
    for number, name in enumerate(PARTS):
        middle = body.vertices_m[numbers == number].mean(axis=0)
        if name != "trunk":
            assert np.sign(middle[0]) == (side if name.endswith(".L") else -side)


@pytest.mark.slow
@settings(max_examples=12, deadline=None)
@given(
    resolution=st.sampled_from(["low", "medium", "high"]),
    turn=st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda axis: np.linalg.norm(axis) > 0.1),
    angle_deg=st.floats(0.0, 360.0),
    scale=st.floats(0.4, 1.6),
    seed=st.integers(0, 99),
)
def test_any_surface_of_a_body_takes_them_over(
    resolution: str, turn: tuple[float, ...], angle_deg: float, scale: float, seed: int
) -> None:
    """In any order of its vertices, of any size, turned anyhow, at any place."""
    body = Body.load(resolution)  # type: ignore[arg-type]
    order = np.random.default_rng(seed).permutation(len(body.vertices_m))
    axis = np.array(turn) / np.linalg.norm(turn)
    points_m = scale * body.vertices_m @ about(axis, np.array([angle_deg]))[0].T + [1.0, -2.0, 4.0]
    found = parts_by_shape(points_m[order], np.argsort(order)[body.faces].astype(np.int32))
    assert found is not None
    assert (found == known(body)[order]).mean() > 0.97


@pytest.mark.one_in(3)
@pytest.mark.parametrize("frame", [0, 100, 250, 400])
def test_a_moving_body_keeps_them_also_when_decimated(frame: int) -> None:
    mesh = load_mesh(resource_path("swipes.sd2") / "mesh.zarr")
    truth = body_parts(mesh)
    assert truth is not None
    points_m = mesh.frame(frame).astype(np.float64)
    found = parts_by_shape(points_m, mesh.faces)  # type: ignore[arg-type]
    assert found is not None
    assert (found == truth.numbers).mean() > 0.97
    small = decimate(mesh.between(frame, frame + 2), 0.2)
    parts = body_parts(small)
    assert parts is not None
    nearest = np.linalg.norm(points_m - small.frame(0)[:, None], axis=-1).argmin(axis=1)
    assert (parts.numbers == truth.numbers[nearest]).mean() > 0.93


def test_loose_pieces_belong_to_what_is_nearest() -> None:
    body = Body.load("low")
    ball = trimesh.creation.icosphere(subdivisions=1, radius=0.01)
    hand = body.skeleton.heads_m[body.skeleton.index["wrist.R"]]
    vertices_m = np.concatenate([body.vertices_m, ball.vertices + hand])
    faces = np.concatenate([body.faces, ball.faces + len(body.vertices_m)]).astype(np.int32)
    found = parts_by_shape(vertices_m, faces)
    assert found is not None
    assert set(found[len(body.vertices_m) :]) == {PARTS.index("forearm.R")}


def test_what_is_no_body_has_no_parts() -> None:
    ball = trimesh.creation.icosphere(subdivisions=3)
    box = trimesh.creation.box((0.5, 1.8, 0.3)).subdivide_loop(3)
    for surface in (ball, box):
        assert body_parts(still(surface.vertices, surface.faces.astype(np.int32))) is None
    body = Body.load("low")
    assert body_parts(still(body.vertices_m, None)) is None
    two = np.concatenate([body.vertices_m, body.vertices_m + 3.0])
    faces = np.concatenate([body.faces, body.faces + len(body.vertices_m)]).astype(np.int32)
    assert body_parts(still(two, faces)) is None
    gone = body.vertices_m.copy()
    gone[3] = np.nan
    assert parts_by_shape(gone, body.faces[::-1].copy()) is None


def test_a_mesh_is_searched_once(monkeypatch: pytest.MonkeyPatch) -> None:
    searched = []
    monkeypatch.setattr(
        "sd2core.body.parts.parts_by_shape", lambda *surface: searched.append(surface)
    )
    for _ in range(2):
        mesh = still(np.eye(3, dtype=np.float32), np.array([[0, 1, 2]], np.int32))
        assert body_parts(mesh) is None
        assert body_parts(mesh) is None
    assert len(searched) == 2
