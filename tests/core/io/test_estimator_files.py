"""Files in the layouts that estimators of bodies publish, made here."""

from __future__ import annotations

import json
import pickle
from dataclasses import replace
from pathlib import Path
from random import Random
from typing import Any

import joblib
import numpy as np
import pytest
import torch
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from sd2core.errors import Sd2Error
from sd2core.io.kinds import kind_of
from sd2core.io.mesh import load_mesh
from sd2core.mesh.sequence import MeshSequence
from sd2core.timebase import Timebase
from tests.core.io.body_models import model_arrays, write_model

REST = model_arrays()["v_template"] - model_arrays()["v_template"].mean(axis=0)
FRAMES = (3, 4, 5, 9)
"""Video frames of the person that is read; 6 to 8 are without."""


def at_root(frame: int) -> NDArray[np.float64]:
    return np.asarray(REST * (1.0 + 0.01 * frame))


def place(frame: int) -> NDArray[np.float64]:
    return np.array([0.1 * frame, -0.2, 3.0 + 0.05 * frame])


def sam_3d_body(frame: int) -> dict[str, Any]:
    return {
        "pred_vertices": at_root(frame).astype(np.float32),
        "pred_cam_t": place(frame).astype(np.float32),
        "focal_length": np.float32(1100.0),
        "bbox": np.array([0.0, 0.0, 100.0, 200.0]),
        "shape_params": np.zeros(45),
    }


def check(mesh: MeshSequence, depth: float = 1.0) -> None:
    """The person stands where the camera sees them, in frames that keep their place."""
    there = mesh.presence.present
    np.testing.assert_allclose(mesh.times_s[there] * 30 + 3, FRAMES, atol=1e-6)
    for row, frame in zip(np.flatnonzero(there), FRAMES, strict=True):
        expected = at_root(frame) + place(frame) * [1.0, 1.0, depth]
        np.testing.assert_allclose(mesh.frame(int(row)), expected, atol=2e-5)


def read(path: Path, **options: Any) -> MeshSequence:
    mesh = load_mesh(path, frames_per_s=30, **options)
    start = mesh.times_s[0]
    return mesh if start == 0 else _from_zero(mesh)


def _from_zero(mesh: MeshSequence) -> MeshSequence:
    return replace(mesh, timebase=Timebase(mesh.times_s - mesh.times_s[0]))


def test_a_folder_with_a_file_for_each_frame_and_person(tmp_path: Path) -> None:
    folder = tmp_path / "sam"
    folder.mkdir()
    for frame in FRAMES:
        np.savez(folder / f"{frame:06d}_0.npz", **sam_3d_body(frame), faces=model_arrays()["f"])
    np.savez(folder / "000003_1.npz", **sam_3d_body(20))
    (folder / "._000004_0.npz").write_bytes(b"of a Mac")
    assert kind_of(folder) == "mesh"
    mesh = read(folder)
    check(mesh)
    assert mesh.faces is not None
    assert "Person 0 is read, seen longest of: 0 (4 frames), 1 (1 frames)." in mesh.notes
    assert any("focal length 1100 px (the file's)" in note for note in mesh.notes)


def test_a_focal_length_that_is_known_better_moves_the_body_away(tmp_path: Path) -> None:
    folder = tmp_path / "sam"
    folder.mkdir()
    for frame in FRAMES:
        np.savez(folder / f"frame_{frame:06d}_person_0.npz", **sam_3d_body(frame))
    mesh = read(folder, focal_px=2200.0)
    check(mesh, depth=2.0)
    assert any("focal length 2200 px (as given)" in note for note in mesh.notes)


def test_a_list_of_frames_as_the_estimator_returns_it(tmp_path: Path) -> None:
    frames: list[list[dict[str, Any]]] = [[] for _ in range(10)]
    for frame in FRAMES:
        frames[frame].append(sam_3d_body(frame))
    (tmp_path / "outputs.pkl").write_bytes(pickle.dumps(frames))
    check(read(tmp_path / "outputs.pkl"))


def test_a_json_of_a_video(tmp_path: Path) -> None:
    frames = [
        {
            "frame_number": frame,
            "persons": [
                {
                    "person_id": 4,
                    "mesh": {"vertices": at_root(frame).tolist()},
                    "camera": {"translation": place(frame).tolist(), "focal_length": 1100.0},
                    "pose": {"body_pose": [0.0]},
                    "shape": {"shape_params": [0.0]},
                }
            ],
        }
        for frame in FRAMES
    ]
    document = {"video_info": {"fps": 25.0}, "frames": [*frames, {"error": "nobody"}]}
    (tmp_path / "data.json").write_text(json.dumps(document))
    check(read(tmp_path / "data.json"))
    told = load_mesh(tmp_path / "data.json")
    assert np.diff(told.times_s)[0] == pytest.approx(1 / 25)


def smpl_parameters(frames: tuple[int, ...], joints: int = 24) -> dict[str, Any]:
    noise = np.random.default_rng(1)
    return {
        "vectors": noise.normal(size=(len(frames), joints, 3)) * 0.3,
        "betas": np.tile([0.2, 0.1], (len(frames), 1)),
        "trans": np.stack([place(frame) for frame in frames]),
    }


@pytest.fixture
def amass_twin(tmp_path: Path) -> Any:
    """Vertices of the same parameters in the plainest file there is."""

    def made(parameters: dict[str, Any], joints: int = 24) -> NDArray[np.float64]:
        count = len(parameters["vectors"])
        plain = {
            "pose": parameters["vectors"].reshape(count, -1),
            "trans": parameters["trans"],
            "betas": parameters["betas"],
        }
        np.savez(tmp_path / "plain.npz", **plain)
        model = write_model(tmp_path / f"model{joints}.npz", joints)
        mesh = load_mesh(tmp_path / "plain.npz", frames_per_s=30, body_model=model)
        return np.asarray(mesh.read(0, count))

    return made


def matrices(vectors: NDArray[np.float64]) -> NDArray[np.float32]:
    flat = Rotation.from_rotvec(vectors.reshape(-1, 3)).as_matrix()
    return flat.reshape(*vectors.shape, 3).astype(np.float32)


def test_tram_with_tensors_in_an_npy(tmp_path: Path, amass_twin: Any) -> None:
    known = smpl_parameters(FRAMES)
    results = {
        "pred_cam": torch.ones(4, 3),
        "pred_pose": torch.zeros(4, 144),
        "pred_rotmat": torch.from_numpy(matrices(known["vectors"])),
        "pred_shape": torch.from_numpy(known["betas"]).float(),
        "pred_trans": torch.from_numpy(known["trans"][:, None]).float(),
        "frame": torch.tensor(FRAMES),
        "img_focal": 900.0,
    }
    path = tmp_path / "hps_track_0.npy"
    np.save(path, results)  # type: ignore[arg-type]
    assert kind_of(path) == "mesh"
    mesh = read(path, body_model=write_model(tmp_path / "SMPL.npz"))
    there = mesh.presence.present
    np.testing.assert_allclose(mesh.times_s[there] * 30 + 3, FRAMES, atol=1e-6)
    np.testing.assert_allclose(mesh.read(0, 5)[there], amass_twin(known), atol=1e-5)


def test_gvhmr_in_a_torch_file(tmp_path: Path, amass_twin: Any) -> None:
    known = smpl_parameters((0, 1, 2), 55)
    known["vectors"][:, 22:] = 0.0
    flat = torch.from_numpy(known["vectors"].reshape(3, -1)).float()
    incam = {
        "body_pose": flat[:, 3:66],
        "betas": torch.from_numpy(known["betas"]).float(),
        "global_orient": flat[:, :3],
        "transl": torch.from_numpy(known["trans"]).float(),
    }
    world = {**incam, "transl": torch.full((3, 3), 50.0)}
    focal = torch.eye(3).expand(3, 3, 3)
    between = {"model_output": {"static_conf_logits": torch.zeros(1, 3, 6)}, "cam_angvel": None}
    content = {
        "smpl_params_global": world,
        "smpl_params_incam": incam,
        "K_fullimg": focal,
        "net_outputs": between,
    }
    torch.save(content, tmp_path / "hmr4d_results.pt")
    assert kind_of(tmp_path / "hmr4d_results.pt") == "mesh"
    model = write_model(tmp_path / "SMPLX.npz", 55)
    mesh = read(tmp_path / "hmr4d_results.pt", body_model=model)
    np.testing.assert_allclose(mesh.read(0, 3), amass_twin(known, 55), atol=1e-5)
    # Of SMPL-X, so that a model of SMPL has another shape.
    mesh = read(tmp_path / "hmr4d_results.pt", body_model=write_model(tmp_path / "SMPL.npz"))
    assert any("parameters of SMPL-X" in note for note in mesh.notes)


def test_prompthmr_with_people_one_level_down(tmp_path: Path, amass_twin: Any) -> None:
    known = smpl_parameters(FRAMES, 55)
    inner = {
        "rotmat": matrices(known["vectors"]),
        "pose": known["vectors"][:, :25].reshape(4, 75),
        "shape": known["betas"],
        "trans": known["trans"],
    }
    person = {"frames": np.array(FRAMES), "bboxes": np.ones((4, 4)), "smplx_cam": inner}
    shorter = {"frames": np.array([1]), "smplx_cam": {k: v[:1] for k, v in inner.items()}}
    content = {"camera": {"img_focal": 900.0}, "people": {np.int64(1): person, 2: shorter}}
    joblib.dump(content, tmp_path / "results.pkl")
    model = write_model(tmp_path / "SMPLX.npz", 55)
    mesh = read(tmp_path / "results.pkl", body_model=model)
    there = mesh.presence.present
    np.testing.assert_allclose(mesh.times_s[there] * 30 + 3, FRAMES, atol=1e-6)
    np.testing.assert_allclose(mesh.read(0, 5)[there], amass_twin(known, 55), atol=1e-5)
    assert load_mesh(tmp_path / "results.pkl", person=2, body_model=model).frame_count == 1


def test_phalp_with_a_frame_for_each_picture(tmp_path: Path, amass_twin: Any) -> None:
    """Its camera has 5,000 pixels in a picture whose longer side is 256, whatever the video's is.

    People whom it has lost are kept as they were seen last, so many frames ago.
    """
    known = smpl_parameters(FRAMES)
    turns = matrices(known["vectors"])
    names = ("tid", "smpl", "camera", "size", "tracked_time", "bbox")
    content: dict[str, Any] = {
        f"outputs/_DEMO/walk/img/{frame:06d}.jpg": {"time": frame} | {name: [] for name in names}
        for frame in range(1, 10)
    }
    for row, frame in enumerate(FRAMES):
        smpl = {
            "global_orient": turns[row, :1],
            "body_pose": turns[row, 1:],
            "betas": known["betas"][row],
        }
        far = known["trans"][row] * [1.0, 1.0, 5000.0 / 256.0 * 1.28]
        people = 1 + row % 2  # one comes and goes
        content[f"outputs/_DEMO/walk/img/{frame:06d}.jpg"] |= {
            "tid": [7, 2][:people],
            "smpl": [smpl, smpl][:people],
            "camera": [far, far][:people],
            "size": [[720, 1280]] * people,
            "tracked_time": [0, 0][:people],
        }
    for frame in (6, 7):
        seen = content["outputs/_DEMO/walk/img/000005.jpg"]
        lost = seen | {"time": frame, "tracked_time": [frame - 5]}
        content[f"outputs/_DEMO/walk/img/{frame:06d}.jpg"] = lost
    joblib.dump(content, tmp_path / "demo_phalp.pkl")
    model = write_model(tmp_path / "SMPL.npz")
    mesh = read(tmp_path / "demo_phalp.pkl", body_model=model, focal_px=1000.0)
    there = mesh.presence.present
    np.testing.assert_allclose(mesh.times_s[there] * 30 + 3, FRAMES, atol=1e-6)
    np.testing.assert_allclose(mesh.read(0, 5)[there], amass_twin(known), atol=1e-5)
    guessed = read(tmp_path / "demo_phalp.pkl", body_model=model)
    assert any("focal length 1469 px (assumed: the image's diagonal)" in n for n in guessed.notes)


@pytest.mark.parametrize("size", [None, (1024, 1024)])
def test_romp_with_people_of_each_picture(tmp_path: Path, size: tuple[int, int] | None) -> None:
    results = {}
    for frame in FRAMES:
        results[f"frame_{frame:05d}.jpg"] = {
            "verts": np.stack([at_root(0), at_root(frame)]).astype(np.float32),
            "cam_trans": np.stack([[0.0, 0.0, 9.0], place(frame)]).astype(np.float32),
            "smpl_thetas": np.zeros((2, 72)),
            "track_ids": np.array([2, 5]),
        }
    np.savez(tmp_path / "video_results.npz", results=np.array(results))
    options: dict[str, Any] = {} if size is None else {"image_size": size, "focal_px": 886.8}
    check(read(tmp_path / "video_results.npz", person=5, **options))


def test_romp_says_by_minus_one_that_it_found_no_place(tmp_path: Path) -> None:
    results = {}
    for frame in range(3, 10):
        where = place(frame) if frame in FRAMES else -np.ones(3)
        results[f"{frame:08d}.png"] = {
            "cam": np.array([[0.5, 0.0, 0.1]]),
            "smpl_thetas": np.zeros((1, 72)),
            "smpl_betas": np.zeros((1, 10)),
            "center_preds": np.array([[256, 256]]),
            "verts": at_root(frame)[None].astype(np.float32),
            "cam_trans": where[None].astype(np.float32),
        }
    np.savez(tmp_path / "video_results.npz", results=results, sequence_results={})
    check(read(tmp_path / "video_results.npz"))


def test_the_camera_of_the_whole_picture_places_vibe(tmp_path: Path) -> None:
    """A weak-perspective camera s·(X + t) of width and height, for a known pinhole camera."""
    width, height, focal = 1280, 720, 900.0
    places = np.stack([place(frame) for frame in FRAMES])
    scale = 2 * focal / (places[:, 2] * width)
    content = {
        "verts": np.stack([at_root(frame) for frame in FRAMES]),
        "orig_cam": np.stack([scale, scale * width / height, *places[:, :2].T], axis=1),
        "frame_ids": np.array(FRAMES),
    }
    joblib.dump({1: content}, tmp_path / "vibe_output.pkl")
    check(read(tmp_path / "vibe_output.pkl", image_size=(width, height), focal_px=focal))


def test_a_model_for_a_file_of_vertices_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.pkl").write_bytes(pickle.dumps({"verts": np.stack([REST, REST])}))
    with pytest.raises(Sd2Error, match=r"a\.pkl holds vertices, and a body model"):
        load_mesh(tmp_path / "a.pkl", body_model=write_model(tmp_path / "SMPL.npz"))


def test_a_template_beside_surfaces_makes_no_estimate_of_them(tmp_path: Path) -> None:
    (tmp_path / "walk").mkdir()
    for frame in range(2):
        lines = [f"v {x} {y} {z}" for x, y, z in at_root(frame)]
        (tmp_path / "walk" / f"{frame:06d}.obj").write_text("\n".join(lines))
    np.savez(tmp_path / "walk" / "000000.npz", **sam_3d_body(1))
    assert load_mesh(tmp_path / "walk").frame_count == 2


_ODD: tuple[Any, ...] = (
    *(None, "x", -1, 2**70, float("nan"), [], {}, [1, 2], True, b"q", {"a": 1}),
    *(np.zeros(0), np.zeros((2, 3)), np.array("x"), np.array([None]), np.full((4, 3), np.nan)),
)


def layouts() -> dict[str, Any]:
    known = smpl_parameters(FRAMES)
    turns = matrices(known["vectors"])
    pictures = {
        f"{frame:06d}.jpg": {
            "tid": [7],
            "smpl": [{"global_orient": turns[row, :1], "body_pose": turns[row, 1:]}],
            "camera": [place(frame)],
            "size": [[720, 1280]],
        }
        for row, frame in enumerate(FRAMES)
    }
    people = {"people": {1: {"frames": np.array(FRAMES), "smplx_cam": {"rotmat": turns, **known}}}}
    tram = {"pred_rotmat": turns, "pred_trans": known["trans"], "frame": np.array(FRAMES)}
    romp = {
        f"{frame}.jpg": {
            "verts": np.stack([at_root(frame)] * 2),
            "cam_trans": np.stack([place(frame)] * 2),
            "track_ids": np.array([2, 5]),
        }
        for frame in FRAMES
    }
    return {
        "phalp": pictures,
        "prompthmr": people,
        "tram": tram | {"img_focal": 900.0, "smpl_scaling": np.array([90.0])},
        "romp": romp,
        "sam": [[sam_3d_body(frame)] for frame in FRAMES],
    }


def spoiled(content: Any, random: Random) -> Any:
    """The same with one thing in it replaced, cut, reshaped or of another type."""
    if isinstance(content, dict | list) and content and random.random() < 0.9:
        keys = list(content) if isinstance(content, dict) else list(range(len(content)))
        key, copied = random.choice(keys), content.copy()
        copied[key] = spoiled(content[key], random)
        return copied
    if isinstance(content, np.ndarray) and content.size and random.random() < 0.7:
        changes = (content[:-1], content.ravel(), content[None], content.astype("U3"))
        return random.choice(changes)
    return random.choice(_ODD)


@pytest.mark.one_in(3)
@pytest.mark.parametrize("name", ["phalp", "prompthmr", "tram", "romp", "sam"])
def test_whatever_stands_under_a_known_name_is_read_or_refused(tmp_path: Path, name: str) -> None:
    model, random = write_model(tmp_path / "SMPL.npz"), Random(name)
    path, refused = tmp_path / "a.pkl", 0
    for _ in range(25):
        path.write_bytes(pickle.dumps(spoiled(layouts()[name], random)))
        try:
            load_mesh(path, body_model=model if name in ("phalp", "prompthmr", "tram") else None)
        except Sd2Error:
            refused += 1
    assert refused


def test_an_array_of_vertices_alone_is_a_mesh_and_one_of_points_is_none(tmp_path: Path) -> None:
    vertices = np.random.default_rng(0).normal(size=(4, 150, 3)) * 0.2 + [0, 0, 3.0]
    np.save(tmp_path / "vertices.npy", vertices)
    assert kind_of(tmp_path / "vertices.npy") == "mesh"
    mesh = load_mesh(tmp_path / "vertices.npy", frames_per_s=25.0)
    np.testing.assert_allclose(mesh.read(0, 4), vertices, atol=1e-6)
    assert mesh.faces is None
    np.save(tmp_path / "points.npy", vertices[:, :64])  # a radar's, of three columns
    assert kind_of(tmp_path / "points.npy") == "radar"
