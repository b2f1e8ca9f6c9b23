"""Reading plain data out of pickle and joblib files without executing anything.

A pickle is a program for a small machine that may call anything it can name.
Here the machine finds only the names in an explicit list, which stand for our
own code, which builds arrays of numbers and the simple containers around them.
Every other name ends the reading.
"""

from __future__ import annotations

import bz2
import gzip
import io
import lzma
import pickle
import struct
import sys
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from sd2core.errors import Sd2Error
from sd2core.files.limits import VARIABLE, check_regular, read_limit_bytes
from sd2core.files.numpy_files import open_zip, read_array_header
from sd2core.files.texts import reading_as
from sd2core.io.pickle_objects import (
    ALLOWED,
    DESCRIBED,
    OF_A_LIST,
    Described,
    JoblibArray,
    Named,
    PlainArray,
    PlainDtype,
    Refused,
    Storage,
    StorageKind,
    TooLarge,
)

_PIECE = 16 * 2**20
_OBJECT_BYTES = 100
"""Memory of what one instruction makes, about: an empty set comes of a single byte."""

_OLD_TORCH = 0x1950A86A20F9469CFC6C
_OLD_TORCH_BYTES = 2**16
"""Of the pickles of an old torch file around its numbers, at most."""

_REMEDY = (
    "Save the vertices where the file was written: "
    "numpy.savez('mesh.npz', vertices=verts, faces=faces, times_s=times)"
)
_RAISE = f". If the file is to be trusted, raise the limit by the environment variable {VARIABLE}"


class LimitedFile:
    """A file of which no more than so many bytes, in so many pieces, can be read."""

    def __init__(self, stream: Any, limit_bytes: int) -> None:
        self._stream = stream
        self.left = limit_bytes
        self._pieces = limit_bytes // _OBJECT_BYTES

    def read(self, size: int) -> bytes:
        """Read up to ``size`` bytes."""
        self._count()
        return bytes(self._upto(size))

    def read_exactly(self, size: int) -> bytearray:
        """Read ``size`` bytes; EOFError if the file ends before."""
        content = self._upto(size)
        if len(content) < size:
            raise EOFError("the file ends inside an array")
        return content

    def readline(self) -> bytes:
        """Read up to the next line break."""
        self._count()
        line: bytes = self._stream.readline(min(_PIECE, self.left))
        self.left -= len(line)
        return line

    def charge(self, size: int) -> None:
        """Count memory that was taken for something else than what was read."""
        if size > self.left:
            raise TooLarge("makes more of its content than a file of its size may hold")
        self.left -= size

    def _count(self) -> None:
        self._pieces -= 1
        if self._pieces < 0:
            raise TooLarge("holds more single objects than a file of its size may")

    def _upto(self, size: int) -> bytearray:
        if not 0 <= size <= self.left:
            raise TooLarge(f"claims {size:,} bytes where {self.left:,} are still accepted")
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
        """True: it is a file to read."""
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
        raise Refused("is a zip archive and no pickle; what torch.save writes is named .pt")
    if start[:1] == b"\x78" and int.from_bytes(start[:2], "big") % 31 == 0:
        return io.BufferedReader(_ZlibFile(file), 2**16)
    return file


def read_pickle(path: Path, limit_bytes: int | None = None) -> Any:
    """Read arrays and containers from a pickle or joblib file, also a compressed one.

    Gives dictionaries, lists, tuples, sets, numbers, text and NumPy arrays of these; tensors of
    torch, arrays of chumpy and sparse matrices of scipy come as arrays. At most ``limit_bytes``, by
    default what a file of its size may be read as, are read after decompression and made of it.
    Raises Sd2Error if the file names anything else, is damaged or too large.
    """

    def content(limit: int) -> Any:
        with path.open("rb") as file:
            source = LimitedFile(decompressed(file), limit)
            return _DataUnpickler(source).load()

    return _read(path, content, "pickle or joblib", limit_bytes)


def read_torch(path: Path) -> Any:
    """Read what ``torch.save`` wrote, as :func:`read_pickle` does; nothing is executed."""

    def content(limit: int) -> Any:
        if not zipfile.is_zipfile(path):
            with path.open("rb") as file:
                return _read_old_torch(LimitedFile(file, limit))
        with open_zip(path) as archive:
            name = next((n for n in archive.namelist() if n.endswith("/data.pkl")), None)
            if name is None or any("/code/" in one for one in archive.namelist()):
                raise Refused("is a program of torch (TorchScript) or no torch file")
            with archive.open(name) as stream:
                source = LimitedFile(stream, limit)
                return _TorchUnpickler(source, archive, name.removesuffix("data.pkl")).load()

    return _read(path, content, "torch.save")


def read_object_arrays(path: Path) -> dict[str, Any]:
    """Arrays of an ``.npz``, or the one of an ``.npy``, of objects as well (``allow_pickle``)."""

    def content(limit: int) -> Any:
        if path.suffix.lower() == ".npy":
            with path.open("rb") as file:
                return {"": _array_or_objects(file, limit)}
        arrays = {}
        with open_zip(path) as archive:
            for name in archive.namelist():
                if name.endswith(".npy"):
                    with archive.open(name) as stream:
                        arrays[name.removesuffix(".npy")] = _array_or_objects(stream, limit)
        return arrays

    return _read(path, content, "numpy.save or numpy.savez")


def _array_or_objects(stream: Any, limit: int) -> Any:
    """An array; of objects, one by itself or a list."""
    start = stream.tell()
    _, _, dtype = read_array_header(stream)
    if not dtype.hasobject:
        stream.seek(start)
        return np.lib.format.read_array(stream, allow_pickle=False)
    objects = _DataUnpickler(LimitedFile(stream, limit)).load()
    return np.asarray(objects).tolist() if isinstance(objects, np.ndarray) else objects


def _read(
    path: Path, content: Callable[[int], Any], writer: str, limit_bytes: int | None = None
) -> Any:
    """Read by ``content``, within a limit; whatever goes wrong is an Sd2Error."""
    check_regular(path)
    with reading_as("a pickle", path, f"a complete file written by {writer}", _REMEDY):
        try:
            return content(limit_bytes or read_limit_bytes(path.stat().st_size))
        except Refused as refusal:
            raise Sd2Error(
                f"{path} {refusal}",
                "plain NumPy arrays, numbers, text, lists and dictionaries",
                f"{_REMEDY}{_RAISE if isinstance(refusal, TooLarge) else ''}",
            ) from refusal
        except MemoryError as error:
            found = f"{path} asks for more memory than there is"
            raise Sd2Error(found, "the size that is really stored", _REMEDY) from error
        except RecursionError as error:
            raise Sd2Error(f"{path} is nested too deeply", "plain data", _REMEDY) from error


# The form of the standard library that is written in Python, because joblib's
# arrays stand in the middle of the stream and only this form can stop there.
_Machine: Any = pickle._Unpickler


class _DataUnpickler(_Machine):
    """Pickle machine that cannot name, call or build anything on its own."""

    dispatch: ClassVar[dict[int, Any]] = dict(_Machine.dispatch)

    def __init__(self, source: LimitedFile) -> None:
        super().__init__(source, encoding="latin1")
        self._source = source

    def find_class(self, module: str, name: str) -> Any:
        """Look a name up in the list, and nowhere else."""
        home = "builtins" if module == "__builtin__" else module  # as Python 2 says
        if (home, name) in ALLOWED:
            return ALLOWED[home, name]
        if (home, name) == ("torch.storage", "_load_from_bytes"):
            return _storage_of_bytes
        if home.split(".")[0] == "torch":
            raise Refused(
                f"holds torch objects ('{module}.{name}'); save them as NumPy arrays "
                "(tensor.cpu().numpy())"
            )
        raise Refused(f"asks for '{module}.{name}', which is forbidden; nothing was executed")

    def get_extension(self, code: int) -> None:
        """Refuse names that are given by number."""
        raise Refused(f"asks for the registered extension {code}, which is forbidden")

    def persistent_load(self, identity: Any) -> Any:
        """Refuse objects that another program would supply."""
        raise Refused("refers to objects outside the file (a persistent id)")

    def load_reduce(self) -> None:
        """Call what was found in the list, as nothing else can be called; containers of a list."""
        function, arguments = self.stack[-2:]
        if not callable(function):
            raise Refused(f"calls {_named(function)}, which is forbidden")
        if function in OF_A_LIST and not all(isinstance(a, list | tuple) for a in arguments):
            raise Refused(f"builds {_named(function)} from something else than a list")
        super().load_reduce()
        self._source.charge(sys.getsizeof(self.stack[-1]))

    def load_newobj(self) -> None:
        """Make an object that stands for an array, of joblib, chumpy or scipy."""
        kind, arguments = self.stack[-2:]
        if kind not in (JoblibArray, *DESCRIBED) or arguments:
            raise Refused(f"makes {_named(kind)} without its constructor, which is forbidden")
        super().load_newobj()

    def load_build(self) -> None:
        """Fill arrays and dtypes; nothing else has a state to be set."""
        target = self.stack[-2]
        if not isinstance(target, PlainArray | PlainDtype | JoblibArray | Described):
            raise Refused(f"sets the state of {_named(target)}, which is forbidden")
        super().load_build()
        self._source.charge(target.nbytes if isinstance(target, PlainArray) else 0)
        if isinstance(target, JoblibArray):
            self.stack[-1] = target.read(self._source)
        if isinstance(target, Described):
            self.stack[-1] = target.array(self._source.left)
            self._source.charge(self.stack[-1].nbytes)

    def load_frame(self) -> None:
        """Read the instructions of a frame from the file, not all of them at once."""
        self.read(8)

    def load_inst(self) -> None:
        """Refuse an instance of a class, by the class's name."""
        module, name = (self.readline()[:-1].decode("utf-8") for _ in range(2))
        self.find_class(module, name)
        raise Refused(f"makes an instance of '{module}.{name}', which is forbidden")

    def load_forbidden(self) -> None:
        """Refuse the instructions that plain data does not need."""
        raise Refused("makes objects in a way that plain data does not need, which is forbidden")

    dispatch[pickle.REDUCE[0]] = load_reduce
    dispatch[pickle.NEWOBJ[0]] = load_newobj
    dispatch[pickle.BUILD[0]] = load_build
    dispatch[pickle.INST[0]] = load_inst
    dispatch[pickle.FRAME[0]] = load_frame
    for _code in (pickle.OBJ, pickle.NEWOBJ_EX, pickle.NEXT_BUFFER, pickle.READONLY_BUFFER):
        dispatch[_code[0]] = load_forbidden


class _TorchUnpickler(_DataUnpickler):
    """Unpickler of torch files, whose numbers are other files of the archive, or come later."""

    def __init__(
        self, source: LimitedFile, archive: zipfile.ZipFile | None = None, folder: str = ""
    ) -> None:
        super().__init__(source)
        self._archive, self._folder = archive, folder
        self.storages: dict[str, Storage] = {}

    def persistent_load(self, identity: Any) -> Storage:
        """Numbers of tensors, by their key."""
        known = isinstance(identity, tuple) and len(identity) >= 5 and identity[0] == "storage"
        if not known or not isinstance(identity[1], StorageKind):
            raise Refused("holds a torch storage of a type that is not known")
        key = str(identity[2])
        if key not in self.storages:
            storage = self.storages[key] = Storage(identity[1].dtype, identity[4])
            if self._archive is not None:
                self._source.charge(storage.size_bytes)
                storage.fill(self._archive.read(f"{self._folder}data/{key}"))
        return self.storages[key]


def _read_old_torch(source: LimitedFile) -> Any:
    """Content of a torch file from before it was a zip: five pickles, then the numbers.

    Tensors cannot be made before their numbers are there, so that only a storage by itself is read:
    what a tensor in a plain pickle holds.
    """
    if [_DataUnpickler(source).load() for _ in range(2)] != [_OLD_TORCH, 1001]:
        raise Refused("is no torch file that is known")
    _DataUnpickler(source).load()  # of the machine that wrote it
    machine = _TorchUnpickler(source)
    content = machine.load()
    for key in _DataUnpickler(source).load():
        storage = machine.storages[key]
        (count,) = struct.unpack("<q", source.read_exactly(8))
        if count != storage.count:
            raise Refused("holds a torch storage of another size than it says")
        storage.fill(source.read_exactly(storage.size_bytes))
    return content


def _storage_of_bytes(content: Any) -> Storage:
    """``torch.storage._load_from_bytes``: the numbers of a tensor in a plain pickle."""
    if not isinstance(content, bytes):
        raise Refused("holds a torch storage in a form that is not known")
    source = LimitedFile(io.BytesIO(content), 2 * len(content) + _OLD_TORCH_BYTES)
    storage = _read_old_torch(source)
    if not isinstance(storage, Storage):
        raise Refused("holds a torch storage in a form that is not known")
    return storage


def _named(thing: Any) -> str:
    thing = thing.kind if isinstance(thing, Named) else thing
    return f"'{thing.__name__}'" if isinstance(thing, type) else f"a {type(thing).__name__}"
