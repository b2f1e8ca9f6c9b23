"""Arrays in HDF5 files: within the file itself, of sizes judged before they are read."""

from __future__ import annotations

import math
import os
import struct
import zlib
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any, BinaryIO

from sd2core.errors import Sd2Error
from sd2core.files.limits import (
    check_chunk_count,
    check_regular,
    check_size,
    open_regular,
    read_limit_bytes,
)
from sd2core.files.texts import reading_as

_DEFLATE = 1
_FILTERS = {_DEFLATE, 2, 3, 32000}
"""Known to h5py everywhere: deflate, shuffle, fletcher32, lzf."""
_TEXT_PART = 64
"""Part of the limit on memory that a text may have."""
_DEFLATE_MAX = 1032
"""Bytes that deflate can make of one."""


def open_hdf5_file(path: Path, expected: str) -> Any:
    """Open an HDF5 file to read; Sd2Error if it is none."""
    import h5py

    check_regular(path)
    with refusing_damage(path, expected):
        return h5py.File(path, "r")


def refusing_damage(path: Path, expected: str) -> AbstractContextManager[None]:
    """Raise Sd2Error for whatever fails while an HDF5 file is open: a damaged one does so."""
    return reading_as("HDF5", path, expected, "Copy or download it again")


def member_of(file: Any, path: Path, name: str) -> Any:
    """Array or group of an open file by its name, None if there is none.

    Raises Sd2Error if it lies elsewhere, in another file or under another name, or is larger than
    the size of the file allows.
    """
    import h5py

    link = file.get(name, getlink=True)
    if link is None:
        return None
    if not isinstance(link, h5py.HardLink):
        raise Sd2Error(f"{name} of {path} is a link to elsewhere", f"{name} in the file itself")
    member = file[name]
    if isinstance(member, h5py.Dataset):
        if member.external or member.is_virtual:
            raise Sd2Error(f"{name} of {path} lies in another file", f"{name} in the file itself")
        _check_array(member, path, name)
    return member


def text_of(array: Any, path: Path, name: str) -> str:
    """Text of a dataset that holds one, of fixed or of variable length; Sd2Error if it cannot be.

    One of variable length is read here: the HDF5 library takes as much memory as the length says
    that stands in a file, and does not come back from some damaged heaps.
    """
    place, expected = f"{name} of {path}", "a text of HDF5's default layout"
    with reading_as("a text", place, expected, "Copy or download it again"):
        if array.dtype.kind == "S":
            return str(array[()].decode("utf-8", "replace"))
        start, plan = array.id.get_offset(), array.file.id.get_create_plist()
        if start is None or plan.get_userblock():
            raise Sd2Error(f"{place} is stored in an unusual way", expected)
        with open_regular(path) as stream:
            return _heap_object(stream, start).decode("utf-8", "replace")


def _heap_object(stream: BinaryIO, start: int) -> bytes:
    """Bytes of variable length; ValueError or struct.error if they are not in their heap.

    HDF5 File Format Specification 3.0, sections III.E (global heap) and IV.B (variable length).
    """
    stream.seek(start)
    length, address, wanted = struct.unpack("<IQI", stream.read(16))
    if not length:
        return b""
    stream.seek(address)
    signature, size = struct.unpack("<4s4xQ", stream.read(16))
    if signature != b"GCOL" or max(length, size) * _TEXT_PART > read_limit_bytes():
        raise ValueError(f"{length:,} bytes, in a damaged heap of {size:,}")
    while stream.tell() < address + size:
        number, content_bytes = struct.unpack("<H6xQ", stream.read(16))
        if number == wanted:
            return stream.read(min(length, content_bytes))
        stream.seek(content_bytes + -content_bytes % 8, os.SEEK_CUR)
    raise ValueError(f"it is not in its heap of {size:,} bytes")


def _check_array(array: Any, path: Path, name: str) -> None:
    stored = path.stat().st_size
    place = f"{name} of {path}"
    plan = array.id.get_create_plist()
    filters = [plan.get_filter(number)[0] for number in range(plan.get_nfilters())]
    if not _FILTERS.issuperset(filters) or len(set(filters)) < len(filters):
        raise Sd2Error(
            f"{place} is compressed by the HDF5 filters {filters}",
            "deflate (gzip) or lzf, once",
            "Write it again with h5py's compression='gzip'",
        )
    shape = array.shape or ()
    check_size(place, math.prod(shape) * array.dtype.itemsize, stored)
    if array.chunks is None:
        return
    limit = read_limit_bytes(stored)
    count, suspects = 0, []

    def look(chunk: Any) -> None:
        nonlocal count
        count += 1
        if chunk.size * _DEFLATE_MAX > limit:
            suspects.append(chunk.chunk_offset)

    array.id.chunk_iter(look)
    places = math.prod(-(-n // step) for n, step in zip(shape, array.chunks, strict=True))
    check_chunk_count(place, places, count)
    for offset in suspects if _DEFLATE in filters else ():
        _, content = array.id.read_direct_chunk(offset)
        decoder = zlib.decompressobj()
        decoder.decompress(content, limit)
        if decoder.unconsumed_tail:
            raise Sd2Error(
                f"{place} holds a chunk that is larger than {limit:,} bytes, in {len(content):,}",
                f"chunks of {array.chunks}",
                "Copy or download it again",
            )
