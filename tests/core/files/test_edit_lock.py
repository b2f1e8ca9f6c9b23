"""Lock beside a recording: between processes, between machines, and what is left behind."""

from __future__ import annotations

import errno
import json
import os
import socket
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from lock_holders import held

import sd2core.files.lock as locks
from sd2core.files.edit_lock import GONE_AFTER_S, EditLock, Holder, edit_lock

POSIX = pytest.mark.skipif(sys.platform == "win32", reason="takes away what only POSIX has")


def note(folder: Path, *, host: str, pid: int = 1, age_s: float = 0.0) -> Path:
    """What a process of some machine noted, and touched so long ago."""
    path = folder / ".edited-by.json"
    content = {"user": "anna", "host": host, "pid": pid, "since_unix_s": 1.0}
    path.write_text(json.dumps(content))
    then_s = path.stat().st_mtime - age_s
    os.utime(path, (then_s, then_s))
    return path


def no_locks(monkeypatch: pytest.MonkeyPatch) -> None:
    """A file system that keeps no locks."""

    def flock(*_: object) -> None:
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))

    monkeypatch.setattr(locks.fcntl, "flock", flock)


@pytest.fixture
def open_to_all() -> Iterator[Path]:
    """A folder that every user may write to; those of pytest are closed."""
    with tempfile.TemporaryDirectory() as name:
        os.chmod(name, 0o777)
        yield Path(name)


def gone_pid() -> int:
    """Number of a process that has ended."""
    process = subprocess.Popen([sys.executable, "-c", ""])
    process.wait()
    return process.pid


def test_one_holds_it_and_says_who(tmp_path: Path) -> None:
    first, second = edit_lock(tmp_path), edit_lock(tmp_path)
    assert first.take()
    assert first.take()
    assert not second.take()
    holder = second.holder()
    assert holder is not None
    assert (holder.host, holder.pid) == (socket.gethostname(), os.getpid())
    assert first.holder() == holder
    first.release()
    assert second.holder() is None
    assert second.take()
    second.release()


def test_nothing_is_left_in_the_folder(tmp_path: Path) -> None:
    lock = edit_lock(tmp_path)
    assert lock.take()
    assert list(tmp_path.iterdir())
    lock.release()
    assert list(tmp_path.iterdir()) == []


def test_it_ends_with_its_process_whatever_the_note_says(tmp_path: Path) -> None:
    lock = edit_lock(tmp_path)
    process = held(tmp_path / ".edited.lock")
    try:
        note(tmp_path, host=socket.gethostname(), pid=process.pid)
        assert not lock.take()
        assert str(lock.holder()) == f"anna on {socket.gethostname()} (process {process.pid})"
    finally:
        process.kill()
        process.communicate()
    assert lock.take()
    lock.release()


def test_a_process_of_another_machine_holds_it_while_it_touches_its_note(tmp_path: Path) -> None:
    lock, path = edit_lock(tmp_path), note(tmp_path, host="elsewhere", age_s=GONE_AFTER_S - 60)
    assert not lock.take()
    assert not lock.held
    assert lock.holder() == Holder("anna", "elsewhere", 1, 1.0)
    then_s = path.stat().st_mtime - 120
    os.utime(path, (then_s, then_s))
    assert lock.take()
    lock.release()


def test_a_beat_makes_the_note_new(tmp_path: Path) -> None:
    lock = edit_lock(tmp_path)
    assert lock.take()
    path = tmp_path / ".edited-by.json"
    os.utime(path, (1.0, 1.0))
    lock.heartbeat()
    assert path.stat().st_mtime > 1.0
    # Of one who took it over, while this machine slept, nothing is touched.
    note(tmp_path, host="elsewhere")
    os.utime(path, (1.0, 1.0))
    lock.heartbeat()
    assert path.stat().st_mtime == 1.0
    lock.release()
    assert path.exists()


@POSIX
def test_without_locks_of_the_file_system_the_note_decides(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    no_locks(monkeypatch)
    first, second = edit_lock(tmp_path), edit_lock(tmp_path)
    assert first.take()
    assert not second.take()
    assert second.holder() == first.holder()
    first.release()
    note(tmp_path, host=socket.gethostname(), pid=gone_pid())
    assert second.take()
    second.release()


@POSIX
def test_what_cannot_be_written_is_an_error_not_a_lock(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    no_locks(monkeypatch)
    lock = EditLock(tmp_path / "there.lock", tmp_path / "missing" / "by.json")
    with pytest.raises(OSError, match="No such file"):
        lock.take()
    assert not lock.held


@pytest.mark.skipif(
    sys.platform == "win32" or os.geteuid() != 0, reason="only root can be another user"
)
def test_the_file_of_another_user_is_respected(open_to_all: Path) -> None:
    first, second = edit_lock(open_to_all), edit_lock(open_to_all)
    assert first.take()
    os.seteuid(65534)
    try:
        assert not second.take()
        assert second.holder() == first.holder()
        # The end of a process leaves its file, which the other user cannot write to.
        first._lock.release()
        assert second.take()
        second.release()
    finally:
        os.seteuid(0)


def test_a_lock_on_a_deleted_file_is_none(tmp_path: Path) -> None:
    first, second = locks.FileLock(tmp_path / "lock"), locks.FileLock(tmp_path / "lock")
    assert first.take()
    first.release(delete=True)
    assert not (tmp_path / "lock").exists()
    assert second.take()
    assert locks.is_locked(tmp_path / "lock")
    second.release()
