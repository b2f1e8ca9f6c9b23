"""Reading of untrusted files: decompressed as they are read, up to a limit."""

from __future__ import annotations

import bz2
import gzip
import io
import lzma
import zlib
from typing import Any

_PIECE = 16 * 2**20


class Refused(Exception):
    """Request of a file that is refused; the text follows the file's name."""


class LimitedFile:
    """A file of which no more than so many bytes can be read."""

    def __init__(self, stream: Any, limit_bytes: int) -> None:
        self._stream = stream
        self.left = limit_bytes

    def read(self, size: int) -> bytes:
        """Read up to ``size`` bytes."""
        return bytes(self._upto(size))

    def read_exactly(self, size: int) -> bytearray:
        """Read ``size`` bytes; EOFError if the file ends before."""
        content = self._upto(size)
        if len(content) < size:
            raise EOFError("the file ends inside an array")
        return content

    def readinto(self, buffer: Any) -> int:
        """Fill ``buffer`` as far as the file goes."""
        content = self._upto(len(buffer))
        buffer[: len(content)] = content
        return len(content)

    def readline(self) -> bytes:
        """Read up to the next line break."""
        line: bytes = self._stream.readline(min(_PIECE, self.left))
        self.left -= len(line)
        return line

    def _upto(self, size: int) -> bytearray:
        if not 0 <= size <= self.left:
            raise Refused(f"claims {size:,} bytes where {self.left:,} are still accepted")
        content = bytearray()
        # In pieces, so that a false claim takes no memory.
        while len(content) < size:
            piece = self._stream.read(min(size - len(content), _PIECE))
            if not piece:
                break
            content += piece
        self.left -= len(content)
        return content


class _ZlibFile(io.RawIOBase):
    """A bare zlib stream, joblib's usual compression, as a file."""

    def __init__(self, file: Any) -> None:
        self._file = file
        self._machine = zlib.decompressobj()

    def readable(self) -> bool:
        """True."""
        return True

    def readinto(self, buffer: Any) -> int:
        """Decompress into ``buffer``."""
        while not self._machine.eof:
            source = self._machine.unconsumed_tail or self._file.read(2**16)
            content = self._machine.decompress(source, len(buffer))
            if content:
                buffer[: len(content)] = content
                return len(content)
            if not source:
                raise EOFError("the compressed file breaks off")
        return 0


def decompressed(file: Any) -> Any:
    """Open a binary file that may be compressed with zlib, gzip, bz2, xz or lzma."""
    start = file.read(6)
    file.seek(0)
    if start[:2] == b"\x1f\x8b":
        return gzip.GzipFile(fileobj=file)
    if start[:3] == b"BZh":
        return bz2.BZ2File(file)
    if start == b"\xfd7zXZ\x00" or start[:3] == b"\x5d\x00\x00":
        return lzma.LZMAFile(file)
    if start[:4] == b"\x04\x22\x4d\x18":
        raise Refused("is compressed with lz4, which is not read here")
    if start[:4] == b"PK\x03\x04":
        raise Refused("is a zip archive, as torch.save writes; torch files are not read here")
    if start[:1] == b"\x78" and int.from_bytes(start[:2], "big") % 31 == 0:
        return io.BufferedReader(_ZlibFile(file), 2**16)
    return file
