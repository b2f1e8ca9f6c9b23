"""Hashes of contents are taken once, and again when a file changes."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from sd2core.files import digests as contents
from sd2core.files.digests import cached_digest, file_digest


@pytest.fixture
def taken(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[Path]:
    """What is really hashed."""
    found: list[Path] = []

    def counted(path: Path) -> str:
        found.append(path)
        return file_digest(path)

    monkeypatch.setattr(contents, "file_digest", counted)
    monkeypatch.setattr(contents, "_WORTH_KEEPING_BYTES", 10)
    monkeypatch.setattr("platformdirs.user_cache_dir", lambda *_, **__: str(tmp_path / "cache"))
    return found


def test_a_file_is_hashed_again_when_it_changes(tmp_path: Path, taken: list[Path]) -> None:
    path = tmp_path / "mesh.npz"
    path.write_bytes(b"0123456789")
    first = cached_digest(path)
    assert first == file_digest(path)
    assert cached_digest(path) == first
    assert taken == [path]
    facts = path.stat()
    path.write_bytes(b"9876543210")
    os.utime(path, ns=(facts.st_atime_ns, facts.st_mtime_ns + 1))
    assert cached_digest(path) == file_digest(path) != first
    assert taken == [path, path]


def test_a_folder_changes_with_what_is_in_it(tmp_path: Path, taken: list[Path]) -> None:
    folder = tmp_path / "mesh.zarr"
    (folder / "c").mkdir(parents=True)
    (folder / "c" / "0").write_bytes(b"0123456789")
    first = cached_digest(folder)
    assert cached_digest(folder) == first
    assert taken.count(folder) == 1
    (folder / "c" / "1").write_bytes(b"")
    assert cached_digest(folder) != first
    (folder / "c" / "1").unlink()
    assert cached_digest(folder) == first


def test_what_is_small_is_not_kept(tmp_path: Path, taken: list[Path]) -> None:
    path = tmp_path / "labels.json"
    path.write_bytes(b"{}")
    assert cached_digest(path) == cached_digest(path) == file_digest(path)
    assert not (tmp_path / "cache").exists()
    assert cached_digest(tmp_path / "nothing") == ""


@pytest.mark.parametrize("kept", ["", "{}", "[1]", '{"files": 3, "digests": {}}'])
def test_a_damaged_note_is_as_none(tmp_path: Path, taken: list[Path], kept: str) -> None:
    path = tmp_path / "mesh.npz"
    path.write_bytes(b"0123456789")
    cached_digest(path)
    (note,) = (tmp_path / "cache" / "contents").iterdir()
    note.write_text(kept)
    assert cached_digest(path) == file_digest(path)
    (tmp_path / "cache" / "contents").rename(tmp_path / "gone")
    (tmp_path / "cache" / "contents").write_text("a file in the way")
    assert cached_digest(path) == file_digest(path)
