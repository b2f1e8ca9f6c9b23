"""Reading plain data out of pickle and joblib files without executing anything.

A pickle is a program for a small machine that may call anything it can name.
Here the machine finds only the names in an explicit list, which stand for our
own code, which builds arrays of numbers and the simple containers around them.
Every other name ends the reading.
"""

from __future__ import annotations

import bz2
import collections
import gzip
import io
import lzma
import pickle
import re
import sys
import zlib
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.files.limits import VARIABLE, check_regular, read_limit_bytes

_PIECE = 16 * 2**20
_OBJECT_BYTES = 100
"""Memory of what one instruction makes, about: an empty set comes of a single byte."""

_NUMBERS = re.compile(r"[<>=|]?(?:[biufc]\d+|[?bBhHiIlLqQefdgFD]|[SUa]\d+)")
_REMEDY = (
    "Save the vertices where the file was written: "
    "numpy.savez('mesh.npz', vertices=verts, faces=faces, times_s=times)"
)
_RAISE = f". If the file is to be trusted, raise the limit by the environment variable {VARIABLE}"


class Refused(Exception):
    """Request of a file that is refused; the text follows the file's name."""


class TooLarge(Refused):
    """Request for more memory than is accepted."""


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

    def readinto(self, buffer: Any) -> int:
        """Fill ``buffer`` as far as the file goes."""
        content = self._upto(len(buffer))
        buffer[: len(content)] = content
        return len(content)

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
        raise Refused("is a zip archive, as torch.save writes; torch files are not read here")
    if start[:1] == b"\x78" and int.from_bytes(start[:2], "big") % 31 == 0:
        return io.BufferedReader(_ZlibFile(file), 2**16)
    return file


def read_pickle(path: Path, limit_bytes: int | None = None) -> Any:
    """Read arrays and containers from a pickle or joblib file, also a compressed one.

    Gives dictionaries, lists, tuples, sets, numbers, text and NumPy arrays of numbers; at most
    ``limit_bytes``, by default what a file of its size may be read as, are read after decompression
    and made of it. Raises Sd2Error if the file names anything else, is damaged or too large.
    """
    check_regular(path)
    try:
        if limit_bytes is None:
            limit_bytes = read_limit_bytes(path.stat().st_size)
        with path.open("rb") as file:
            source = LimitedFile(decompressed(file), limit_bytes)
            return _DataUnpickler(source).load()
    except Refused as refusal:
        raise Sd2Error(
            f"{path} {refusal}",
            "plain NumPy arrays, numbers, text, lists and dictionaries",
            f"{_REMEDY}{_RAISE if isinstance(refusal, TooLarge) else ''}",
        ) from refusal
    except Sd2Error:
        raise
    except MemoryError as error:
        raise Sd2Error(
            f"{path} asks for more memory than there is", "the size that is really stored", _REMEDY
        ) from error
    except RecursionError as error:
        raise Sd2Error(f"{path} is nested too deeply", "plain data", _REMEDY) from error
    except Exception as error:  # a damaged stream of opcodes fails in any way whatever
        raise Sd2Error(
            f"{path} cannot be read as a pickle ({type(error).__name__}: {error})",
            "a complete file written by pickle or joblib",
            _REMEDY,
        ) from error


class _Array(np.ndarray):
    """An array that takes its content from a pickle only when it is plain numbers."""

    def __setstate__(self, state: Any) -> None:
        if not isinstance(state, tuple) or len(state) not in (4, 5) or self.size:
            raise Refused("holds an array in a form that is not known")
        shape, dtype, fortran, content = state[-4:]
        if isinstance(content, str):  # written by Python 2
            content = content.encode("latin1")
        plain = _checked_dtype(content, dtype, shape)
        super().__setstate__((1, shape, plain, bool(fortran), content))  # type: ignore[arg-type]


class _Dtype:
    """Stands for ``numpy.dtype`` while reading; knows numbers and text only."""

    def __init__(self, code: Any, align: Any = False, copy: Any = False) -> None:
        if code in ("O", "O8", "|O", "O4"):
            raise Refused("holds an array of Python objects (dtype object)")
        if not isinstance(code, str):
            raise Refused(f"holds a dtype given as {type(code).__name__}")
        if not _NUMBERS.fullmatch(code) or np.dtype(code).itemsize == 0:
            raise Refused(f"holds an array of dtype {code[:60]}")
        self.plain: np.dtype[Any] = np.dtype(code)

    def __setstate__(self, state: Any) -> None:
        if not isinstance(state, tuple) or len(state) < 5:
            raise Refused("holds a dtype in a form that is not known")
        if any(part is not None for part in state[2:5]):
            raise Refused("holds a structured array")
        if state[1] in ("<", ">"):
            self.plain = self.plain.newbyteorder(state[1])


class _JoblibArray:
    """Stands for joblib's note that the bytes of an array follow in the file."""

    def __setstate__(self, state: Any) -> None:
        if not isinstance(state, dict):
            raise Refused("holds a joblib array in a form that is not known")
        self.shape = state.get("shape")
        self.order = state.get("order")
        self.dtype = state.get("dtype")
        self.aligned = state.get("numpy_array_alignment_bytes") is not None

    def read(self, source: LimitedFile) -> NDArray[Any]:
        """Read the bytes that follow."""
        if not isinstance(self.dtype, _Dtype):
            raise Refused("holds a joblib array without a dtype")
        size = _size(self.shape, self.dtype.plain, source.left)
        if self.aligned:
            source.read_exactly(source.read_exactly(1)[0])
        return _array(source.read_exactly(size), self.dtype, self.shape, self.order)


class _Name:
    """A class that may be named (an array's type) but neither called nor built."""


def _array(content: Any, dtype: Any, shape: Any, order: Any) -> NDArray[Any]:
    plain = _checked_dtype(content, dtype, shape)
    return np.ndarray(shape, plain, buffer=content, order="F" if order == "F" else "C")


def _checked_dtype(content: Any, dtype: Any, shape: Any) -> np.dtype[Any]:
    """The dtype, when it, the shape and the bytes agree."""
    if not isinstance(dtype, _Dtype):
        raise Refused("holds an array without a dtype")
    if not isinstance(content, bytes | bytearray):
        raise Refused("holds an array whose content is not bytes")
    size = _size(shape, dtype.plain, len(content))
    if size != len(content):
        raise Refused(f"holds an array of shape {shape} with {len(content):,} bytes, not {size:,}")
    return dtype.plain


def _size(shape: Any, dtype: np.dtype[Any], left: int) -> int:
    """Bytes of an array; refused when more than there can be."""
    if not isinstance(shape, tuple) or len(shape) > 32:
        raise Refused("holds an array without a shape")
    size = dtype.itemsize
    for length in shape:
        if not isinstance(length, int) or length < 0:
            raise Refused("holds an array with an impossible shape")
        size *= length
    if size > left:
        raise TooLarge(
            f"claims an array of shape {shape}, {size / 2**30:,.1f} GiB, more than the "
            f"{left / 2**30:,.1f} GiB that can be there"
        )
    return size


def _new_array(kind: Any, shape: Any, code: Any) -> _Array:
    """``numpy.core.multiarray._reconstruct``: an empty array, filled by its state."""
    return _Array.__new__(_Array, (0,), dtype=np.int8)


def _array_from_buffer(content: Any, dtype: Any, shape: Any, order: Any) -> NDArray[Any]:
    """``numpy.core.numeric._frombuffer`` of pickle protocol 5."""
    return _array(content, dtype, shape, order)


def _scalar(dtype: Any, content: Any = b"") -> Any:
    """``numpy.core.multiarray.scalar``."""
    if isinstance(content, str):
        content = content.encode("latin1")
    return _array(content, dtype, (), "C")[()]


def _encode(text: Any, coding: Any = "latin1") -> bytes:
    """``_codecs.encode``, by which old protocols store bytes."""
    if not isinstance(text, str) or coding not in ("latin1", "latin-1"):
        raise Refused("stores bytes in a way that is not known")
    return text.encode("latin1")


def _bytearray(content: Any = b"", coding: Any = "latin1") -> bytearray:
    """``bytearray`` of bytes; of a number it would fill the memory."""
    if isinstance(content, str):
        return bytearray(_encode(content, coding))
    if not isinstance(content, bytes):
        raise Refused("builds a bytearray from something else than bytes")
    return bytearray(content)


def _bytes(content: Any = b"") -> bytes:
    """``bytes`` of a list of numbers, as old protocols store it."""
    if not isinstance(content, bytes | list | tuple):
        raise Refused("builds bytes from something else than bytes")
    return bytes(content)


def _default_dict(factory: Any = None, *content: Any) -> collections.defaultdict[Any, Any]:
    """``collections.defaultdict`` with one of the plain types as its factory."""
    if factory is not None and factory not in _FACTORIES:
        raise Refused("holds a defaultdict with a factory that is not a plain type")
    return collections.defaultdict(factory, *content)


_FACTORIES = (dict, list, set, int, float, str, bool)
_ALLOWED: dict[tuple[str, str], Any] = {
    **{("builtins", kind.__name__): kind for kind in (*_FACTORIES, frozenset, complex)},
    ("builtins", "bytes"): _bytes,
    ("builtins", "bytearray"): _bytearray,
    ("collections", "OrderedDict"): collections.OrderedDict,
    ("collections", "defaultdict"): _default_dict,
    ("_codecs", "encode"): _encode,
    ("numpy", "dtype"): _Dtype,
    ("numpy", "ndarray"): _Name(),
    ("numpy", "memmap"): _Name(),
    ("joblib.numpy_pickle", "NumpyArrayWrapper"): _JoblibArray,
}
for _core in ("numpy.core", "numpy._core"):
    _ALLOWED[f"{_core}.multiarray", "_reconstruct"] = _new_array
    _ALLOWED[f"{_core}.multiarray", "scalar"] = _scalar
    _ALLOWED[f"{_core}.numeric", "_frombuffer"] = _array_from_buffer
    _ALLOWED[f"{_core}.memmap", "memmap"] = _Name()
_OF_A_LIST = (set, frozenset, collections.OrderedDict)
_COPIES = (*_OF_A_LIST, bytes, bytearray)
_CALLED = (
    *_OF_A_LIST,
    complex,
    _bytes,
    _bytearray,
    _default_dict,
    _encode,
    _Dtype,
    _new_array,
    _scalar,
    _array_from_buffer,
)

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
        if (home, name) in _ALLOWED:
            return _ALLOWED[home, name]
        if home.split(".")[0] == "torch":
            raise Refused(
                f"holds torch tensors ('{module}.{name}'); save them as NumPy arrays "
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
        """Call only what stands in the list, containers only with a list."""
        function, arguments = self.stack[-2:]
        if not any(function is called for called in _CALLED):
            raise Refused(f"calls {_named(function)}, which is forbidden")
        if function in _OF_A_LIST and not all(isinstance(a, list | tuple) for a in arguments):
            raise Refused(f"builds {_named(function)} from something else than a list")
        super().load_reduce()
        made = self.stack[-1]
        self._source.charge(sys.getsizeof(made) if isinstance(made, _COPIES) else 0)

    def load_newobj(self) -> None:
        """Make a :class:`_JoblibArray`, the only object that joblib makes in this form."""
        kind, arguments = self.stack[-2:]
        if kind is not _JoblibArray or arguments:
            raise Refused(f"makes {_named(kind)} without its constructor, which is forbidden")
        super().load_newobj()

    def load_build(self) -> None:
        """Fill arrays and dtypes; nothing else has a state to be set."""
        target = self.stack[-2]
        if not isinstance(target, _Array | _Dtype | _JoblibArray):
            raise Refused(f"sets the state of {_named(target)}, which is forbidden")
        super().load_build()
        self._source.charge(target.nbytes if isinstance(target, _Array) else 0)
        if isinstance(target, _JoblibArray):
            self.stack[-1] = target.read(self._source)

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


def _named(thing: Any) -> str:
    return f"'{thing.__name__}'" if isinstance(thing, type) else f"a {type(thing).__name__}"
