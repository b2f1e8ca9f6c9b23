"""Codecs of Zarr that look at a chunk before they decode it, so that damage cannot end a process.

Blosc takes the lengths in a frame's header for true, and reads and writes beyond its memory where a
frame was cut or changed; the others make of a small chunk whatever it says. Importing this module
puts checks before them in all arrays that this process opens: as Zarr's implementations, and as
those of numcodecs for version 2.
"""

from __future__ import annotations

import math
import struct
import zlib
from typing import Any

import numcodecs
import zarr
from numcodecs import GZip, Zlib, Zstd
from numcodecs.blosc import Blosc
from zarr.codecs import BloscCodec, Crc32cCodec, GzipCodec, ZstdCodec
from zarr.registry import register_codec

from sd2core.files.limits import read_limit_bytes

_HEADER = struct.Struct("<4B3I")  # versions, flags, typesize; bytes decoded, per block, encoded
_SLACK_BYTES = 4096
"""By which a codec before it may have lengthened a chunk, a checksum for example."""
_ZSTD_BLOCK_BYTES = 2**17
"""What a compressed block of zstd decodes to at most."""

_SAFE_V3 = frozenset({"bytes", "transpose", "sharding_indexed", "blosc", "zstd", "gzip", "crc32c"})
_SAFE_V2 = frozenset({"blosc", "zstd", "gzip", "zlib", "delta"})


class DamagedChunkError(ValueError):
    """Chunk that is not what its codec wrote."""


def check_blosc_frame(frame: Any, length: int | None = None, most_bytes: int | None = None) -> None:
    """Raise DamagedChunkError unless the header of a Blosc frame fits its length.

    ``frame`` is all of it, or its first 16 bytes where ``length`` says how long it is;
    ``most_bytes`` is the size above which it cannot be a chunk of its array, by default what a
    file of this length may be read as.
    """
    view = memoryview(frame).cast("B")
    length = len(view) if length is None else length
    if min(length, len(view)) < _HEADER.size:
        raise DamagedChunkError(f"it ends after {length} bytes, within its header")
    most_bytes = read_limit_bytes(length) if most_bytes is None else most_bytes
    *_, decoded, block, encoded = _HEADER.unpack_from(view)
    if encoded != length:
        raise DamagedChunkError(f"it has {length} bytes, its header says {encoded}")
    if decoded > most_bytes or not (decoded == 0 or 0 < block <= decoded):
        raise DamagedChunkError(f"its header says {decoded} bytes in blocks of {block}")


def check_zstd_frame(chunk: Any, most_bytes: int) -> None:
    """Raise DamagedChunkError if a zstd frame decodes to more, or is followed by another one."""
    frame = memoryview(chunk).cast("B")
    flags = frame[4] if frame[:4] == b"\x28\xb5\x2f\xfd" and len(frame) > 4 else None
    if flags is None:
        raise DamagedChunkError("it is no frame of zstd")
    single = flags >> 5 & 1
    at = 6 - single + (0, 1, 2, 4)[flags & 3]
    width = (single, 2, 4, 8)[flags >> 6]
    made = int.from_bytes(frame[at : at + width], "little")
    at += width
    if not width:  # A size that is not told is at most that of all blocks.
        most_bytes += _ZSTD_BLOCK_BYTES
        last = 0
        while not last and at < len(frame):
            block = int.from_bytes(frame[at : at + 3], "little")
            last, kind, size = block & 1, block >> 1 & 3, block >> 3
            made += _ZSTD_BLOCK_BYTES if kind == 2 else size
            at += 3 + (1 if kind == 1 else size)
        if at + 4 * (flags >> 2 & 1) != len(frame):
            raise DamagedChunkError("it is not one whole frame of zstd")
    if made > most_bytes:
        raise DamagedChunkError(f"it decodes to {made} bytes, more than {most_bytes}")


def check_deflated(chunk: Any, most_bytes: int) -> None:
    """Raise DamagedChunkError if what gzip or zlib has compressed is more."""
    left: Any = memoryview(chunk).cast("B")
    made = 0
    while left:  # One member of gzip after the other.
        decoder = zlib.decompressobj(zlib.MAX_WBITS | 32)
        made += len(decoder.decompress(left, most_bytes - made + 1))
        if made > most_bytes:
            raise DamagedChunkError(f"it decodes to more than {most_bytes} bytes")
        left = decoder.unused_data


class _CheckedV2:
    """Base of codecs of Zarr's version 2 that look at a chunk first."""

    _check: Any  # Of a chunk and the size that it may have.

    def decode(self, buf: Any, out: Any = None) -> Any:
        self._check(buf, most_bytes=read_limit_bytes(len(buf)))
        return super().decode(buf, out)  # type: ignore[misc]


class _CheckedBlosc(_CheckedV2, Blosc):
    codec_id = "blosc"
    _check = staticmethod(check_blosc_frame)


class _CheckedZstd(_CheckedV2, Zstd):
    codec_id = "zstd"
    _check = staticmethod(check_zstd_frame)


class _CheckedGZip(_CheckedV2, GZip):
    _check = staticmethod(check_deflated)


class _CheckedZlib(_CheckedV2, Zlib):
    _check = staticmethod(check_deflated)


class _Checked:
    """Base of codecs of version 3 that look at a chunk first."""

    _check: Any

    def _decode_sync(self, chunk_bytes: Any, chunk_spec: Any) -> Any:
        self._look_at(chunk_bytes, chunk_spec)
        return super()._decode_sync(chunk_bytes, chunk_spec)  # type: ignore[misc]

    async def _decode_single(self, chunk_bytes: Any, chunk_spec: Any) -> Any:
        self._look_at(chunk_bytes, chunk_spec)
        return await super()._decode_single(chunk_bytes, chunk_spec)  # type: ignore[misc]

    def _look_at(self, chunk_bytes: Any, chunk_spec: Any) -> None:
        itemsize = int(chunk_spec.dtype.to_native_dtype().itemsize)
        whole = math.prod(chunk_spec.shape) * itemsize
        self._check(chunk_bytes.as_numpy_array(), most_bytes=whole + _SLACK_BYTES)


class _CheckedBloscCodec(_Checked, BloscCodec):
    _check = staticmethod(check_blosc_frame)


class _CheckedZstdCodec(_Checked, ZstdCodec):
    _check = staticmethod(check_zstd_frame)


class _CheckedGzipCodec(_Checked, GzipCodec):
    _check = staticmethod(check_deflated)


def checksummed(compressor: Any = None) -> tuple[Any, ...]:
    """Compressors of a new array: the given one (zstd by default), and a checksum per chunk."""
    return compressor or ZstdCodec(level=0), Crc32cCodec()


def codecs_of(array: Any) -> tuple[str, ...]:
    """Names of the codecs of an array's chunks, in the order in which they are encoded."""
    return tuple(str(one["name"]) for one in _described(array))


def unsafe_codecs(array: Any) -> list[str]:
    """Codecs of an array, within shards too, that are not known to refuse damage."""
    safe = _SAFE_V2 if array.metadata.zarr_format == 2 else _SAFE_V3
    unsafe, left = [], _described(array)
    while left:
        one = left.pop()
        inside = one.get("configuration") or {}
        left += [*inside.get("codecs", ()), *inside.get("index_codecs", ())]
        if one["name"] not in safe:
            unsafe.append(str(one["name"]))
    return unsafe


def _described(array: Any) -> list[dict[str, Any]]:
    """Codecs of an array, with ``name`` and ``configuration``."""
    meta = array.metadata
    if meta.zarr_format == 3:
        return [one.to_dict() for one in meta.codecs]
    return [{"name": one.codec_id} for one in (*(meta.filters or ()), meta.compressor) if one]


for _codec in (_CheckedBlosc, _CheckedZstd, _CheckedGZip, _CheckedZlib):
    numcodecs.register_codec(_codec)
for _name, _kind in (
    ("blosc", _CheckedBloscCodec),
    ("zstd", _CheckedZstdCodec),
    ("gzip", _CheckedGzipCodec),
):
    register_codec(_name, _kind)
    zarr.config.set({f"codecs.{_name}": f"{__name__}.{_kind.__qualname__}"})
