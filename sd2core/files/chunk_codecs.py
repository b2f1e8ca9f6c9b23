"""Codecs of Zarr that look at a chunk before they decode it, so that damage cannot end a process.

Blosc takes the lengths in a frame's header for true, and reads and writes beyond its memory where a
frame was cut or changed. Importing this module puts a check before it in all arrays that this
process opens: as Zarr's implementation of ``blosc``, and as that of numcodecs for version 2.
"""

from __future__ import annotations

import math
import struct
from typing import Any

import numcodecs
import zarr
from numcodecs.blosc import Blosc
from zarr.codecs import BloscCodec, Crc32cCodec, ZstdCodec
from zarr.registry import register_codec

_HEADER = struct.Struct("<4B3I")  # versions, flags, typesize; bytes decoded, per block, encoded
_DECODED_LIMIT_BYTES = 2**31
_SLACK_BYTES = 4096
"""By which a codec before Blosc may have lengthened a chunk, a checksum for example."""

_SAFE_V3 = frozenset({"bytes", "transpose", "sharding_indexed", "blosc", "zstd", "gzip", "crc32c"})
_SAFE_V2 = frozenset({"blosc", "zstd", "gzip", "zlib", "bz2", "lzma", "lz4", "delta"})


class DamagedChunkError(ValueError):
    """Chunk that is not what its codec wrote."""


def check_blosc_frame(
    frame: Any, length: int | None = None, most_bytes: int = _DECODED_LIMIT_BYTES
) -> None:
    """Raise DamagedChunkError unless the header of a Blosc frame fits its length.

    ``frame`` is all of it, or its first 16 bytes where ``length`` says how long it is;
    ``most_bytes`` is the size above which it cannot be a chunk of its array.
    """
    view = memoryview(frame).cast("B")
    length = len(view) if length is None else length
    if min(length, len(view)) < _HEADER.size:
        raise DamagedChunkError(f"it ends after {length} bytes, within its header")
    *_, decoded, block, encoded = _HEADER.unpack_from(view)
    if encoded != length:
        raise DamagedChunkError(f"it has {length} bytes, its header says {encoded}")
    if decoded > most_bytes or not (decoded == 0 or 0 < block <= decoded):
        raise DamagedChunkError(f"its header says {decoded} bytes in blocks of {block}")


class _CheckedBlosc(Blosc):
    """Blosc of arrays of Zarr's version 2."""

    codec_id = "blosc"

    def decode(self, buf: Any, out: Any = None) -> Any:
        check_blosc_frame(buf)
        return super().decode(buf, out)


class _CheckedBloscCodec(BloscCodec):
    """Blosc of arrays of Zarr's version 3."""

    def _decode_sync(self, chunk_bytes: Any, chunk_spec: Any) -> Any:
        _check(chunk_bytes, chunk_spec)
        return super()._decode_sync(chunk_bytes, chunk_spec)

    async def _decode_single(self, chunk_bytes: Any, chunk_spec: Any) -> Any:
        _check(chunk_bytes, chunk_spec)
        return await super()._decode_single(chunk_bytes, chunk_spec)


def _check(chunk_bytes: Any, chunk_spec: Any) -> None:
    whole = math.prod(chunk_spec.shape) * chunk_spec.dtype.to_native_dtype().itemsize
    check_blosc_frame(chunk_bytes.as_numpy_array(), most_bytes=whole + _SLACK_BYTES)


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


numcodecs.register_codec(_CheckedBlosc)
register_codec("blosc", _CheckedBloscCodec)
zarr.config.set({"codecs.blosc": f"{__name__}.{_CheckedBloscCodec.__qualname__}"})
