"""Lock on a file that ends with the process that holds it.

The system releases it however the process ends, and no later process inherits it, as one may
inherit a number: so it tells a running process from one that died.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import IO

if sys.platform == "win32":
    import msvcrt

    def _grab(stream: IO[bytes]) -> bool:
        stream.seek(0)
        try:
            msvcrt.locking(stream.fileno(), msvcrt.LK_NBLCK, 1)
        except OSError:
            return False
        return True

    def _is_held(stream: IO[bytes]) -> bool:
        # There is no shared lock here: other processes that just look are gone in an instant.
        for _ in range(5):
            if _grab(stream):
                return False
            time.sleep(0.01)
        return True
else:
    import fcntl

    def _grab(stream: IO[bytes]) -> bool:
        try:
            fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            return False
        return True

    def _is_held(stream: IO[bytes]) -> bool:
        # A shared lock: all who look get one at the same time, unless a process holds the lock.
        try:
            fcntl.flock(stream, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except OSError:
            return True
        return False


class FileLock:
    """Exclusive lock on a file, which is made if it is not there."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._stream: IO[bytes] | None = None

    def take(self) -> bool:
        """Try to lock; False if another process, or this one, holds the lock."""
        stream = self._path.open("ab")
        if not _grab(stream):
            stream.close()
            return False
        self._stream = stream
        return True

    def release(self) -> None:
        """Unlock."""
        if self._stream is not None:
            self._stream.close()
            self._stream = None


def is_locked(path: Path) -> bool:
    """True if a process holds the lock."""
    if not path.exists():
        return False
    try:
        with path.open("ab") as stream:
            return _is_held(stream)
    except OSError:  # another user's file, or one that was deleted just now
        return False
