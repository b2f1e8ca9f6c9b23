"""An ``.npz`` gives arrays as they were written, and no more than its size allows."""

from __future__ import annotations

import io
import os
import zipfile
from pathlib import Path

import numpy as np
import pytest

from sd2core.datasets.reading import open_dataset
from sd2core.errors import Sd2Error
from sd2core.files.limits import VARIABLE
from sd2core.files.numpy_files import open_npz_file
from sd2core.io.mesh import load_mesh
from sd2core.io.mesh_files import read_faces
from sd2core.maps import DopplerMap


def read(path: Path) -> dict[str, np.ndarray]:
    with open_npz_file(path, "numbers", "an .npz") as data:
        return dict(data)


def claiming(shape: str) -> bytes:
    """Bytes of an array whose header has another shape than (1000,)."""
    made = io.BytesIO()
    np.save(made, np.arange(1000.0))
    assert b"(1000,), " in made.getvalue()
    return made.getvalue().replace(b"(1000,), ", b"(" + shape.encode() + b",), ", 1)


def test_arrays_come_back_in_their_order(tmp_path: Path) -> None:
    arrays = {
        "b": np.asfortranarray(np.arange(12).reshape(3, 4)), "a": np.array("x"), "c": np.zeros(0)
    }  # fmt: skip
    np.savez(tmp_path / "a.npz", **arrays)
    found = read(tmp_path / "a.npz")
    assert list(found) == list(arrays)
    for name, array in arrays.items():
        assert found[name].dtype == array.dtype
        np.testing.assert_array_equal(found[name], array)


def test_what_else_was_packed_is_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "more.npz"
    np.savez(path, one=np.arange(3))
    with zipfile.ZipFile(path, "a") as archive:
        for name in ("README.txt", "notes/", "__MACOSX/._one"):
            archive.writestr(name, b"")
    assert {name: array.tolist() for name, array in read(path).items()} == {"one": [0, 1, 2]}


def test_a_small_file_that_inflates_is_refused_until_the_limit_is_raised(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "bomb.npz"
    np.savez_compressed(path, vertices=np.zeros((1000, 500, 3), np.float32))
    monkeypatch.setenv(VARIABLE, "0.001")
    assert path.stat().st_size < 20_000
    for reading in (read, load_mesh, DopplerMap.load, open_dataset, read_faces):
        with pytest.raises(Sd2Error, match=rf"bomb\.npz declares 6\.0 MB.*{VARIABLE}"):
            reading(path)
    monkeypatch.setenv(VARIABLE, "0.01")
    assert read(path)["vertices"].shape == (1000, 500, 3)


@pytest.mark.parametrize("shape", ["1001", "1000000000000", "9" * 40])
def test_an_array_larger_than_its_bytes_is_refused(tmp_path: Path, shape: str) -> None:
    path = tmp_path / "claim.npz"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("a.npy", claiming(shape))
    with pytest.raises(Sd2Error, match=r"claim\.npz cannot be read as numbers"):
        read(path)
    (tmp_path / "claim.npy").write_bytes(claiming(shape))
    with pytest.raises(Sd2Error, match=r"claim\.npy \(.* bytes\) cannot be read"):
        read_faces(tmp_path / "claim.npy")


def test_bytes_that_are_no_array_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "mesh.npz"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("a.npy", b"x")
    with pytest.raises(Sd2Error, match=r"mesh\.npz cannot be read as numbers"):
        read(path)


def test_no_object_is_made(tmp_path: Path) -> None:
    np.savez(tmp_path / "objects.npz", a=np.array([{}], dtype=object))
    with pytest.raises(Sd2Error, match=r"cannot be read as numbers.*[Oo]bject"):
        read(tmp_path / "objects.npz")


def test_a_pipe_is_not_opened(tmp_path: Path) -> None:
    for name in ("a.npz", "a.npy"):
        os.mkfifo(tmp_path / name)
    for reading in (read, load_mesh, DopplerMap.load, open_dataset, read_faces):
        with pytest.raises(Sd2Error, match=r"a\.npz is a named pipe"):
            reading(tmp_path / "a.npz")
    with pytest.raises(Sd2Error, match=r"a\.npy is a named pipe"):
        read_faces(tmp_path / "a.npy")
