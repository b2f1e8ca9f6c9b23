"""Writing files in one step: a reader finds the old version or the new one, never half of it."""

from __future__ import annotations

import errno
import json
import os
import re
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import partial
from operator import methodcaller
from pathlib import Path
from typing import IO

_PREFIX, _SUFFIX = ".sd2-", ".tmp"

DISK_FULL = frozenset({errno.ENOSPC, errno.EFBIG, getattr(errno, "EDQUOT", errno.ENOSPC)})
"""Errors of the system that another write would meet as well."""
_SHORT_WRITE = re.compile(r"\d+ requested and \d+ written")
to_json = partial(json.dumps, ensure_ascii=False, default=methodcaller("tolist"))
"""JSON of what may hold numbers of NumPy."""


@contextmanager
def atomic_write(path: Path, mode: int = 0o666) -> Iterator[IO[bytes]]:
    """Open a binary file that replaces ``path`` when the block succeeds; see :func:`atomic_file`.

    ``mode`` are the file's permissions, of which the process's mask takes some away.
    """
    with atomic_file(path, mode) as temporary, temporary.open("wb") as stream:
        yield stream


@contextmanager
def atomic_file(path: Path, mode: int = 0o666) -> Iterator[Path]:
    """Make an empty file that replaces ``path`` when the block, which writes to it, succeeds.

    It is in the same folder, and is flushed to disk and renamed; when the block raises, ``path`` is
    untouched. Where ``path`` is a link, the file that it leads to is replaced. Raises OSError,
    whose ``filename`` is ``path``, if it cannot be written.
    """
    path = Path(path)
    target = _target(path)
    with full_disk_named(path):
        handle, temporary = _temporary(path, target, mode)
        os.close(handle)
        try:
            yield temporary
            with temporary.open("r+b") as stream:
                os.fsync(stream.fileno())
            temporary.replace(target)
        except BaseException:
            temporary.unlink(missing_ok=True)
            raise


@contextmanager
def full_disk_named(path: Path) -> Iterator[None]:
    """Have errors of a full disk name what was to be written, and what to do.

    A write to an open file fails without a name, and libraries fail after it in their own words:
    any error that a full disk led to becomes an OSError whose ``filename`` is ``path``.
    """
    try:
        yield
    except Exception as error:
        full = _full_disk(error)
        if full is None:
            raise
        words = f"{os.strerror(full)}: free some, or write to another place"
        raise OSError(full, words, str(path)) from error


def check_writable(path: Path) -> None:
    """Raise what :func:`atomic_write` would raise where ``path`` cannot be written."""
    path = Path(path)
    handle, temporary = _temporary(path, _target(path))
    os.close(handle)
    temporary.unlink()


def atomic_write_text(path: Path, text: str) -> None:
    """Replace ``path`` by ``text`` (UTF-8) in one step."""
    with atomic_write(path) as stream:
        stream.write(text.encode("utf-8"))


def atomic_write_json(path: Path, content: object) -> None:
    """Replace ``path`` by JSON that people can read, in one step."""
    atomic_write_text(path, to_json(content, indent=2) + "\n")


def keep_text(path: Path, text: str) -> None:
    """Write a file of a cache, in a folder made for it; what cannot be written is not kept."""
    with suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        atomic_write_text(path, text)


@contextmanager
def atomic_folder(path: Path) -> Iterator[Path]:
    """Make a folder elsewhere that becomes ``path`` when the block succeeds.

    One that is there goes then; when the block raises, it stays as it was.
    """
    with full_disk_named(path):
        workspace = Path(tempfile.mkdtemp(prefix=f".{path.name}.", suffix=".tmp", dir=path.parent))
        new = workspace / path.name
        try:
            new.mkdir()
            yield new
            replace_folder(new, path, workspace / f"{path.name}.old")
        finally:
            shutil.rmtree(workspace, ignore_errors=True)


def replace_folder(new: Path, path: Path, aside: Path) -> None:
    """Rename a complete folder to ``path``; one of that name moves to ``aside`` first."""
    if not path.exists():
        new.rename(path)
        return
    path.rename(aside)
    try:
        new.rename(path)
    except OSError:
        aside.rename(path)
        raise


def remove_leftovers(folder: Path) -> None:
    """Delete temporary files of killed writes in a folder; no process may be writing there."""
    for path in Path(folder).glob(f"{_PREFIX}*{_SUFFIX}"):
        path.unlink(missing_ok=True)


def _full_disk(error: BaseException | None) -> int | None:
    """Number of the error of a full disk, in an error or in those that led to it."""
    while error is not None:
        if isinstance(error, OSError) and error.errno in DISK_FULL:
            return error.errno
        # A copied folder and a NumPy array keep words only.
        if isinstance(error, OSError) and error.errno is None:
            if _SHORT_WRITE.fullmatch(words := str(error)):
                return errno.ENOSPC
            if (number := next((one for one in DISK_FULL if os.strerror(one) in words), 0)) != 0:
                return number
        error = error.__cause__ or error.__context__
    return None


def _target(path: Path) -> Path:
    target = path.resolve() if path.is_symlink() else path
    if target.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    return target


def _temporary(path: Path, target: Path, mode: int = 0o666) -> tuple[int, Path]:
    # Not named after the file, whose name may be as long as a name can be.
    temporary = target.with_name(f"{_PREFIX}{os.urandom(8).hex()}{_SUFFIX}")
    new = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0)
    try:
        # Made with its permissions: the mask cannot be read without setting it, for all threads.
        handle = os.open(temporary, new, mode)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from error
    return handle, temporary
