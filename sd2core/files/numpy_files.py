"""Arrays in NumPy's ``.npz`` files, whose sizes are judged before they are read."""

from __future__ import annotations

import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any, cast

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.files.limits import check_regular, check_size, open_regular, size_bytes
from sd2core.files.texts import reading_as


class NpzArrays(np.lib.npyio.NpzFile):
    """Arrays of an open ``.npz`` by name, each read when asked for; no pickle is executed."""

    zip: Any  # the archive

    def __getitem__(self, name: str) -> NDArray[Any]:
        array = super().__getitem__(name)
        if not isinstance(array, np.ndarray):
            raise ValueError(f"{name} is no array")
        return array


@contextmanager
def open_npz_file(path: Path, what: str, expected: str, remedy: str = "") -> Iterator[NpzArrays]:
    """Open an ``.npz``, whose arrays are read where asked for.

    Parameters
    ----------
    path : Path
    what : str
        Name of the content in the message: "… cannot be read as ``what``".
    expected : str
        What was expected, for the message.
    remedy : str
        What to do, for the message.

    Yields
    ------
    NpzArrays

    Raises
    ------
    Sd2Error
        If it is damaged or declares more than its size allows, also for what goes wrong while it is
        open, except in another file.
    """
    try:
        with open_zip(path) as archive, NpzArrays(cast(IO[bytes], archive.fp)) as arrays:
            # A note, a folder or whatever else was packed with them is no array.
            arrays.files = [name[:-4] for name in archive.namelist() if name.endswith(".npy")]
            yield arrays
    except Sd2Error:
        raise
    except Exception as error:  # a damaged archive fails in many ways
        of_another_file = isinstance(error, OSError) and error.filename not in (None, str(path))
        if of_another_file:  # that is written meanwhile
            raise
        if isinstance(error, PermissionError):
            found = f"{path} may not be read ({error.strerror})"
            raise Sd2Error(found, "permission to read") from error
        raise Sd2Error(f"{path} cannot be read as {what} ({error})", expected, remedy) from error


def open_npy_file(path: Path, expected: str, remedy: str = "") -> NDArray[Any]:
    """Map the array in an ``.npy``, so that what its header says is compared with its size."""
    check_regular(path)
    with reading_as("an array", f"{path} ({size_bytes(path)} bytes)", expected, remedy):
        return np.load(path, mmap_mode="r", allow_pickle=False)


def read_words(path: Path, kind: np.dtype[Any], place: slice) -> NDArray[Any]:
    """Read the numbers from one to another of a file; Sd2Error where it is shorter by now.

    Of a file that is mapped instead, what is cut off, or is on a disk that is pulled out, ends the
    process once it is looked at.
    """
    count = place.stop - place.start
    words: NDArray[Any] = np.fromfile(path, kind, count, offset=place.start * kind.itemsize)
    if len(words) != count:
        raise Sd2Error(f"{path} has become shorter", "all that was there at first", "Open it again")
    return words


def npz_names(path: Path) -> set[str]:
    """Names of the arrays in an ``.npz``; none in a damaged one, which its reader refuses."""
    try:
        with open_regular(path) as stream, zipfile.ZipFile(stream) as archive:
            return {name.removesuffix(".npy") for name in archive.namelist()}
    except (Sd2Error, OSError, ValueError, NotImplementedError, zipfile.BadZipFile):
        return set()


@contextmanager
def open_zip(path: Path) -> Iterator[zipfile.ZipFile]:
    """Open a zip to read; Sd2Error if its files are larger than its size allows."""
    with open_regular(path) as stream, zipfile.ZipFile(stream) as archive:
        # No more is ever decompressed than a file's entry says.
        declared = sum(entry.file_size for entry in archive.infolist())
        check_size(path, declared, path.stat().st_size)
        yield archive


def read_array_header(stream: IO[bytes]) -> tuple[tuple[int, ...], bool, np.dtype[Any]]:
    """Shape, True if by columns, and type of the array in an ``.npy``; ValueError if none."""
    read: Any = (
        np.lib.format.read_array_header_1_0
        if np.lib.format.read_magic(stream) == (1, 0)
        else np.lib.format.read_array_header_2_0
    )
    shape, by_column, dtype = read(stream)
    return shape, by_column, dtype
