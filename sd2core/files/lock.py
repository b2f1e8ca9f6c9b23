"""Lock on a file that ends with the process that holds it.

The system releases it however the process ends, and no later process inherits it, as one may
inherit a number: so it tells a running process from one that died.
"""

from __future__ import annotations

import errno
import os
import sys
import time
from contextlib import suppress
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
        except OSError as error:
            if error.errno not in (errno.EWOULDBLOCK, errno.EACCES):
                raise  # this file system keeps no locks
            return False
        return True

    def _is_held(stream: IO[bytes]) -> bool:
        # A shared lock: all who look get one at the same time, unless a process holds the lock.
        try:
            fcntl.flock(stream, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except OSError as error:
            return error.errno in (errno.EWOULDBLOCK, errno.EACCES)
        return False


class FileLock:
    """Exclusive lock on a file, which is made if it is not there."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._stream: IO[bytes] | None = None

    def take(self) -> bool:
        """Try to lock; False if another process, or this one, holds the lock.

        Raises OSError where the file cannot be opened, or the file system keeps no locks.
        """
        while True:
            stream = _opened(self._path)
            try:
                grabbed = _grab(stream)
            except OSError as error:
                stream.close()
                raise OSError(error.errno, error.strerror, str(self._path)) from error
            if grabbed and _is_at(stream, self._path):
                self._stream = stream
                return True
            stream.close()
            if not grabbed:
                return False
            # The one who held it deleted it meanwhile: nobody else would see this lock.

    def release(self, *, delete: bool = False) -> None:
        """Unlock, and delete the file where asked to and possible."""
        if self._stream is not None:
            if delete and _is_at(self._stream, self._path):
                with suppress(OSError):
                    self._path.unlink()
            self._stream.close()
            self._stream = None


def is_locked(path: Path) -> bool:
    """True if a process holds the lock."""
    if not path.exists():
        return False
    try:
        with _opened(path) as stream:
            return _is_held(stream)
    except OSError:  # a file that nobody but another user may open, or that was deleted just now
        return False


def _opened(path: Path) -> IO[bytes]:
    try:
        return path.open("ab")
    except PermissionError:
        if not path.exists():
            raise
        return path.open("rb")  # another user's file can be locked as well


def _is_at(stream: IO[bytes], path: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(stream.fileno()), path.stat())
    except OSError:
        return False
