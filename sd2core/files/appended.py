"""Files that are appended to while they may be deleted."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

_COPIED_BYTES = 1 << 20


class AppendedFile:
    """File that is appended to, and that can be put back where it was deleted meanwhile."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._stream = path.open("a+b", buffering=0)

    def write(self, content: bytes | memoryview) -> None:
        """Append all of it: the system may take less at a time."""
        left = memoryview(content)
        while len(left):
            left = left[self._stream.write(left) or 0 :]

    @property
    def is_there(self) -> bool:
        """True while its path leads to it."""
        try:
            status = self._path.stat()
        except OSError:
            return False
        return os.path.samestat(status, os.fstat(self._stream.fileno()))

    def put_back(self) -> None:
        """Write what it holds to its path again, unless it is there, and append to that."""
        if self.is_there:
            return
        self._path.parent.mkdir(parents=True, exist_ok=True)
        again = self._path.open("w+b", buffering=0)
        self._stream.seek(0)
        shutil.copyfileobj(self._stream, again, _COPIED_BYTES)
        self._stream.close()
        self._stream = again

    def close(self) -> None:
        """Close it."""
        self._stream.close()
