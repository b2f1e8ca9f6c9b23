"""Locks end with the processes that hold them, and do not see those who only look."""

from __future__ import annotations

from pathlib import Path

from lock_holders import held

from sd2core.files.lock import FileLock, _is_held, is_locked


def test_a_lock_ends_with_its_process(tmp_path: Path) -> None:
    path = tmp_path / "lock"
    assert not is_locked(path)
    process = held(path)
    try:
        assert is_locked(path)
        assert not FileLock(path).take()
    finally:
        process.kill()
        process.communicate()
    assert not is_locked(path)


def test_those_who_look_do_not_see_each_other(tmp_path: Path) -> None:
    path = tmp_path / "lock"
    path.touch()
    with path.open("ab") as looking:
        assert not _is_held(looking)
        # It has not gone yet.
        assert not is_locked(path)
        assert not FileLock(path).take()
    lock = FileLock(path)
    assert lock.take()
    assert is_locked(path)
    lock.release()
