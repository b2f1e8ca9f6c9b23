"""Tensors of torch, arrays of chumpy, matrices of scipy and arrays of objects."""

from __future__ import annotations

import pickle
import sys
import types
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from scipy import sparse

from sd2core.errors import Sd2Error
from sd2core.io.pickles import read_object_arrays, read_pickle, read_torch

WHOLE = torch.arange(24, dtype=torch.float32).reshape(2, 3, 4)
TENSORS = {
    "whole": WHOLE,
    "part": WHOLE[1:, :, 1:3],
    "turned": WHOLE.permute(2, 0, 1),
    "repeated": torch.ones(1, 10).expand(7, 10),
    "double": WHOLE.double(),
    "half": WHOLE.half(),
    "whole numbers": torch.arange(5),
    "truth": torch.tensor([True, False]),
    "one number": torch.tensor(2.5),
    "nothing": torch.zeros(0, 3),
    "parameter": torch.nn.Parameter(torch.ones(3)),
}


@pytest.mark.parametrize("kind", ["torch.save", "pickle"])
def test_tensors_are_read_as_arrays(tmp_path: Path, kind: str) -> None:
    path = tmp_path / "results.pt"
    content = {"smpl": TENSORS, "names": ["a"]}
    if kind == "pickle":
        path.write_bytes(pickle.dumps(content, 2))
        read = read_pickle(path)
    else:
        torch.save(content, path)
        read = read_torch(path)
    assert read["names"] == ["a"]
    for name, tensor in TENSORS.items():
        array = read["smpl"][name]
        assert isinstance(array, np.ndarray)
        assert array.dtype == tensor.detach().numpy().dtype
        np.testing.assert_array_equal(array, tensor.detach().numpy())


def test_a_program_of_torch_is_refused(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "mhr_model.pt", "w") as archive:
        archive.writestr("mhr/data.pkl", pickle.dumps({}))
        archive.writestr("mhr/code/__torch__.py", "print('executed')")
    with pytest.raises(Sd2Error, match=r"mhr_model\.pt is a program of torch"):
        read_torch(tmp_path / "mhr_model.pt")


@pytest.mark.parametrize(
    ("offset", "shape", "steps"),
    [(4, (3,), (1,)), (0, (3, 3), (3, 1)), (-1, (2,), (1,)), (0, (2,), (-1,)), (0, (2,), (1, 1))],
)
def test_a_tensor_beyond_its_numbers_is_refused(
    tmp_path: Path, offset: int, shape: tuple[int, ...], steps: tuple[int, ...]
) -> None:
    class Lie:
        def __reduce__(self) -> Any:
            numbers = torch.arange(6, dtype=torch.float32).__reduce_ex__(2)[1][0]
            return torch._utils._rebuild_tensor_v2, (numbers, offset, shape, steps, False, {})

    (tmp_path / "lie.pkl").write_bytes(pickle.dumps(Lie(), 2))
    with pytest.raises(Sd2Error, match=r"lie\.pkl holds a torch tensor"):
        read_pickle(tmp_path / "lie.pkl")


def test_numbers_repeated_without_end_are_refused(tmp_path: Path) -> None:
    torch.save(torch.ones(1).expand(2**40), tmp_path / "bomb.pt")
    with pytest.raises(Sd2Error, match="claims an array"):
        read_torch(tmp_path / "bomb.pt")


@pytest.fixture
def chumpy(monkeypatch: pytest.MonkeyPatch) -> types.ModuleType:
    """Something to pickle as chumpy pickles; it is gone where files are read."""
    module = types.ModuleType("chumpy.ch")

    class Ch:
        pass

    Ch.__module__, Ch.__qualname__ = "chumpy.ch", "Ch"
    module.Ch = Ch  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "chumpy", types.ModuleType("chumpy"))
    monkeypatch.setitem(sys.modules, "chumpy.ch", module)
    return module


@pytest.mark.parametrize("protocol", [0, 2, 4])
def test_arrays_of_chumpy_are_read_without_it(
    tmp_path: Path, chumpy: Any, protocol: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    learnt = chumpy.Ch()
    values = np.arange(6.0).reshape(2, 3)
    vars(learnt).update(x=values, _dirty_vars=set(), _itr=None)
    path = tmp_path / "smpl.pkl"
    path.write_bytes(pickle.dumps({"shapedirs": learnt}, protocol))
    monkeypatch.delitem(sys.modules, "chumpy.ch")
    monkeypatch.delitem(sys.modules, "chumpy")
    np.testing.assert_array_equal(read_pickle(path)["shapedirs"], values)


@pytest.mark.parametrize("kind", [sparse.csc_matrix, sparse.csr_matrix])
@pytest.mark.parametrize("protocol", [2, 4])
def test_sparse_matrices_are_read_whole(tmp_path: Path, kind: Any, protocol: int) -> None:
    dense = np.array([[0.0, 2.0, 0.0], [1.0, 0.0, 0.5]])
    path = tmp_path / "regressor.pkl"
    path.write_bytes(pickle.dumps(kind(dense), protocol))
    np.testing.assert_array_equal(read_pickle(path), dense)


def test_a_sparse_matrix_that_would_fill_the_memory_is_refused(tmp_path: Path) -> None:
    huge = sparse.csc_matrix((2**25, 3))
    huge._shape = (2**25, 2**25)
    (tmp_path / "huge.pkl").write_bytes(pickle.dumps(huge))
    with pytest.raises(Sd2Error, match="claims an array"):
        read_pickle(tmp_path / "huge.pkl")


def test_archives_of_objects_are_read(tmp_path: Path) -> None:
    entry = {"verts": np.ones((2, 4, 3), np.float32), "track_ids": np.array([1, 2])}
    np.savez(tmp_path / "video_results.npz", results=np.array(entry), other=np.arange(3))
    read = read_object_arrays(tmp_path / "video_results.npz")
    np.testing.assert_array_equal(read["results"]["verts"], entry["verts"])
    np.testing.assert_array_equal(read["other"], np.arange(3))
    np.save(tmp_path / "hps_track_0.npy", entry)  # type: ignore[arg-type]
    assert set(read_object_arrays(tmp_path / "hps_track_0.npy")[""]) == set(entry)
