"""Folder of a running fit: checks before it starts, ownership and clean-up."""

from __future__ import annotations

import json
import shutil
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from sd2core.body.landmarks import SIGHTINGS
from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_write_text
from sd2core.files.lock import FileLock
from sd2core.version import __version__

PARTIAL = ".partial"
"""Suffix of the folder's name, after the name of the mesh."""

MARKER = "sd2-fit.json"
"""File that marks the folder as one of a fit."""

LANDMARKS = "landmarks"
"""Sub-folder in which the search for landmarks keeps its results."""

_LOCK = "lock"


def check_fit_output(out: Path) -> None:
    """Raise Sd2Error for an output mesh that cannot be written, before the work starts."""
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
    """True if a file or folder holds an array named ``vertices``."""
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
    """Make or take over the folder of a fit and lock it against other processes.

    Raises Sd2Error if another process uses it.
    """
    partial.mkdir(exist_ok=True)
    lock = FileLock(partial / _LOCK)
    if not lock.take():
        raise Sd2Error(
            f"{partial} is in use: another process fits the same mesh",
            "one at a time",
            "Wait until it is done, or write another mesh",
        )
    try:
        if restart:
            for path in partial.iterdir():
                if path.is_dir():
                    shutil.rmtree(path)
                elif path.name != _LOCK:
                    path.unlink()
        text = json.dumps({"format": "sd2-fit-partial", "version": 1, "made_by": __version__})
        atomic_write_text(partial / MARKER, text + "\n")
        yield
    finally:
        lock.release()


@contextmanager
def remove_without_landmarks(partial: Path) -> Iterator[None]:
    """Remove the folder when the fit fails before the person was found."""
    try:
        yield
    except Sd2Error:
        if not (partial / LANDMARKS / SIGHTINGS).exists():
            shutil.rmtree(partial, ignore_errors=True)
        raise
