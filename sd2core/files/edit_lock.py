"""Lock that says who edits: seen by everybody who can write to its folder, on any machine.

Where the file system keeps locks, they decide between processes that it knows of. A note says who
holds the lock, and is touched now and then: it decides between machines whose file systems do not
tell each other of locks, and where none are kept. What is assumed there: a process that is no
longer on this machine has ended, and so has one of another machine whose note is older than
:data:`GONE_AFTER_S`. Its age is told by the clock that dates the files, not by two machines' own.
"""

from __future__ import annotations

import getpass
import json
import os
import socket
import time
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path

from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_write_text
from sd2core.files.lock import FileLock, is_locked
from sd2core.files.texts import read_json
from sd2core.processes import ProcessId

HEARTBEAT_EVERY_S = 60.0
"""Time after which the holder touches its note: :meth:`EditLock.heartbeat`."""
GONE_AFTER_S = 600.0
"""Age of a note whose process, on another machine, is taken to have ended."""


@dataclass(frozen=True)
class Holder:
    """Process that edits; empty or 0 where unknown."""

    user: str = ""
    host: str = ""
    pid: int = 0
    since_unix_s: float = 0.0

    def __str__(self) -> str:
        who = self.user or "Another user"
        return f"{who} on {self.host} (process {self.pid})" if self.host else who


class EditLock:
    """Lock on a file, with a note beside it that says who holds it."""

    def __init__(self, lock: Path, note: Path) -> None:
        self._lock_path, self._note = lock, note
        self._lock = FileLock(lock)
        self._mine: Holder | None = None

    @property
    def held(self) -> bool:
        """True while this object holds the lock."""
        return self._mine is not None

    def take(self) -> bool:
        """Take the lock; False where another process holds it.

        Raises OSError where neither lock nor note can be written.
        """
        if self.held:
            return True
        try:
            locked = self._lock.take()
        except OSError:
            if self._at_work(locks_kept=False) is not None:
                return False
            self._mine = self._noted_anew()
            return True
        if not locked:
            return False
        if self._at_work(locks_kept=True) is not None:
            self._lock.release()
            return False
        self._mine = _self()
        with suppress(OSError):  # the lock is held all the same
            self._mine = self._noted_anew()
        return True

    def heartbeat(self) -> None:
        """Tell other machines that the holder is still there."""
        if self.held and self._noted() == self._mine:
            with suppress(OSError):
                os.utime(self._note)

    def release(self) -> None:
        """Release the lock, and delete lock and note."""
        if not self.held:
            return
        if self._noted() == self._mine:
            with suppress(OSError):
                self._note.unlink()
        self._lock.release(delete=True)
        self._mine = None

    def holder(self) -> Holder | None:
        """Return the process that holds the lock, this or another one; None where it is free."""
        if is_locked(self._lock_path):
            return self._noted() or Holder()
        return self._mine or self._at_work(locks_kept=False)

    def _at_work(self, *, locks_kept: bool) -> Holder | None:
        """Process that the note names, if it may still be there; ours could take the lock."""
        noted = self._noted()
        if noted is None:
            return None
        if noted.host == socket.gethostname() and (locks_kept or ProcessId.of(noted.pid) is None):
            return None
        try:
            return noted if self._age_s() < GONE_AFTER_S else None
        except OSError:  # deleted just now
            return None

    def _age_s(self) -> float:
        now_s = time.time()
        with suppress(OSError):
            os.utime(self._lock_path)
            now_s = self._lock_path.stat().st_mtime
        return now_s - self._note.stat().st_mtime

    def _noted(self) -> Holder | None:
        try:
            return Holder(**read_json(self._note))
        except (Sd2Error, TypeError):  # not written yet, or by another version
            return None

    def _noted_anew(self) -> Holder:
        holder = _self()
        atomic_write_text(self._note, json.dumps(asdict(holder)) + "\n")
        return holder


def edit_lock(folder: Path) -> EditLock:
    """Lock on editing a recording's labels, in its folder."""
    return EditLock(folder / ".edited.lock", folder / ".edited-by.json")


def _self() -> Holder:
    return Holder(_user(), socket.gethostname(), os.getpid(), time.time())


def _user() -> str:
    try:
        return getpass.getuser()
    except (OSError, KeyError, ImportError):  # a number without a name, e.g. in a container
        return ""
