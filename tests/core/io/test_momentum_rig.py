"""Parameters of MHR as SAM 3D Body writes them, with a small TorchScript model called alike."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from torch import Tensor, nn

from sd2core.errors import Sd2Error
from sd2core.io.mesh import load_mesh

VERTICES, FRAMES = 120, 40
pytestmark = pytest.mark.filterwarnings("ignore:.torch.jit:DeprecationWarning")

FACES = np.array([[0, 1, 2], [2, 3, 4]])


class Surface(nn.Module):
    """Holds what the real model keeps of its mesh."""

    def __init__(self) -> None:
        super().__init__()
        noise = torch.Generator().manual_seed(0)
        self.register_buffer("rest_vertices", torch.randn(VERTICES, 3, generator=noise) * 30.0)
        self.register_buffer("texcoord_faces", torch.zeros(7, 3, dtype=torch.int32))
        self.register_buffer("faces", torch.from_numpy(FACES.astype(np.int32)))


class Rig(nn.Module):
    """Centimetres, y up: turned by the sixth number of the pose, which moves by the first three."""

    def __init__(self) -> None:
        super().__init__()
        self.mesh = Surface()

    def forward(self, identity: Tensor, pose: Tensor, face: Tensor) -> tuple[Tensor, Tensor]:
        size = 1.0 + 0.1 * identity[:, :1, None] + 0.01 * face[:, :1, None]
        cosine, sine = torch.cos(pose[:, 5, None]), torch.sin(pose[:, 5, None])
        rest = size * self.mesh.rest_vertices[None]
        x, y = rest[..., 0], rest[..., 1]
        turned = torch.stack([cosine * x - sine * y, sine * x + cosine * y, rest[..., 2]], dim=-1)
        return turned + 10.0 * pose[:, None, :3], torch.zeros(len(pose), 127, 8)


class Thief(Rig):
    """Writes a file beside what it computes."""

    def forward(self, identity: Tensor, pose: Tensor, face: Tensor) -> tuple[Tensor, Tensor]:
        taken = torch.from_file("taken.bin", shared=True, size=4)
        return 0.0 * taken[0] + torch.zeros(len(pose), 120, 3), face


@pytest.fixture
def model(tmp_path: Path) -> Path:
    torch.jit.save(torch.jit.script(Rig()), tmp_path / "mhr_model.pt")
    return tmp_path / "mhr_model.pt"


def person(frame: int) -> dict[str, Any]:
    noise = np.random.default_rng(frame)
    identity, face = np.zeros(45, np.float32), np.zeros(72, np.float32)
    identity[0], face[0] = 0.4, noise.uniform()
    pose = noise.normal(size=204).astype(np.float32) * 0.1
    pose[:3] = 0.0  # SAM 3D Body has the place in its camera's translation
    return {
        "bbox": np.array([0.0, 0.0, 100.0, 200.0]),
        "focal_length": np.float32(1100.0),
        "pred_cam_t": np.array([0.1, 0.2, 3.0 + 0.01 * frame], np.float32),
        "shape_params": identity,
        "expr_params": face,
        "scale_params": np.zeros(28, np.float32),
        "mhr_model_params": pose,
        "mask": None,
    }


def write(path: Path, **changed: Any) -> Path:
    frames = [[person(frame) | changed] for frame in range(FRAMES)]
    path.write_bytes(pickle.dumps(frames))
    return path


def expected(frame: int) -> np.ndarray:
    one = person(frame)
    size = 1.0 + 0.1 * one["shape_params"][0] + 0.01 * one["expr_params"][0]
    cosine, sine = np.cos(one["mhr_model_params"][5]), np.sin(one["mhr_model_params"][5])
    turn = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    up = 0.01 * size * Surface().rest_vertices.numpy() @ turn.T
    return np.asarray(up * [1.0, -1.0, -1.0] + one["pred_cam_t"])


def test_parameters_become_vertices_in_metres_before_the_camera(
    tmp_path: Path, model: Path
) -> None:
    mesh = load_mesh(write(tmp_path / "out.pkl"), frames_per_s=30, body_model=model)
    assert mesh.frame_count == FRAMES
    for frame in (0, 31, 32, FRAMES - 1):
        np.testing.assert_allclose(mesh.frame(frame), expected(frame), atol=1e-5)
    np.testing.assert_array_equal(mesh.faces, FACES)


def test_a_folder_with_a_file_for_each_frame(tmp_path: Path, model: Path) -> None:
    (tmp_path / "sam").mkdir()
    for frame in (3, 4, 5):
        held = {name: value for name, value in person(frame).items() if value is not None}
        np.savez(tmp_path / "sam" / f"{frame:06d}_0.npz", **held)
    mesh = load_mesh(tmp_path / "sam", frames_per_s=30, body_model=model)
    np.testing.assert_allclose(mesh.frame(mesh.frame_count - 1), expected(5), atol=1e-5)


def test_without_a_model_it_says_what_is_missing(tmp_path: Path) -> None:
    with pytest.raises(Sd2Error, match=r"body parameters and no vertices.*--body-model"):
        load_mesh(write(tmp_path / "out.pkl"))


def test_a_program_that_writes_files_is_refused_unread(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    torch.jit.save(torch.jit.script(Thief()), tmp_path / "thief.pt")
    path = write(tmp_path / "out.pkl")
    with pytest.raises(Sd2Error, match=r"thief\.pt is a program that does more.*from_file"):
        load_mesh(path, body_model=tmp_path / "thief.pt")
    assert not (tmp_path / "taken.bin").exists()


def test_other_files_and_other_calls_are_named(tmp_path: Path, model: Path) -> None:
    path = write(tmp_path / "out.pkl")
    torch.save({"a": torch.zeros(3)}, tmp_path / "weights.pt")
    np.savez(tmp_path / "SMPL.npz", v_template=np.zeros((3, 3)))
    (tmp_path / "cut.pt").write_bytes(model.read_bytes()[:5000])
    torch.jit.save(torch.jit.script(OfOneNumber()), tmp_path / "other.pt")
    for name, reason in (
        ("weights.pt", "no program"),
        ("SMPL.npz", "no model of MHR"),
        ("cut.pt", "cannot be read as a model of MHR"),
        ("other.pt", "makes no vertices"),
        ("none.pt", "no model of MHR"),
    ):
        with pytest.raises(Sd2Error, match=rf"{name}.*{reason}.*mhr_model\.pt"):
            load_mesh(path, body_model=tmp_path / name)
    with pytest.raises(Sd2Error, match=r"lacks expr_params"):
        load_mesh(write(tmp_path / "bare.pkl", expr_params=None), body_model=model)


class OfOneNumber(nn.Module):
    """Takes one number only."""

    def forward(self, x: Tensor) -> Tensor:
        return x
