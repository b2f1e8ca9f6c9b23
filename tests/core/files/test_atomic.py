from __future__ import annotations

import json
import os
import stat
import sys
import threading
from collections.abc import Iterator

import numpy as np
import pytest

from sd2core.errors import Sd2Error
from sd2core.files.atomic import (
    atomic_write,
    atomic_write_json,
    atomic_write_text,
    check_writable,
    remove_leftovers,
)


def test_a_block_that_raises_leaves_the_old_file_and_no_other(tmp_path):
    path = tmp_path / "file.json"
    atomic_write_text(path, "old")
    with pytest.raises(TypeError), atomic_write(path) as stream:
        stream.writelines([b"half of the new", None])
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_the_new_file_replaces_the_old_one(tmp_path):
    path = tmp_path / "file.json"
    atomic_write_text(path, "old")
    atomic_write_text(path, "new: ±2 m/s")
    assert path.read_text(encoding="utf-8") == "new: ±2 m/s"


def test_numbers_of_numpy_are_numbers_of_json(tmp_path):
    path = tmp_path / "file.json"
    atomic_write_json(path, {"seed": np.int64(3), "db": np.float32(0.5), "at": np.arange(2)})
    assert json.loads(path.read_text()) == {"seed": 3, "db": 0.5, "at": [0, 1]}


posix = pytest.mark.skipif(sys.platform == "win32", reason="POSIX permissions")


@pytest.fixture
def mask() -> Iterator[None]:
    """Others of the group may read what is written, and nobody else."""
    before = os.umask(0o027)
    yield
    os.umask(before)


@posix
@pytest.mark.usefixtures("mask")
def test_the_file_is_as_readable_as_any_other(tmp_path):
    atomic_write_text(tmp_path / "file.json", "text")
    with atomic_write(tmp_path / "private.json", mode=0o600):
        pass
    modes = {path.name: stat.S_IMODE(path.stat().st_mode) for path in tmp_path.iterdir()}
    assert modes == {"file.json": 0o640, "private.json": 0o600}


@posix
@pytest.mark.usefixtures("mask")
def test_files_of_other_threads_keep_their_permissions_meanwhile(tmp_path, monkeypatch):
    of_the_system, modes = os.umask, []

    def create() -> None:
        path = tmp_path / "other"
        path.touch()
        modes.append(stat.S_IMODE(path.stat().st_mode))
        path.unlink()

    def interrupted(mask: int) -> int:
        before = of_the_system(mask)
        other = threading.Thread(target=create)  # which the system may let run at any time
        other.start()
        other.join()
        return before

    with monkeypatch.context() as patched:
        patched.setattr(os, "umask", interrupted)
        os.umask(0o027)  # the mask as it is
        atomic_write_text(tmp_path / "file.json", "text")
    assert {*modes} == {0o640}


def test_an_error_reads_as_sentences():
    error = Sd2Error("a.npz has 3 frames but 4 times", "one time per frame", "Write it again.")
    assert str(error) == (
        "a.npz has 3 frames but 4 times. Expected: one time per frame. Write it again."
    )


def test_a_link_is_written_through_to_its_target(tmp_path):
    target, link = tmp_path / "elsewhere" / "file.json", tmp_path / "link.json"
    target.parent.mkdir()
    target.write_text("old")
    link.symlink_to(target)
    atomic_write_text(link, "new")
    assert link.is_symlink()
    assert target.read_text() == "new"


def test_the_longest_name_that_a_file_may_have(tmp_path):
    path = tmp_path / ("a" * 250 + ".json")
    check_writable(path)
    atomic_write_text(path, "text")
    assert path.read_text() == "text"


def test_what_cannot_be_written_is_known_before_and_named(tmp_path):
    folder, orphan = tmp_path / "folder.json", tmp_path / "no" / "file.json"
    folder.mkdir()
    for path, error in ((folder, IsADirectoryError), (orphan, FileNotFoundError)):
        for attempt in (check_writable, lambda path: atomic_write_text(path, "text")):
            with pytest.raises(error) as caught:
                attempt(path)
            assert caught.value.filename == str(path)
    assert list(tmp_path.iterdir()) == [folder]


def test_looking_whether_a_file_can_be_written_leaves_no_trace(tmp_path):
    path = tmp_path / "file.json"
    check_writable(path)
    assert not list(tmp_path.iterdir())
    path.write_text("old")
    check_writable(path)
    assert [path.read_text(), *tmp_path.iterdir()] == ["old", path]


def test_a_folder_that_may_not_be_written_is_named(tmp_path, monkeypatch):
    def refuse(name, *_):
        raise PermissionError(13, "Permission denied", name)

    monkeypatch.setattr("sd2core.files.atomic.os.open", refuse)
    with pytest.raises(PermissionError) as caught:
        check_writable(tmp_path / "file.json")
    assert caught.value.filename == str(tmp_path / "file.json")


def test_a_full_disk_names_the_file(tmp_path):
    with pytest.raises(OSError, match="No space") as caught, atomic_write(tmp_path / "a.npz"):
        raise OSError(28, "No space left on device")
    assert caught.value.filename == str(tmp_path / "a.npz")


def test_what_a_killed_write_left_is_removed_and_nothing_else(tmp_path):
    path = tmp_path / "file.json"
    atomic_write_text(path, "text")
    with atomic_write(path) as stream:
        # As a kill would leave it: the write goes on after this, on no name.
        assert len(list(tmp_path.iterdir())) == 2
        copy = next(one for one in tmp_path.iterdir() if one != path)
        copy.with_name(".sd2-left.tmp").write_bytes(b"half")
        stream.write(b"new")
    remove_leftovers(tmp_path)
    assert list(tmp_path.iterdir()) == [path]
