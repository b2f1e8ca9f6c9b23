"""Arrays of an HDF5 file are its own, and as large as they can be."""

from __future__ import annotations

import os
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from sd2core.errors import Sd2Error
from sd2core.files.hdf5_files import member_of, open_hdf5_file
from sd2core.files.limits import VARIABLE


def made(path: Path, make: Callable[[Any], object]) -> Path:
    with h5py.File(path, "w") as file:
        make(file)
    return path


def read(path: Path) -> Any:
    with open_hdf5_file(path, "numbers") as file:
        found = member_of(file, path, "a")
        return None if found is None else found[...]


def virtual(file: Any) -> None:
    layout = h5py.VirtualLayout((4,), "u1")
    layout[...] = h5py.VirtualSource("other.h5", "a", (4,))
    file.create_virtual_dataset("a", layout)


def in_another_file(file: Any) -> None:
    file.create_dataset("a", (4,), "u1", external=[("/etc/passwd", 0, 4)])


ELSEWHERE = {
    "external storage": in_another_file,
    "external link": lambda file: file.__setitem__("a", h5py.ExternalLink("/etc/passwd", "a")),
    "soft link": lambda file: file.__setitem__("a", h5py.SoftLink("/b")),
    "virtual": virtual,
}


@pytest.mark.parametrize("kind", ELSEWHERE)
def test_what_lies_elsewhere_is_refused(tmp_path: Path, kind: str) -> None:
    with pytest.raises(Sd2Error, match=r"a of .*in\.h5 (is a link to elsewhere|lies in another)"):
        read(made(tmp_path / "in.h5", ELSEWHERE[kind]))


@pytest.mark.parametrize("compression", [None, "gzip", "lzf"])
def test_what_is_there_is_read(tmp_path: Path, compression: str | None) -> None:
    values = np.arange(6000).reshape(60, 100)
    how = {} if compression is None else {"compression": compression, "fletcher32": True}
    path = made(tmp_path / "a.h5", lambda file: file.create_dataset("a", data=values, **how))
    np.testing.assert_array_equal(read(path), values)
    assert read(made(tmp_path / "b.h5", lambda file: file.create_group("b"))) is None


def test_a_shape_that_the_file_cannot_hold_is_refused_until_the_limit_is_raised(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = made(tmp_path / "a.h5", lambda file: file.create_dataset("a", (10**6,), "f4"))
    monkeypatch.setenv(VARIABLE, "0.001")
    with pytest.raises(Sd2Error, match=rf"a of .*a\.h5 declares 4\.0 MB.*{VARIABLE}"):
        read(path)
    monkeypatch.setenv(VARIABLE, "0.01")
    assert read(path).shape == (10**6,)


def test_chunks_without_end_are_refused(tmp_path: Path) -> None:
    path = made(
        tmp_path / "a.h5", lambda file: file.create_dataset("a", (10**6,), "u1", chunks=(1,))
    )
    with pytest.raises(Sd2Error, match=r"a\.h5 declares 1,000,000 chunks, of which 0 are stored"):
        read(path)


def test_a_chunk_that_inflates_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def bomb(file: Any) -> None:
        array = file.create_dataset("a", (100,), "u1", chunks=(100,), compression="gzip")
        array.id.write_direct_chunk((0,), zlib.compress(bytes(6 * 10**6)))

    path = made(tmp_path / "a.h5", bomb)
    monkeypatch.setenv(VARIABLE, "0.001")
    with pytest.raises(Sd2Error, match=r"a\.h5 holds a chunk that is larger than 1,000,000 bytes"):
        read(path)


def test_unknown_filters_are_refused(tmp_path: Path) -> None:
    path = made(
        tmp_path / "a.h5", lambda file: file.create_dataset("a", data=np.arange(99), scaleoffset=8)
    )
    with pytest.raises(Sd2Error, match=r"a\.h5 is compressed by the HDF5 filters \[6\]"):
        read(path)


def test_what_is_no_file_of_hdf5_is_refused(tmp_path: Path) -> None:
    (tmp_path / "text.h5").write_text("hello")
    with pytest.raises(Sd2Error, match=r"text\.h5 cannot be read as HDF5"):
        read(tmp_path / "text.h5")
    os.mkfifo(tmp_path / "pipe.h5")
    with pytest.raises(Sd2Error, match=r"pipe\.h5 is a named pipe"):
        read(tmp_path / "pipe.h5")
