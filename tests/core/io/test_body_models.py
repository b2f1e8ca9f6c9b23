"""Vertices of body models against what can be said without the code."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import sparse
from scipy.spatial.transform import Rotation

from sd2core.errors import Sd2Error
from sd2core.io.body_model import BodyModel, fitted_to, read_body_model
from sd2core.io.body_parameters import rotation_matrices
from sd2core.io.mesh import load_mesh
from tests.core.io.body_models import model_arrays, turned_from, write_model

ANGLES = st.floats(-3.0, 3.0)
VECTORS = st.tuples(ANGLES, ANGLES, ANGLES).map(np.array)


@pytest.fixture(scope="module")
def models(tmp_path_factory: pytest.TempPathFactory) -> dict[int, BodyModel]:
    folder = tmp_path_factory.mktemp("models")
    return {n: read_body_model(write_model(folder / f"{n}.npz", n)) for n in (24, 52, 55)}


def posed(model: BodyModel, vectors: Any, betas: Any = ((0.0,),), place: Any = None) -> Any:
    vectors = np.asarray(vectors, np.float64)
    places = np.zeros((len(vectors), 3)) if place is None else np.asarray(place)
    return model.posed(rotation_matrices(vectors), np.asarray(betas), places)


def test_at_rest_it_is_the_template_where_it_is_put(models: dict[int, BodyModel]) -> None:
    model = models[24]
    places = np.array([[0.0, 0.0, 3.0], [1.0, -2.0, 5.0]])
    vertices = posed(model, np.zeros((2, 24, 3)), place=places)
    np.testing.assert_allclose(vertices, model.rest_m + places[:, None], atol=1e-6)
    assert vertices.dtype == np.float32


@settings(deadline=None, max_examples=25)
@given(joint=st.integers(0, 23), vector=VECTORS)
def test_one_joint_turns_what_hangs_on_it(
    models: dict[int, BodyModel], joint: int, vector: Any
) -> None:
    vectors = np.zeros((1, 24, 3))
    vectors[0, joint] = vector
    expected = turned_from(joint, Rotation.from_rotvec(vector).as_matrix())
    np.testing.assert_allclose(posed(models[24], vectors)[0], expected, atol=1e-5)


@settings(deadline=None, max_examples=25)
@given(first=VECTORS, root=VECTORS)
def test_the_root_turns_any_pose_as_a_whole(
    models: dict[int, BodyModel], first: Any, root: Any
) -> None:
    """About where the root lies, whatever the pose of the others."""
    vectors = np.random.default_rng(0).normal(size=(1, 24, 3)) + np.asarray(first)
    vectors[0, 0] = 0.0
    straight = posed(models[24], vectors)[0]
    vectors[0, 0] = root
    turn = Rotation.from_rotvec(root).as_matrix()
    np.testing.assert_allclose(posed(models[24], vectors)[0], straight @ turn.T, atol=2e-5)


@settings(deadline=None, max_examples=25)
@given(betas=st.lists(st.floats(-2.0, 2.0), min_size=4, max_size=4))
def test_shapes_add_up_at_rest(models: dict[int, BodyModel], betas: list[float]) -> None:
    model = models[24]
    expected = model.rest_m + sum(
        beta * model.shapes_m[..., number] for number, beta in enumerate(betas)
    )
    np.testing.assert_allclose(posed(model, np.zeros((1, 24, 3)), [betas])[0], expected, atol=1e-5)


def test_joints_follow_the_shape(models: dict[int, BodyModel]) -> None:
    """A body twice as large turns about joints twice as far apart."""
    vectors = np.zeros((1, 24, 3))
    vectors[0, 7] = [0.3, 0.2, -0.5]
    expected = 2.0 * turned_from(7, Rotation.from_rotvec(vectors[0, 7]).as_matrix())
    np.testing.assert_allclose(posed(models[24], vectors, [[1.0]])[0], expected, atol=1e-5)


def test_a_shape_per_frame_is_that_of_each_frame(models: dict[int, BodyModel]) -> None:
    vectors = np.random.default_rng(1).normal(size=(5, 24, 3))
    betas = np.random.default_rng(2).normal(size=(5, 4))
    together = posed(models[24], vectors, betas)
    for frame in range(5):
        alone = posed(models[24], vectors[frame : frame + 1], betas[frame : frame + 1])
        np.testing.assert_allclose(together[frame], alone[0], atol=1e-6)


def test_poses_correct_the_surface_before_it_is_turned(tmp_path: Path) -> None:
    """By R - 1 of all joints but the root, in their order, row by row."""
    model = read_body_model(write_model(tmp_path / "m.npz", corrected=True))
    arrays = model_arrays(corrected=True)
    vectors = np.zeros((1, 24, 3))
    vectors[0, 3] = [0.4, -0.2, 0.1]
    turn = Rotation.from_rotvec(vectors[0, 3]).as_matrix()
    features = np.zeros((23, 3, 3))
    features[2] = turn - np.eye(3)
    expected = arrays["v_template"] + arrays["posedirs"] @ features.ravel()
    pivot = np.array([0.3, 0.0, 0.0])
    expected[24:] = (expected[24:] - pivot) @ turn.T + pivot
    np.testing.assert_allclose(posed(model, vectors)[0], expected, atol=1e-5)


def test_many_frames_are_those_posed_one_by_one(
    models: dict[int, BodyModel], monkeypatch: pytest.MonkeyPatch
) -> None:
    vectors = np.random.default_rng(3).normal(size=(9, 24, 3))
    whole = posed(models[24], vectors)
    monkeypatch.setattr("sd2core.io.body_model._CHUNK_BYTES", 1)
    np.testing.assert_allclose(posed(models[24], vectors), whole, atol=1e-6)


@pytest.mark.parametrize(("theirs", "ours"), [(24, 52), (52, 24), (52, 55), (55, 52), (22, 55)])
def test_poses_go_over_to_another_model(
    models: dict[int, BodyModel], theirs: int, ours: int
) -> None:
    turns = rotation_matrices(np.random.default_rng(4).normal(size=(2, theirs, 3)))
    there = fitted_to(models[ours], turns)
    np.testing.assert_array_equal(there[:, :22], turns[:, :22])
    fingers = {52: slice(22, 52), 55: slice(25, 55)}
    if theirs in fingers and ours in fingers:
        np.testing.assert_array_equal(there[:, fingers[ours]], turns[:, fingers[theirs]])
    elif ours in fingers:
        np.testing.assert_array_equal(there[:, fingers[ours]], np.tile(np.eye(3), (2, 30, 1, 1)))


def test_a_pickled_model_is_the_same(tmp_path: Path, models: dict[int, BodyModel]) -> None:
    arrays = model_arrays()
    arrays["J_regressor"] = sparse.csc_matrix(arrays["J_regressor"])
    (tmp_path / "SMPL_NEUTRAL.pkl").write_bytes(pickle.dumps(arrays, 2))
    model = read_body_model(tmp_path / "SMPL_NEUTRAL.pkl")
    vectors = np.random.default_rng(5).normal(size=(1, 24, 3))
    np.testing.assert_allclose(posed(model, vectors), posed(models[24], vectors), atol=1e-6)


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"weights": None}, "lacks weights"),
        ({"weights": np.ones((3, 24))}, "do not agree"),
        ({"posedirs": np.ones((192, 3, 9))}, "posedirs for 9 numbers"),
        ({"f": np.array([[0, 1, 192]])}, "faces of vertices"),
        ({"v_template": np.full((192, 3), np.nan)}, "v_template is not finite"),
        ({"kintree_table": np.array([[0, 5, *[0] * 22], range(24)])}, "after its parent"),
    ],
)
def test_what_is_no_model_is_named(tmp_path: Path, change: dict[str, Any], text: str) -> None:
    arrays = {k: v for k, v in (model_arrays() | change).items() if v is not None}
    np.savez(tmp_path / "m.npz", **arrays)
    with pytest.raises(Sd2Error, match=rf"m\.npz.*{text}"):
        read_body_model(tmp_path / "m.npz")


def capture(frames: int, joints: int = 52) -> dict[str, Any]:
    """Motion as AMASS keeps it, z up."""
    noise = np.random.default_rng(frames)
    return {
        "poses": noise.normal(size=(frames, 3 * joints)) * 0.2,
        "betas": noise.normal(size=16) * 0.1,
        "trans": noise.normal(size=(frames, 3)),
        "dmpls": np.zeros((frames, 8)),
        "gender": np.array("neutral"),
        "mocap_framerate": np.array(120.0),
    }


def test_amass_motion_needs_no_video(tmp_path: Path, models: dict[int, BodyModel]) -> None:
    amass = capture(6)
    np.savez(tmp_path / "walk_poses.npz", **amass)
    model = write_model(tmp_path / "SMPLH.npz", 52)
    mesh = load_mesh(tmp_path / "walk_poses.npz", body_model=model, distance_m=4.0)
    np.testing.assert_allclose(np.diff(mesh.times_s), 1 / 120, rtol=1e-9)
    theirs = posed(
        models[52], amass["poses"].reshape(6, 52, 3), [amass["betas"]], amass["trans"]
    ).astype(np.float64)
    # x stays, what was up is minus y, what was ahead is depth.
    expected = np.stack([theirs[..., 0], -theirs[..., 2], theirs[..., 1] + 4.0], axis=-1)
    np.testing.assert_allclose(mesh.read(0, 6), expected, atol=1e-5)
    assert mesh.faces is not None
    assert any("without a camera" in note for note in mesh.notes)


def test_aist_motion_is_in_centimetres_and_y_up(tmp_path: Path) -> None:
    motion = {
        "smpl_poses": np.zeros((4, 72)),
        "smpl_scaling": np.array([95.0]),
        "smpl_trans": np.tile([95.0, 190.0, -285.0], (4, 1)),
    }
    (tmp_path / "gBR.pkl").write_bytes(pickle.dumps(motion))
    model = write_model(tmp_path / "SMPL.npz")
    mesh = load_mesh(tmp_path / "gBR.pkl", body_model=model)
    rest = model_arrays()["v_template"] * 0.95 + [0.95, 1.90, -2.85]
    # Its bodies are the model's, scaled: 95 centimetres for each of its metres.
    np.testing.assert_allclose(mesh.frame(0), rest * [1.0, -1.0, -1.0], atol=1e-6)
    np.testing.assert_allclose(np.diff(mesh.times_s), 1 / 60, rtol=1e-9)


def test_parameters_without_a_model_say_what_is_missing(tmp_path: Path) -> None:
    np.savez(tmp_path / "walk_poses.npz", **capture(3))
    with pytest.raises(Sd2Error, match=r"body parameters and no vertices.*--body-model"):
        load_mesh(tmp_path / "walk_poses.npz")


def test_shapes_of_another_family_are_left_out_and_said(tmp_path: Path) -> None:
    np.savez(tmp_path / "walk_poses.npz", **capture(3) | {"poses": np.zeros((3, 72))})
    model = write_model(tmp_path / "SMPLX.npz", 55)
    mesh = load_mesh(tmp_path / "walk_poses.npz", body_model=model, distance_m=5.0)
    assert any("average shape" in note for note in mesh.notes)
    size = np.ptp(mesh.frame(0), axis=0)
    np.testing.assert_allclose(
        size, np.ptp(model_arrays(55)["v_template"], axis=0)[[0, 2, 1]], atol=1e-5
    )


def test_more_frames_than_memory_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sd2core.io.body_model._MAX_BYTES", 10**4)
    np.savez(tmp_path / "long.npz", **capture(10))
    model = write_model(tmp_path / "SMPLH.npz", 52)
    with pytest.raises(Sd2Error, match=r"10 frames of 416 vertices.*Cut the motion"):
        load_mesh(tmp_path / "long.npz", body_model=model)


def test_parameters_that_do_not_agree_are_named(tmp_path: Path) -> None:
    model = write_model(tmp_path / "SMPLH.npz", 52)
    for change in (
        {"trans": np.zeros((2, 3))},
        {"betas": np.zeros((3, 10))},
        {"poses": np.ones((4, 7))},
    ):
        np.savez(tmp_path / "odd.npz", **capture(4) | change)
        with pytest.raises(Sd2Error, match=r"odd\.npz: its body parameters do not agree"):
            load_mesh(tmp_path / "odd.npz", body_model=model)
