from __future__ import annotations

import os
import pickle
from collections import defaultdict
from pathlib import Path
from typing import Any

import joblib
import numpy as np
import pytest
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.io.mesh import load_mesh
from sd2core.io.mesh_models import read_model_output, weak_perspective_shift
from sd2core.mesh.presence import runs

WIDTH, HEIGHT, FOCAL_PX = 1280, 720, 900.0


def smpl_like(frames: int, centre: tuple[float, float, float]) -> NDArray[np.float32]:
    generator = np.random.default_rng(frames)
    shape = generator.uniform((-0.3, -0.85, -0.15), (0.3, 0.85, 0.15), (6890, 3))
    return (shape[None] + np.array(centre) + np.zeros((frames, 1, 1))).astype(np.float32)


def wham(frames: int, first: int = 0) -> dict[str, Any]:
    return {
        "pose": np.zeros((frames, 72), np.float32),
        "trans": np.zeros((frames, 3), np.float32),
        "pose_world": np.zeros((frames, 72), np.float32),
        "trans_world": np.zeros((frames, 3), np.float32),
        "betas": np.zeros((frames, 10), np.float32),
        "verts": smpl_like(frames, (0.2, 0.1, 3.5)),
        "frame_ids": np.arange(first, first + frames),
    }


def vibe(frames: int) -> dict[str, Any]:
    """One person walking from 5 m to 4 m, seen by a known pinhole camera.

    Its network sees 1.1 times the box that is in the file.
    """
    depth_m = np.linspace(5, 4, frames)
    centre = np.stack([np.full(frames, 0.8), np.full(frames, -0.3), depth_m], axis=1)
    box_px = FOCAL_PX * 2.2 / depth_m
    middle_px = (centre[:, :2] + [0.1, 0.05]) * FOCAL_PX / depth_m[:, None] + [
        WIDTH / 2,
        HEIGHT / 2,
    ]
    scale = 2 * FOCAL_PX / (depth_m * box_px)
    shift = np.stack([np.full(frames, -0.1), np.full(frames, -0.05)], axis=1)
    return {
        "pred_cam": np.concatenate([scale[:, None], shift], axis=1),
        "verts": smpl_like(frames, (0, 0, 0)),
        "bboxes": np.concatenate([middle_px, *[box_px[:, None] / 1.1] * 2], axis=1),
        "joints2d": None,
        "frame_ids": np.arange(frames),
        "truth_m": centre,
    }


def test_wham_is_read_in_the_cameras_frame(tmp_path: Path) -> None:
    content = {0: wham(5), 2: wham(9)}
    joblib.dump(content, tmp_path / "wham_output.pkl")
    mesh = load_mesh(tmp_path / "wham_output.pkl", frames_per_s=25)
    np.testing.assert_array_equal(mesh.read(0, 9), content[2]["verts"])
    np.testing.assert_allclose(mesh.times_s, np.arange(9) / 25)
    assert mesh.notes[0] == "Person 2 is read, seen longest of: 0 (5 frames), 2 (9 frames)."
    assert "SMPL's" in mesh.notes[1]
    assert len(mesh.notes) == 2


def test_a_person_can_be_chosen(tmp_path: Path) -> None:
    joblib.dump({0: wham(5), 2: wham(9)}, tmp_path / "w.pkl")
    for person in (0, "0"):
        assert load_mesh(tmp_path / "w.pkl", person=person).frame_count == 5
    with pytest.raises(Sd2Error, match=r"w\.pkl holds no person 1.*one of: 0 \(5 frames\), 2"):
        load_mesh(tmp_path / "w.pkl", person=1)


@pytest.mark.parametrize("key", [np.int64, np.int32, np.uint8, str])
def test_people_are_numbered_as_a_tracker_numbers_them(tmp_path: Path, key: Any) -> None:
    content: dict[Any, Any] = defaultdict(dict)  # as WHAM writes its output
    content |= {key(0): wham(5), key(3): wham(9)}
    joblib.dump(content, tmp_path / "wham_output.pkl")
    mesh = load_mesh(tmp_path / "wham_output.pkl")
    assert mesh.frame_count == 9
    assert mesh.notes[0] == "Person 3 is read, seen longest of: 0 (5 frames), 3 (9 frames)."
    chosen = load_mesh(tmp_path / "wham_output.pkl", person=0)
    assert chosen.frame_count == 5
    assert chosen.notes[0] == "Person 0 is read, as asked, of: 0 (5 frames), 3 (9 frames)."


@pytest.mark.parametrize(
    "stored",
    [
        lambda v: v[None],
        list,
        lambda v: [one[None] for one in v],
        lambda v: v.astype(np.float64),
        lambda v: v.astype(np.float16),
        lambda v: np.asfortranarray(v),
        lambda v: v.astype(">f4"),
    ],
    ids=["batch", "list", "list of batches", "double", "half", "fortran", "big endian"],
)
def test_vertices_are_read_however_they_are_nested_and_typed(tmp_path: Path, stored: Any) -> None:
    person = wham(6)
    vertices = person["verts"]
    person["verts"] = stored(vertices)
    person["frame_ids"] = list(range(6))
    joblib.dump({np.int64(1): person}, tmp_path / "w.pkl")
    mesh = load_mesh(tmp_path / "w.pkl", frames_per_s=30)
    np.testing.assert_allclose(mesh.read(0, 6), vertices, atol=2e-3)


def test_frames_keep_their_place_in_the_video(tmp_path: Path) -> None:
    person = wham(6, first=10)
    person["frame_ids"] = np.array([10, 11, 12, 20, 21, 22])
    joblib.dump({1: person}, tmp_path / "w.pkl")
    mesh = load_mesh(tmp_path / "w.pkl", frames_per_s=30)
    # One frame without a person stands for all that are missing.
    np.testing.assert_allclose(mesh.times_s * 30, [10, 11, 12, 13, 20, 21, 22])
    assert runs(~mesh.presence.present) == ((3, 4),)
    there = mesh.presence.present
    np.testing.assert_array_equal(mesh.read(0, 7)[there], person["verts"])
    np.testing.assert_array_equal(mesh.frame(3), person["verts"][2])
    assert any("7 video frames hold no mesh, the first after frame 12" in n for n in mesh.notes)


def test_frame_ids_that_do_not_fit_are_named(tmp_path: Path) -> None:
    person = wham(4)
    person["frame_ids"] = np.arange(3)
    joblib.dump({1: person}, tmp_path / "w.pkl")
    with pytest.raises(Sd2Error, match=r"w\.pkl: 4 frames of vertices but frame_ids of shape"):
        load_mesh(tmp_path / "w.pkl")
    person["frame_ids"] = np.array([3, 2, 4, 5])
    joblib.dump({1: person}, tmp_path / "w.pkl")
    with pytest.raises(Sd2Error, match=r"w\.pkl: Frame 1 is at .*increase"):
        load_mesh(tmp_path / "w.pkl", frames_per_s=30)


def test_vibe_is_placed_by_its_camera(tmp_path: Path) -> None:
    person = vibe(8)
    truth_m = person.pop("truth_m")
    joblib.dump({1: person}, tmp_path / "vibe_output.pkl")
    mesh = load_mesh(
        tmp_path / "vibe_output.pkl",
        frames_per_s=30,
        image_size=(WIDTH, HEIGHT),
        focal_px=FOCAL_PX,
    )
    expected = person["verts"] + truth_m[:, None, :]
    np.testing.assert_allclose(mesh.read(0, 8), expected, atol=1e-5)
    assert any("focal length 900 px, at 4.50 m" in note for note in mesh.notes)


def test_a_placed_body_is_drawn_in_its_box() -> None:
    """What the weak-perspective camera draws at a pixel, the pinhole draws there too."""
    camera = np.array([[0.9, 0.12, -0.2]])
    box = np.array([[400.0, 500.0, 310.0, 310.0]])
    point = np.array([0.25, -0.6, 0.0])  # in the plane of the root, where both agree
    weak = box[0, :2] + 310 / 2 * 0.9 * (point[:2] + camera[0, 1:])
    stands = point + weak_perspective_shift(camera, box, (WIDTH, HEIGHT), FOCAL_PX)[0]
    pinhole = FOCAL_PX * stands[:2] / stands[2] + [WIDTH / 2, HEIGHT / 2]
    np.testing.assert_allclose(pinhole, weak)


def test_the_focal_length_is_assumed_with_a_note(tmp_path: Path) -> None:
    person = vibe(4)
    joblib.dump({1: person}, tmp_path / "v.pkl")
    mesh = load_mesh(tmp_path / "v.pkl", image_size=(600, 800))
    assert any("focal length 1000 px (assumed: the image's diagonal)" in n for n in mesh.notes)


def test_a_root_centred_mesh_says_what_it_lacks(tmp_path: Path) -> None:
    joblib.dump({1: vibe(4)}, tmp_path / "v.pkl")
    notes = load_mesh(tmp_path / "v.pkl").notes
    assert any(
        "walking gives no Doppler" in n and "image_size" in n and "--distance-m" in n for n in notes
    )
    mesh = load_mesh(tmp_path / "v.pkl", distance_m=3.0)
    assert mesh.read(0, 4)[..., 2].mean() == pytest.approx(3.0, abs=0.02)
    assert any("moved 3 m forward; walking gives no Doppler" in n for n in mesh.notes)
    assert not any("Give its distance" in n for n in mesh.notes)


def test_a_hand_close_to_the_camera_is_where_its_file_says(tmp_path: Path) -> None:
    hand = 0.1 * smpl_like(4, (0.0, 0.0, 3.5))
    (tmp_path / "hand.pkl").write_bytes(pickle.dumps({"verts": hand}))
    mesh = load_mesh(tmp_path / "hand.pkl")
    assert not any("centred" in note for note in mesh.notes)
    np.testing.assert_array_equal(mesh.read(0, 4), hand)


def test_an_impossible_camera_is_named(tmp_path: Path) -> None:
    person = vibe(4)
    person["pred_cam"][2, 0] = -0.1
    joblib.dump({1: person}, tmp_path / "v.pkl")
    with pytest.raises(Sd2Error, match=r"v\.pkl: frame 2 has camera scale -0\.1.*--distance-m"):
        load_mesh(tmp_path / "v.pkl", image_size=(WIDTH, HEIGHT))


def test_body_parameters_without_vertices_are_explained(tmp_path: Path) -> None:
    person = wham(4)
    del person["verts"]
    joblib.dump({1: person}, tmp_path / "wham_output.pkl")
    with pytest.raises(
        Sd2Error, match=r"wham_output\.pkl holds body parameters and no vertices.*--body-model"
    ):
        load_mesh(tmp_path / "wham_output.pkl")


def test_a_pickle_without_vertices_says_what_it_holds(tmp_path: Path) -> None:
    (tmp_path / "a.pkl").write_bytes(pickle.dumps({"images": 1, "names": 2}))
    with pytest.raises(Sd2Error, match=r"a\.pkl holds images, names.*'vertices' \(or 'verts'\)"):
        load_mesh(tmp_path / "a.pkl")
    (tmp_path / "a.pkl").write_bytes(pickle.dumps("hello"))
    with pytest.raises(Sd2Error, match=r"a\.pkl: the vertices are a str"):
        load_mesh(tmp_path / "a.pkl")


@pytest.mark.parametrize("form", ["array", "dict", "frames", "batches", "named"])
def test_generic_pickles(tmp_path: Path, form: str) -> None:
    vertices = smpl_like(4, (0, 0, 3))[:, :100]
    content = {
        "array": vertices,
        "dict": {"vertices": vertices, "faces": np.array([[0, 1, 2]]), "fps": 50},
        "frames": {"verts": list(vertices)},
        "batches": {"verts": [frame[None] for frame in vertices]},
        "named": {"person": {"verts": vertices}, "fps": 50.0},
    }[form]
    (tmp_path / "a.pickle").write_bytes(pickle.dumps(content))
    mesh = load_mesh(tmp_path / "a.pickle")
    np.testing.assert_array_equal(mesh.read(0, 4), vertices)
    assert mesh.timebase.frames_per_s == pytest.approx(50 if form in ("dict", "named") else 30)
    assert (mesh.faces is not None) == (form == "dict")


def test_changing_topology_in_a_list_is_named(tmp_path: Path) -> None:
    content = {"verts": [np.zeros((5, 3)), np.zeros((5, 3)), np.zeros((4, 3))]}
    (tmp_path / "a.pkl").write_bytes(pickle.dumps(content))
    with pytest.raises(
        Sd2Error, match=r"a\.pkl: frame 2 has vertices of shape \(4, 3\), frame 0 \(5, 3\)"
    ):
        load_mesh(tmp_path / "a.pkl")


def test_a_hostile_mesh_does_not_run(tmp_path: Path) -> None:
    class Hostile:
        def __reduce__(self) -> Any:
            return os.system, (f"touch {tmp_path / 'executed'}",)

    joblib.dump({1: {"verts": smpl_like(2, (0, 0, 3)), "pose": Hostile()}}, tmp_path / "w.pkl")
    with pytest.raises(Sd2Error, match=r"w\.pkl asks for '\w+\.system', which is forbidden"):
        load_mesh(tmp_path / "w.pkl")
    assert not (tmp_path / "executed").exists()


def test_one_frame_does_not_stand_for_any_number(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "same.pkl"
    path.write_bytes(pickle.dumps({"verts": [np.ones((1000, 3))] * 500}))
    monkeypatch.setenv("SD2_READ_LIMIT_GB", "0.001")
    with pytest.raises(Sd2Error, match=r"same\.pkl declares 12\.0 MB"):
        read_model_output(path)
    monkeypatch.setenv("SD2_READ_LIMIT_GB", "0.1")
    assert read_model_output(path).vertices.shape == (500, 1000, 3)


@pytest.mark.parametrize("ids", [["x"] * 4, [[1]] * 4, 7, [2**70] * 4, [None] * 4])
def test_frame_ids_that_are_no_numbers_are_named(tmp_path: Path, ids: Any) -> None:
    path = tmp_path / "w.pkl"
    path.write_bytes(pickle.dumps({"verts": np.ones((4, 5, 3)), "frame_ids": ids}))
    with pytest.raises(Sd2Error, match=r"w\.pkl: frame_ids are no numbers of frames"):
        read_model_output(path)


@pytest.mark.parametrize(
    "names",
    [
        ("poses", "betas", "trans", "mocap_framerate"),
        ("smpl_poses", "smpl_trans", "smpl_scaling"),
        ("root_orient", "pose_body", "trans"),
    ],
)
def test_parameters_in_an_npz_are_named_with_the_way_to_vertices(
    tmp_path: Path, names: tuple[str, ...]
) -> None:
    np.savez(tmp_path / "a.npz", **{name: np.zeros((3, 3)) for name in names})
    with pytest.raises(Sd2Error, match=rf"body parameters.*{names[0]}.*--body-model") as caught:
        load_mesh(tmp_path / "a.npz")
    assert "Rename" not in str(caught.value)
