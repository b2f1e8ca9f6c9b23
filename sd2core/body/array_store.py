"""Arrays by name, in files of a folder from which stopped work goes on."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_write
from sd2core.files.numpy_files import open_npz_file

_WHAT = "landmarks", "a file written by SD² Studio (.npz)"


class ArrayStore:
    """Arrays by name in files of a folder, which is made where it is missing; without one, none.

    Files that are damaged, or were written with another key, are not there.
    """

    def __init__(self, folder: Path | None, key: str | None = None) -> None:
        self._folder, self._key = folder, key
        if folder is not None:
            folder.mkdir(parents=True, exist_ok=True)

    def read(self, name: str) -> dict[str, Any] | None:
        """Arrays of a name, or None if they are not there."""
        if self._folder is None:
            return None
        try:
            arrays, meta = read_arrays(self._folder / name)
        except Sd2Error:
            return None
        return arrays if meta.get("key") == self._key else None

    def write(self, name: str, arrays: Mapping[str, Any]) -> None:
        """Keep arrays under a name, in one step."""
        if self._folder is None:
            return
        named: dict[str, Any] = {"meta": np.array(json.dumps({"key": self._key})), **arrays}
        with atomic_write(self._folder / name) as stream:
            np.savez_compressed(stream, **named)


def read_arrays(path: Path) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
    """Arrays of a file and their description; no pickle is executed."""
    if not path.exists():
        raise Sd2Error(f"{path} does not exist", "a file of landmarks (.npz)")
    with open_npz_file(path, *_WHAT) as data:
        arrays = dict(data)
        meta = json.loads(str(arrays.pop("meta")))
    if not isinstance(meta, dict):
        raise unreadable(path, "no description")
    return arrays, meta


def unreadable(path: Path, why: object) -> Sd2Error:
    """Error for a file that holds something else."""
    return Sd2Error(f"{path} cannot be read as {_WHAT[0]} ({why})", _WHAT[1])
