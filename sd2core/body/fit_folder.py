"""The folder of a fit under way: what may be there, and whose it is."""

from __future__ import annotations

import json
import shutil
import sys
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from sd2core.body.landmarks import SIGHTINGS
from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_write_text
from sd2core.version import __version__

PARTIAL = ".partial"
"""What the folder's name has after that of the mesh."""

MARKER = "sd2-fit.json"
"""A file that tells it is ours."""

LANDMARKS = "landmarks"
"""The folder in it for what a search for landmarks keeps."""

_LOCK = "lock"


def check_fit_output(out: Path) -> None:
    """Refuse a mesh's name that cannot be written, or that is something else, before the work.

    Raises
    ------
    Sd2Error
    """
    if out.suffix.lower() not in (".zarr", ".npz"):
        raise Sd2Error(
            f"The mesh is to be written as {out.name}", "a name that ends in .zarr or .npz"
        )
    if not out.absolute().parent.is_dir():
        raise Sd2Error(
            f"The folder {out.absolute().parent} does not exist", "an existing folder for the mesh"
        )
    # `mktemp` leaves an empty file to be filled.
    if out.exists() and not (_is_mesh(out) or (out.is_file() and not out.stat().st_size)):
        raise Sd2Error(
            f"{out} exists and is no mesh",
            "a new name, or a mesh to replace",
            "Choose another name, or delete it first",
        )
    partial = out.with_name(out.name + PARTIAL)
    if partial.exists() and not _is_ours(partial):
        raise Sd2Error(
            f"{partial} exists and is not what a stopped fit has left",
            "that name free for the work",
            "Choose another name, or move it away",
        )


def _is_mesh(path: Path) -> bool:
    """Whether a file or folder holds vertices by that name."""
    if path.is_dir():
        return (path / "vertices").is_dir()
    try:
        with zipfile.ZipFile(path) as archive:
            return "vertices.npy" in archive.namelist()
    except (OSError, zipfile.BadZipFile):
        return False


def _is_ours(partial: Path) -> bool:
    if not partial.is_dir():
        return False
    names = {path.name for path in partial.iterdir()}
    return MARKER in names or names <= {_LOCK}


@contextmanager
def claim_folder(partial: Path, restart: bool) -> Iterator[None]:
    """Make the folder of the work, or take it over; nobody else's until the end.

    Raises
    ------
    Sd2Error
        When another process is at it.
    """
    partial.mkdir(exist_ok=True)
    with (partial / _LOCK).open("ab") as lock:
        try:
            _lock(lock)
        except OSError as error:
            raise Sd2Error(
                f"{partial} is in use: another process fits the same mesh",
                "one at a time",
                "Wait until it is done, or write another mesh",
            ) from error
        if restart:
            for path in partial.iterdir():
                if path.is_dir():
                    shutil.rmtree(path)
                elif path.name != _LOCK:
                    path.unlink()
        text = json.dumps({"format": "sd2-fit-partial", "version": 1, "made_by": __version__})
        atomic_write_text(partial / MARKER, text + "\n")
        yield


@contextmanager
def remove_without_landmarks(partial: Path) -> Iterator[None]:
    """Remove the folder when the video turns out not to be one of a person."""
    try:
        yield
    except Sd2Error:
        if not (partial / LANDMARKS / SIGHTINGS).exists():
            shutil.rmtree(partial, ignore_errors=True)
        raise


def _lock(stream: IO[bytes]) -> None:
    """Lock an open file against other processes; it is unlocked when closed, also by a kill."""
    if sys.platform == "win32":
        import msvcrt

        msvcrt.locking(stream.fileno(), msvcrt.LK_NBLCK, 1)
    else:
        import fcntl

        fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
