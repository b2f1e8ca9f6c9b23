from __future__ import annotations

import os
import stat
import sys

import pytest

from sd2core.atomic import atomic_write, atomic_write_text
from sd2core.errors import Sd2Error


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


@pytest.mark.skipif(sys.platform == "win32", reason="POSIX permissions")
def test_the_file_is_as_readable_as_any_other(tmp_path):
    path, plain = tmp_path / "file.json", tmp_path / "plain"
    before = os.umask(0o022)
    try:
        atomic_write_text(path, "text")
        plain.write_text("text")
    finally:
        os.umask(before)
    assert stat.S_IMODE(path.stat().st_mode) == stat.S_IMODE(plain.stat().st_mode)


def test_an_error_reads_as_sentences():
    error = Sd2Error("a.npz has 3 frames but 4 times", "one time per frame", "Write it again.")
    assert str(error) == (
        "a.npz has 3 frames but 4 times. Expected: one time per frame. Write it again."
    )
