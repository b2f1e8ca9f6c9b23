"""Zarr stores on disk: made with a checksum per chunk, read and verified in one way.

Every Zarr array of a file goes through here, because a damaged chunk must be named, and must not
end the process.
"""

from __future__ import annotations

import atexit
import functools
import itertools
import json
import math
import os
import stat
import zipfile
from collections.abc import Iterable, Mapping
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.files.limits import (
    check_chunk_count,
    check_fetched,
    check_regular,
    check_regular_within,
    check_size,
    read_limit_bytes,
    size_bytes,
)
from sd2core.files.numpy_files import open_zip
from sd2core.files.texts import cause_of, reading_as
from sd2core.progress import Progress, silent

Depth = Literal["presence", "lengths", "checksums", "values"]
"""How closely chunks are looked at; each includes those before it."""

_DESCRIPTIONS = ("zarr.json", ".zgroup", ".zarray", ".zattrs", ".zmetadata")
_PARSED = 8
"""Memory of a description once it is parsed, as a multiple of its text, at least."""
_WHOLE, COPY_AGAIN = "a complete Zarr store", "Copy it again from where it came, or write it again"
_reading = functools.partial(reading_as, "a Zarr group", expected=_WHOLE, remedy=COPY_AGAIN)


@dataclass(frozen=True)
class Damage:
    """Rows of an array that cannot be read."""

    array: str
    start: int
    stop: int
    unit: str  # Word for rows: frames, segments.
    reason: str

    def __str__(self) -> str:
        return f"{self.unit} {self.start} to {self.stop - 1} of {self.array} ({self.reason})"


def lost_in_words(frames: int) -> str:
    """Sentence on frames that were lost to damaged chunks."""
    return (
        f"{frames:,} frames are lost to damaged chunks and left out: copy their files again, or"
        " write them again. `sd2 info --verify` names the chunks."
    )


class StoredArray:
    """Numbers that stay on disk until they are sliced; Sd2Error names what is damaged.

    Parameters
    ----------
    array : zarr.Array
    path : Path
        Store that it is in, a folder or a ``.zarr.zip``.
    name : str
    unit : str
        Word for its rows in messages.
    sparse : bool, optional
        True if a chunk may be missing, because it holds nothing but the fill value; by default it
        may where chunks have no checksums.

    Raises
    ------
    Sd2Error
        If it does not hold plain numbers, or is coded in a way that is not safe to decode.
    """

    def __init__(
        self, array: Any, path: Path, name: str, unit: str, *, sparse: bool | None = None
    ) -> None:
        _refuse_unsafe(array, path, name)
        from sd2core.files.chunk_codecs import codecs_of

        self._array = array
        self.path, self.name, self._unit = path, name, unit
        self._codecs = codecs_of(array)
        self._packed = path.is_file()
        self._sparse = not self.checksums if sparse is None else sparse
        self.shape: tuple[int, ...] = tuple(array.shape)
        self.dtype: np.dtype[Any] = np.dtype(array.dtype)
        # What is one file: a shard is one of several chunks.
        self.chunks: tuple[int, ...] = tuple(array.shards or array.chunks)
        if 0 in self.chunks:
            raise Sd2Error(f"{path}: {name} has chunks of {self.chunks}", "one row at least")

    @property
    def checksums(self) -> bool:
        """True if every chunk has a checksum."""
        return self._codecs[-1:] == ("crc32c",)

    @property
    def file_bytes(self) -> int:
        """Size of all chunks on disk."""
        return size_bytes(self.path if self._packed else self.path / self._array.path)

    def __len__(self) -> int:
        return self.shape[0]

    def __getitem__(self, key: Any) -> NDArray[Any]:
        # Zarr fills in for a chunk that is missing. In a zip that is looked for when it is opened.
        if not self._sparse and not self._packed:
            self._refuse(self.damage("presence", _rows(key, self.shape)))
        try:
            return np.asarray(self._array[key])
        except Exception as error:  # a damaged chunk fails in the codec's own ways
            self._refuse(self.damage("values", _rows(key, self.shape)))
            raise unreadable(self.path, f"{self.name} ({cause_of(error)})") from error

    def _refuse(self, damage: tuple[Damage, ...]) -> None:
        if damage:
            raise unreadable(self.path, damage)

    def damage(
        self, depth: Depth, rows: range | None = None, progress: Progress = silent
    ) -> tuple[Damage, ...]:
        """Return what is damaged of the chunks that hold some rows, all by default."""
        rows = range(self.shape[0] if self.shape else 0) if rows is None else rows
        if not rows or 0 in self.shape:
            return ()
        step = self.chunks[0]
        sizes = zip(self.shape[1:], self.chunks[1:], strict=True)
        across = [range(-(-size // chunk)) for size, chunk in sizes]
        damage: list[Damage] = []
        with zipfile.ZipFile(self.path) if self._packed else nullcontext() as archive:
            for number in range(rows.start // step, -(-rows.stop // step)):
                progress(number * step - rows.start, len(rows))
                start, stop = number * step, min((number + 1) * step, self.shape[0])
                for place in itertools.product(*across):
                    reason = self._reason(archive, (number, *place), depth)
                    if reason is not None:
                        damage.append(Damage(self.name, start, stop, self._unit, reason))
                        break
        return tuple(damage)

    def _reason(
        self, archive: zipfile.ZipFile | None, place: tuple[int, ...], depth: Depth
    ) -> str | None:
        """Fault of a chunk in an archive or a folder; None without any."""
        key = f"{self._array.path}/{self._array.metadata.encode_chunk_key(place)}".lstrip("/")
        size = self._size(archive, key)
        if size is None or depth == "presence":
            return None if self._sparse or size is not None else f"{key} is missing"

        from google_crc32c import value as crc32c

        from sd2core.files.chunk_codecs import DamagedChunkError, check_blosc_frame

        tail = 4 if self.checksums else 0
        summed = tail > 0 and depth != "lengths"
        try:
            with archive.open(key) if archive else (self.path / key).open("rb") as file:
                content = file.read(-1 if summed else 16)
            if self._codecs[-2 if tail else -1 :][:1] == ("blosc",):
                check_blosc_frame(content[:16], size - tail)
        except DamagedChunkError as error:
            return f"{key}: {error}"
        except Exception as error:  # a damaged zip fails in many ways, too
            return f"{key}: {cause_of(error)}"
        if summed and crc32c(content[:-4]).to_bytes(4, "little") != content[-4:]:
            return f"{key} does not have its checksum"
        return self._undecodable(place, key) if depth == "values" else None

    def _size(self, archive: zipfile.ZipFile | None, key: str) -> int | None:
        """Bytes of a chunk; None where it is missing."""
        try:
            if archive is not None:
                return archive.getinfo(key).file_size
            status = os.stat(f"{self.path}/{key}")
        except (OSError, KeyError):
            return None
        return status.st_size if stat.S_ISREG(status.st_mode) else None

    def _undecodable(self, place: tuple[int, ...], key: str) -> str | None:
        try:
            self._array.blocks[place]
        except Exception as error:  # as in __getitem__
            return f"{key}: {cause_of(error)}"
        return None


@functools.cache
def _zarr() -> Any:
    """Zarr, whose thread is waited for at exit: the 0.2 s that Zarr gives it may be too few."""
    import zarr
    from zarr.core import sync

    def stop() -> None:
        if sync.loop[0] is not None and sync.iothread[0] is not None:
            sync.loop[0].call_soon_threadsafe(sync.loop[0].stop)
            sync.iothread[0].join()

    atexit.register(stop)  # called before what Zarr has registered
    return zarr


def open_group(path: Path, mode: Literal["r", "r+"] = "r") -> Any:
    """Open a Zarr group, a folder or a ``.zarr.zip``; Sd2Error if it is none, or damaged."""
    zarr = _zarr()
    from zarr.storage import ZipStore

    import sd2core.files.chunk_codecs  # noqa: F401  puts checks before the decoders

    with _reading(path):
        packed = path.is_file()
        if packed:
            with open_zip(path) as archive:
                files = len(archive.infolist())
                for entry in archive.infolist():
                    if entry.filename.rpartition("/")[2] in _DESCRIPTIONS:
                        check_size(path / entry.filename, _PARSED * entry.file_size)
        else:
            files = check_regular_within(path)
            for name in _DESCRIPTIONS:
                for description in (*path.glob(name), *path.glob(f"*/{name}")):
                    check_size(description, _PARSED * description.stat().st_size)
                    files_within = filter(Path.is_file, description.parent.rglob("*"))
                    chunks = (one for one in files_within if one.name not in _DESCRIPTIONS)
                    check_fetched(next(chunks, None))
        group = zarr.open_group(ZipStore(path, mode="r") if packed else str(path), mode=mode)
        _check_declared(group, path, files)
    return group


def _check_declared(group: Any, path: Path, files: int) -> None:
    """Refuse arrays that together declare more than can come of what is stored."""
    declared_bytes = chunks = 0
    for name in array_names(path):
        try:
            array = group[name]
            of_chunks = array.shards or array.chunks
            # A chunk is made whole, even of what is not stored.
            numbers = max(math.prod(array.shape), math.prod(of_chunks))
            declared_bytes += numbers * np.dtype(array.dtype).itemsize
            sizes = zip(array.shape, of_chunks, strict=True)
            chunks += math.prod(-(-size // chunk) for size, chunk in sizes)
        except Exception:  # whoever asks for this one is told
            continue
    check_chunk_count(path, chunks, files)
    if declared_bytes > read_limit_bytes():
        check_size(path, declared_bytes, size_bytes(path))


def read_attributes(path: Path) -> dict[str, Any]:
    """Attributes of a group in a folder, read without Zarr; none where it is not one."""
    description = path / "zarr.json"
    try:
        check_regular(description)
        check_size(description, _PARSED * description.stat().st_size)
        attributes = json.loads(description.read_text(encoding="utf-8"))["attributes"]
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return {}
    return attributes if isinstance(attributes, dict) else {}


def array_names(path: Path) -> list[str]:
    """Names of the arrays in a store."""
    if path.is_file():
        with open_zip(path) as archive:
            files = [Path(name) for name in archive.namelist()]
    else:
        files = [file.relative_to(path) for file in path.glob("*/*") if file.is_file()]
    return sorted(
        str(one.parent)
        for one in files
        if len(one.parts) == 2 and one.name in ("zarr.json", ".zarray")
    )


def array_in(
    group: Any, path: Path, name: str, unit: str, *, sparse: bool | None = None
) -> StoredArray:
    """Array of an open group, to be read.

    Parameters
    ----------
    group : zarr.Group
    path, name, unit, sparse
        As for :class:`StoredArray`; the name is that within the group.

    Raises
    ------
    Sd2Error
        If the array is missing, or its description is damaged or not safe.
    """
    with _reading(path / name):
        if (array := group.get(name)) is None:
            raise Sd2Error(f"{path}: the array {name} is missing", _WHOLE, COPY_AGAIN)
        return StoredArray(array, path, name, unit, sparse=sparse)


def growing(group: Any, path: Path, name: str) -> Any:
    """Array of an open group, to be written to."""
    array_in(group, path, name, "rows")
    return group[name].with_config(_EVERY_CHUNK)


def put_rows(array: Any, start: int, values: NDArray[Any]) -> None:
    """Write rows into an array of :func:`growing`, which grows where they are beyond its end."""
    stop = start + len(values)
    if array.shape[0] < stop:
        array.resize((stop, *array.shape[1:]))
    array[start:stop] = values


def create_group(path: Path, attributes: Mapping[str, Any] | None = None) -> Any:
    """Make an empty group in a folder, in place of what is there."""
    return _zarr().open_group(str(path), mode="w", attributes=dict(attributes or {}))


def create_array(group: Any, name: str, *, compressor: Any = None, **how: Any) -> Any:
    """Make an array of a group whose chunks have checksums, by arguments as Zarr has them."""
    from sd2core.files.chunk_codecs import checksummed

    return group.create_array(name, compressors=checksummed(compressor), config=_EVERY_CHUNK, **how)


_EVERY_CHUNK = {"write_empty_chunks": True}
"""A chunk that is not there is then a chunk that was lost."""


def _refuse_unsafe(array: Any, path: Path, name: str) -> None:
    from sd2core.files.chunk_codecs import unsafe_codecs

    if not hasattr(array, "metadata") or not hasattr(array, "shape"):
        raise Sd2Error(f"{path}: {name} is a group", "an array", COPY_AGAIN)
    unsafe = unsafe_codecs(array)
    if unsafe or np.dtype(array.dtype).kind not in "biuf":
        raise Sd2Error(
            f"{path}: the array {name} is of {array.dtype}, coded by {', '.join(unsafe) or 'none'}",
            "plain numbers, compressed by Blosc, zstd, gzip or not at all",
            "Write it again with zarr's default codecs",
        )


def unreadable(path: Path, damage: str | Iterable[Damage]) -> Sd2Error:
    """Error that names what of a store cannot be read."""
    what = damage if isinstance(damage, str) else "; ".join(map(str, damage))
    return Sd2Error(f"{path} cannot be read: {what}", "chunks as they were written", COPY_AGAIN)


def _rows(key: Any, shape: tuple[int, ...]) -> range | None:
    """Rows that a key asks for, where it names them by a number or a slice."""
    first = key[0] if isinstance(key, tuple) and key else key
    if isinstance(first, int | np.integer) and -shape[0] <= first < shape[0]:
        row = range(shape[0])[first]
        return range(row, row + 1)
    if isinstance(first, slice) and first.step in (None, 1):
        start, stop, _ = first.indices(shape[0])
        return range(start, max(start, stop))
    return None
