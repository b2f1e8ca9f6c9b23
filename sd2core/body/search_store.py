"""What is kept of a search for landmarks, so that it can go on, and be read in parts."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from sd2core.body.landmark_files import read_arrays, write_arrays
from sd2core.body.person_selection import Rectangle
from sd2core.errors import Sd2Error
from sd2core.io.video import VideoReader

_VERSION = 1


class SearchStore:
    """Arrays by name: files of a folder, or without one in memory.

    Files of another search are as if they were not there.

    Parameters
    ----------
    folder : Path, optional
    video : VideoReader
    person : Rectangle, optional
    silhouettes : int, optional
        What was asked for, which is what a search is known by.
    """

    def __init__(
        self,
        folder: Path | None,
        video: VideoReader,
        person: Rectangle | None,
        silhouettes: int | None,
    ) -> None:
        self._folder = folder
        self._in_memory: dict[str, dict[str, Any]] = {}
        if folder is None:
            return
        folder.mkdir(parents=True, exist_ok=True)
        about = os.stat(video.path)
        identity = {
            "version": _VERSION,
            "video": [str(video.path.resolve()), about.st_size, about.st_mtime_ns],
            "frames": [len(video), video.width, video.height],
            "person": None if person is None else list(vars(person).values()),
            "silhouettes": silhouettes,
        }
        self._key = hashlib.sha256(json.dumps(identity).encode()).hexdigest()

    def read(self, name: str) -> dict[str, Any] | None:
        """What was written under a name, if it is there and of this search."""
        if self._folder is None:
            return self._in_memory.get(name)
        if not (self._folder / name).is_file():
            return None
        try:
            arrays, meta = read_arrays(self._folder / name)
        except Sd2Error:
            return None
        return arrays if meta.get("key") == self._key else None

    def write(self, name: str, arrays: Mapping[str, Any]) -> None:
        """Keep arrays under a name."""
        if self._folder is None:
            self._in_memory[name] = dict(arrays)
        else:
            write_arrays(self._folder / name, arrays, {"key": self._key})
