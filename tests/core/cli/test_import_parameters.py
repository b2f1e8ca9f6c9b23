"""``sd2 import --body-model``: what is kept is a mesh that anyone can open."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from cli_outcome import Sd2

from sd2core.recording.recording import open_recording
from tests.core.io.body_models import model_arrays, write_model


def motion(path: Path) -> Path:
    turns = np.zeros((5, 72))
    turns[:, 1] = np.linspace(0.0, 0.4, 5)
    np.savez(path, poses=turns, trans=np.zeros((5, 3)), betas=np.zeros(16), mocap_framerate=50)
    return path


def test_motion_becomes_a_recording_without_its_model(sd2: Sd2, tmp_path: Path) -> None:
    model = write_model(tmp_path / "SMPL.npz")
    poses = motion(tmp_path / "walk_poses.npz")
    given = ("--mesh", poses, "--body-model", model, "--distance-m", "3")
    outcome = sd2("import", *given, "--out", tmp_path / "walk.sd2")
    assert outcome.code == 0, outcome.err
    assert "without a camera" in outcome.err
    model.unlink()
    poses.unlink()
    recording = open_recording(tmp_path / "walk.sd2")
    assert recording.mesh == tmp_path / "walk.sd2" / "mesh.zarr"
    mesh = recording.load_mesh()
    assert mesh.frame_count == 5
    assert mesh.timebase.frames_per_s == 50
    rest = model_arrays()["v_template"]
    expected = np.stack([rest[:, 0], -rest[:, 2], rest[:, 1] + 3.0], axis=-1)
    np.testing.assert_allclose(mesh.frame(0), expected, atol=1e-5)


def test_a_recording_gets_other_vertices_beside_those_it_has(sd2: Sd2, tmp_path: Path) -> None:
    model = write_model(tmp_path / "SMPL.npz")
    poses = motion(tmp_path / "walk_poses.npz")
    out = tmp_path / "walk.sd2"
    given = ("--mesh", poses, "--body-model", model)
    assert sd2("import", *given, "--out", out).code == 0
    assert sd2("set", out, *given, "--distance-m", "3").code == 0
    mesh = open_recording(out).load_mesh()
    assert mesh.frame(0)[:, 2].mean() > 2.5
    assert (out / "mesh.zarr").is_dir()


def test_nothing_is_left_of_what_cannot_be_posed(sd2: Sd2, tmp_path: Path) -> None:
    poses = motion(tmp_path / "walk_poses.npz")
    model = tmp_path / "SMPL.npz"
    np.savez(model, v_template=np.zeros((3, 3)))
    outcome = sd2("import", "--mesh", poses, "--body-model", model, "--out", tmp_path / "walk.sd2")
    assert outcome.code == 1
    assert "lacks shapedirs" in outcome.err
    assert not (tmp_path / "walk.sd2").exists()


def test_a_model_for_a_mesh_is_refused(sd2: Sd2, tmp_path: Path) -> None:
    np.savez(tmp_path / "m.npz", vertices=np.ones((2, 3, 3)))
    outcome = sd2("info", tmp_path / "m.npz", "--body-model", tmp_path / "SMPL.npz")
    assert outcome.code == 1
    assert "--body-model is given" in outcome.err
