"""What writes that were killed have left."""

from __future__ import annotations

import os
import shutil
import time
from pathlib import Path

_KINDS = ("inputs", "meshes", "plans", "synthetic", "denoised", "simulated")
_OLD_S = 3600.0
"""A write takes seconds. What is older belongs to nobody, also where a worker of an earlier run
may still be at its last task on another machine."""


def remove_old_leftovers(folder: Path, old_s: float = _OLD_S) -> None:
    """Delete temporary files and folders that nobody writes to any more.

    Parameters
    ----------
    folder : Path
        Of a batch.
    old_s : float
    """
    before_s = time.time() - old_s
    for kind in _KINDS:
        for shelf in _entries(folder / kind):
            for entry in _entries(Path(shelf.path)):
                if entry.name.startswith(".") and entry.name.endswith(".tmp"):
                    _remove(entry, before_s)


def _remove(entry: os.DirEntry[str], before_s: float) -> None:
    try:
        if entry.stat(follow_symlinks=False).st_mtime > before_s:
            return
        if entry.is_dir(follow_symlinks=False):
            shutil.rmtree(entry.path, ignore_errors=True)
        else:
            os.unlink(entry.path)
    except OSError:  # somebody else's, or gone meanwhile
        return


def _entries(folder: Path) -> list[os.DirEntry[str]]:
    try:
        with os.scandir(folder) as entries:
            return list(entries)
    except OSError:
        return []
