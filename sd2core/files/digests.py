"""Hashes of files' contents, kept until a file changes."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import Any

from sd2core.errors import Sd2Error
from sd2core.files.atomic import keep_text
from sd2core.files.paths import user_cache
from sd2core.files.texts import read_json

Signature = list[list[Any]]
"""Per file or folder: path, size, time of the last change in ns, inode."""

_WORTH_KEEPING_BYTES = 4 << 20
"""Size below which hashing takes less time than looking a hash up safely."""


def file_digest(path: Path) -> str:
    """SHA-256 of a file's content; of a folder's, of the names and contents in it."""
    if not path.is_dir():
        with path.open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    digest = hashlib.sha256()
    for file in sorted(one for one in path.rglob("*") if one.is_file()):
        digest.update(f"{file.relative_to(path).as_posix()}\n{file_digest(file)}\n".encode())
    return digest.hexdigest()


def signature(paths: Iterable[Path | str]) -> Signature:
    """Signature by which changes of files are noticed; a missing file has size -1."""
    entries: Signature = []
    for path in paths:
        try:
            facts = os.stat(path)
        except OSError:
            entries.append([str(path), -1, 0, 0])
        else:
            entries.append([str(path), facts.st_size, facts.st_mtime_ns, facts.st_ino])
    return entries


def deep_signature(paths: Iterable[Path]) -> Signature:
    """Signature of files, and of folders with all files in them."""
    return signature(file for path in paths for file in _tree(path))


def cached_digest(path: Path) -> str:
    """Hash of a file or folder, kept in the user's cache folder until it changes.

    Empty where nothing is there. Where nothing can be written it is computed every time.
    """
    if not path.exists():
        return ""
    path = path.absolute()
    files = deep_signature([path])
    if sum(entry[1] for entry in files) < _WORTH_KEEPING_BYTES:
        return file_digest(path)
    name = hashlib.sha256(str(path).encode()).hexdigest()[:32]
    place = user_cache("contents") / f"{name}.json"
    with suppress(Sd2Error, KeyError, TypeError):
        kept = read_json(place)
        if kept["files"] == files:
            return str(kept["digests"][str(path)])
    digest = file_digest(path)
    keep_text(place, json.dumps({"files": files, "digests": {str(path): digest}}) + "\n")
    return digest


def _tree(path: Path) -> Iterable[Path]:
    """A file; or a folder and all in it, as its own time tells when something is deleted."""
    yield path
    if path.is_dir():
        yield from sorted(path.rglob("*"))
