"""What a fitted mesh says about its fit."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path

import numpy as np
import pytest
import zarr

from sd2core.files.recording_json import CameraEntry
from sd2core.io.fitted import fitted_camera, fitted_doubts
from sd2core.io.mesh import load_mesh, save_mesh
from sd2core.mesh.sequence import MeshSequence
from sd2core.recording.recording import MeshReading, Recording
from sd2core.timebase import Timebase

DOUBT = "Never seen: left foot."
SAID = {
    "camera": {"focal_px": 612.5, "width": 640, "height": 480, "source": "metadata"},
    "doubts": [DOUBT],
}
CAMERA = CameraEntry(focal_px=612.5, width=640, height=480, source="metadata")


@pytest.fixture(params=["mesh.zarr", "mesh.npz", "mesh.zarr.zip"])
def fitted(request, tmp_path: Path) -> Path:
    """Where the fit says it, in every form of a mesh."""
    path = tmp_path / request.param
    if request.param == "mesh.zarr":
        zarr.open_group(str(path), mode="w").attrs["fit"] = SAID
    elif request.param == "mesh.zarr.zip":
        store = zarr.storage.ZipStore(str(path), mode="w")
        zarr.create_group(store, attributes={"fit": SAID})
        store.close()
    else:
        np.savez(path, fit=np.array(json.dumps(SAID)))
    return path


def test_it_is_read_from_every_form(fitted: Path) -> None:
    assert fitted_camera(fitted) == CAMERA
    assert fitted_doubts(fitted) == (DOUBT,)


def test_a_mesh_that_is_opened_says_what_is_not_to_be_believed(tmp_path: Path) -> None:
    path = tmp_path / "body.zarr"
    vertices = np.random.default_rng(0).uniform(0.0, 1.5, (4, 9, 3)).astype(np.float32)
    save_mesh(MeshSequence(vertices, None, Timebase.regular(4, 30.0), "test"), path)
    assert DOUBT not in load_mesh(path).notes
    zarr.open_group(str(path), mode="r+").attrs["fit"] = SAID
    assert load_mesh(path).notes[-1] == DOUBT


def test_a_damaged_word_of_the_fit_keeps_no_mesh_from_being_read(tmp_path: Path) -> None:
    """Every byte of it in turn."""
    path, spoilt = tmp_path / "body.npz", tmp_path / "spoilt.npz"
    vertices = np.random.default_rng(0).uniform(0.0, 1.5, (4, 9, 3)).astype(np.float32)
    save_mesh(MeshSequence(vertices, None, Timebase.regular(4, 30.0), "test"), path)
    with zipfile.ZipFile(path, "a", zipfile.ZIP_DEFLATED) as archive:
        with archive.open("fit.npy", "w") as member:
            np.lib.format.write_array(member, np.array(json.dumps(SAID)))
        word = archive.getinfo("fit.npy")
    sound = path.read_bytes()
    assert load_mesh(path).notes[-1] == DOUBT
    start = sound.index(b"fit.npy", word.header_offset) + len("fit.npy")
    for place in range(start, start + word.compress_size):
        spoilt.write_bytes(sound[:place] + bytes([sound[place] ^ 0xFF]) + sound[place + 1 :])
        np.testing.assert_array_equal(load_mesh(spoilt).read(0, 4), vertices)
        assert fitted_camera(spoilt) in (None, CAMERA)


def test_other_meshes_say_nothing(tmp_path: Path) -> None:
    np.savez(tmp_path / "plain.npz", vertices=np.zeros((1, 3, 3)))
    zarr.open_group(str(tmp_path / "plain.zarr"), mode="w")
    (tmp_path / "text.obj").write_text("v 0 0 0")
    with zipfile.ZipFile(tmp_path / "odd.npz", "w") as archive:
        archive.writestr("fit.npy", b"damaged")
    bad = {"camera": {"focal_px": -1}}
    np.savez(tmp_path / "bad.npz", fit=np.array(json.dumps(bad)))
    for name in ("plain.npz", "plain.zarr", "text.obj", "odd.npz", "bad.npz", "none.npz"):
        assert fitted_camera(tmp_path / name) is None
        assert fitted_doubts(tmp_path / name) == ()


def test_a_recording_learns_what_nobody_said(fitted: Path, tmp_path: Path) -> None:
    recording = Recording(tmp_path / "a.sd2", mesh=fitted)
    recording.learn_camera()
    assert recording.camera == CAMERA
    known = CameraEntry(focal_px=700, source="user")
    said = Recording(tmp_path / "b.sd2", mesh=fitted, camera=known)
    said.learn_camera()
    assert said.camera == known
    placed = Recording(tmp_path / "c.sd2", mesh=fitted, mesh_reading=MeshReading(focal_px=650))
    placed.learn_camera()
    assert placed.focal_px(640, 480) == 650
