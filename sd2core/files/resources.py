"""Files that come with the program, in a checkout and in a wheel."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sd2core.errors import Sd2Error
from sd2core.files.texts import check_version

if TYPE_CHECKING:
    from numpy.typing import NDArray

_PACKAGE = Path(__file__).resolve().parent.parent
_FOLDERS = (_PACKAGE / "resources", _PACKAGE.parent / "resources")


def is_bundled(path: Path) -> bool:
    """True if a path belongs to the program and must not be written to."""
    return any(Path(path).resolve().is_relative_to(folder) for folder in _FOLDERS)


def resource_path(name: str) -> Path:
    """Path of a bundled file or folder, e.g. ``resource_path("swipes.sd2")``.

    A wheel carries the resources inside the package; a checkout keeps them
    beside it.
    """
    for folder in _FOLDERS:
        if (folder / name).exists():
            return folder / name
    raise Sd2Error(
        f"The bundled file {name} is in neither {_FOLDERS[0]} nor {_FOLDERS[1]}",
        "an installation with its resources",
        "Install SD² Studio again",
    )


def bundled_files(pattern: str) -> list[Path]:
    """Files that come with the program, e.g. ``bundled_files("*.safetensors")``, by name."""
    for folder in _FOLDERS:
        if folder.is_dir():
            return sorted(folder.glob(pattern))
    return []


@contextmanager
def open_bundled_arrays(
    path: Path, kind: str, version: int, what: str, command: str, *, oldest: int = 0
) -> Iterator[tuple[dict[str, Any], Mapping[str, NDArray[Any]]]]:
    """Open an ``.npz`` whose ``meta`` tells its format; arrays are read where asked for.

    Parameters
    ----------
    path : Path
    kind : str
        Name of the format that is wanted.
    version : int
        Latest version that is read.
    what : str
        What it holds, for the error.
    command : str
        Command that writes it, for the error.
    oldest : int
        Earliest version that is read.

    Yields
    ------
    meta : dict
    arrays : mapping of str to array

    Raises
    ------
    Sd2Error
        If the file is missing, damaged, of another format or version, or lacks an array that is
        asked for while it is open.
    """
    from sd2core.files.numpy_files import open_npz_file

    with open_npz_file(path, what, f"a file written by `{command}`") as data:
        meta = json.loads(str(data["meta"]))
        check_version(meta, path, kind, version, oldest=0)
        # What wrote a later one opens it; an earlier one is to be made anew.
        anew = f"Make it anew with `{command}`"
        check_version(meta, path, kind, version, oldest=oldest, remedy=anew)
        yield meta, data
