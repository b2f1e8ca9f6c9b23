"""Limits on what is opened and read: files of data, and sizes judged before they are believed."""

from __future__ import annotations

import os
import re
import stat
from pathlib import Path
from typing import BinaryIO

from sd2core.errors import Sd2Error

VARIABLE = "SD2_READ_LIMIT_GB"
"""Environment variable that raises the limit for commands and the window."""
DEFAULT_LIMIT_BYTES = 256 * 10**6
_FEW_CHUNKS = 10_000
_LOOKED_AT_BYTES = 512
_LFS_POINTER = b"version https://git-lfs.github.com/spec/"
_HTML = re.compile(rb"(\xef\xbb\xbf)?\s*(<!--.*?-->\s*)*<(!doctype\s+html|html)\b", re.I | re.S)
MULTIPLE = 50
"""Size that numbers may have, as a multiple of the file that holds them, above the limit."""


def read_limit_bytes(stored_bytes: int = 0) -> int:
    """Bytes of memory that what is read from a file may take.

    Parameters
    ----------
    stored_bytes : int, optional
        Size of the file. Numbers that are really there, or compressed to a fiftieth, are read
        whatever the limit.

    Raises
    ------
    Sd2Error
        If the environment variable ``SD2_READ_LIMIT_GB`` is no positive number.
    """
    text = os.environ.get(VARIABLE, "")
    try:
        limit = float(text) * 1e9 if text else DEFAULT_LIMIT_BYTES
        if not limit > 0:
            raise ValueError
        return max(int(min(limit, 2**62)), MULTIPLE * stored_bytes)
    except ValueError as error:
        raise Sd2Error(
            f"The environment variable {VARIABLE} is {text!r}",
            "gigabytes that may be read from one file, such as 4",
            "Change it, or take it away",
        ) from error


def check_size(place: str | Path, declared_bytes: int, stored_bytes: int = 0) -> None:
    """Raise Sd2Error if what ``place``, a file and what is in it, declares is over the limit."""
    limit = read_limit_bytes(stored_bytes)
    if declared_bytes > limit:
        raise Sd2Error(
            f"{place} declares {_size(declared_bytes)}, in a file of {_size(stored_bytes)}",
            f"at most {_size(limit)}: {MULTIPLE} times the file, and for a small one"
            f" {_size(read_limit_bytes())}",
            f"If the file is to be trusted, set the environment variable {VARIABLE} to"
            f" {declared_bytes / 1e9 + 0.1:.1f}",
        )


def check_chunk_count(place: str | Path, declared: int, stored: int) -> None:
    """Raise Sd2Error if an array declares far more chunks than are there to be looked at."""
    most = _FEW_CHUNKS + MULTIPLE * stored
    if declared > most:
        raise Sd2Error(
            f"{place} declares {declared:,} chunks, of which {stored:,} are stored",
            f"at most {most:,} for these",
            "Copy it again from where it came, or write it again",
        )


def check_regular(path: Path) -> None:
    """Raise Sd2Error if a path is no file of data: the door that all readers go through.

    That is a pipe, a device or a socket, which may never end; and what stands under the name of
    a file that was not fetched: a pointer of Git LFS, or a page of a web site. A path at which
    there is nothing is not refused here, but by whoever opens it.
    """
    try:
        mode = path.stat().st_mode
    except (OSError, ValueError):
        return
    if stat.S_ISREG(mode):
        check_fetched(path)
    elif not stat.S_ISDIR(mode):
        raise Sd2Error(
            f"{path} is {_KINDS.get(stat.S_IFMT(mode), 'a special file')}",
            "a regular file or a folder",
            "Copy what it gives into a file, and name that",
        )


def check_there(path: Path, expected: str, remedy: str = "Check the path") -> None:
    """Raise Sd2Error if there is nothing at a path, or what :func:`check_regular` refuses."""
    if not path.exists():
        raise Sd2Error(f"{path} does not exist", expected, remedy)
    check_regular(path)


def check_fetched(path: Path | None) -> None:
    """Raise Sd2Error if a file is a pointer of Git LFS, or a web page."""
    if path is None:
        return
    try:
        with path.open("rb") as stream:
            start = stream.read(_LOOKED_AT_BYTES)
    except OSError:  # said by whoever opens it
        return
    if start.startswith(_LFS_POINTER):
        raise Sd2Error(
            f"{path} is a pointer of Git LFS: the repository was cloned without its large files",
            "the file that it stands for",
            "Run `git lfs install` and `git lfs pull` in the repository, or download the file from"
            " its page",
        )
    if _HTML.match(start):
        raise Sd2Error(
            f"{path} is a web page (HTML), saved under the name of a file",
            "the file itself",
            "Download it again: by its raw link, after signing in if the site asks for it",
        )


def open_regular(path: Path) -> BinaryIO:
    """Open a file to read its bytes; Sd2Error as :func:`check_regular`."""
    check_regular(path)
    return path.open("rb")


def check_regular_within(folder: Path) -> int:
    """Count the files in a folder, at any depth; Sd2Error if one is not regular."""
    files = 0
    with os.scandir(folder) as entries:
        for entry in entries:
            if entry.is_dir(follow_symlinks=False):
                files += check_regular_within(Path(entry))
            else:
                files += 1
                if not entry.is_file():  # Costs no call to the system, as a rule.
                    check_regular(Path(entry))
    return files


def size_bytes(path: Path) -> int:
    """Size of a file, or of all files in a folder."""
    files = [path] if path.is_file() else path.rglob("*")
    return sum(one.stat().st_size for one in files if one.is_file())


_KINDS = {
    stat.S_IFIFO: "a named pipe",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
    stat.S_IFSOCK: "a socket",
}


def _size(size_bytes: int) -> str:
    for unit, name in ((1e12, "TB"), (1e9, "GB"), (1e6, "MB"), (1e3, "kB")):
        if size_bytes >= unit:
            return f"{size_bytes / unit:.1f} {name}"
    return f"{size_bytes} bytes"
