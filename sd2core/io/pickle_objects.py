"""What pickles may name: our own stand-ins for arrays of numbers and the containers around them.

Each takes its content only after it was checked; nothing of the file's making is called.
"""

from __future__ import annotations

import collections
import math
import re
from typing import Any

import numpy as np
from numpy.typing import NDArray

_NUMBERS = re.compile(r"[<>=|]?(?:[biufc]\d+|[?bBhHiIlLqQefdgFD]|[SUa]\d+)")


class Refused(Exception):
    """Request of a file that is refused; the text follows the file's name."""


class TooLarge(Refused):
    """Request for more memory than is accepted."""


class PlainArray(np.ndarray):
    """An array that takes its content from a pickle only when it is plain numbers."""

    def __setstate__(self, state: Any) -> None:
        if not isinstance(state, tuple) or len(state) not in (4, 5) or self.size:
            raise Refused("holds an array in a form that is not known")
        shape, dtype, fortran, content = state[-4:]
        if isinstance(dtype, PlainDtype) and dtype.plain.hasobject:
            # What is in it was made by the same machine.
            count = len(content) if isinstance(content, list) else -1
            if _size(shape, dtype.plain, 2**40) != count * dtype.plain.itemsize:
                raise Refused("holds an array of objects in a form that is not known")
            super().__setstate__((1, shape, dtype.plain, False, content))  # type: ignore[arg-type]
            return
        if isinstance(content, str):  # written by Python 2
            content = content.encode("latin1")
        plain = _checked_dtype(content, dtype, shape)
        super().__setstate__((1, shape, plain, bool(fortran), content))  # type: ignore[arg-type]


class PlainDtype:
    """Stands for ``numpy.dtype`` while reading; knows numbers, text and what is made here."""

    def __init__(self, code: Any, align: Any = False, copy: Any = False) -> None:
        if code in ("O", "O8", "|O", "O4"):
            code = "O"
        elif not isinstance(code, str):
            raise Refused(f"holds a dtype given as {type(code).__name__}")
        elif not _NUMBERS.fullmatch(code) or np.dtype(code).itemsize == 0:
            raise Refused(f"holds an array of dtype {code[:60]}")
        self.plain: np.dtype[Any] = np.dtype(code)

    def __setstate__(self, state: Any) -> None:
        if not isinstance(state, tuple) or len(state) < 5:
            raise Refused("holds a dtype in a form that is not known")
        if any(part is not None for part in state[2:5]):
            raise Refused("holds a structured array")
        if state[1] in ("<", ">"):
            self.plain = self.plain.newbyteorder(state[1])


class JoblibArray:
    """Stands for joblib's note that the bytes of an array follow in the file."""

    def __setstate__(self, state: Any) -> None:
        if not isinstance(state, dict):
            raise Refused("holds a joblib array in a form that is not known")
        self.shape = state.get("shape")
        self.order = state.get("order")
        self.dtype = state.get("dtype")
        self.aligned = state.get("numpy_array_alignment_bytes") is not None

    def read(self, source: Any) -> NDArray[Any]:
        """Read the bytes that follow in a file that counts them."""
        if not isinstance(self.dtype, PlainDtype) or self.dtype.plain.hasobject:
            raise Refused("holds a joblib array of objects, or without a type")
        size = _size(self.shape, self.dtype.plain, source.left)
        if self.aligned:
            source.read_exactly(source.read_exactly(1)[0])
        return _array(source.read_exactly(size), self.dtype, self.shape, self.order)


class Described:
    """An object whose class is not there: its attributes, and the array that they stand for."""

    def __setstate__(self, state: Any) -> None:
        if not isinstance(state, dict):
            raise Refused(f"holds a {type(self).__name__} in a form that is not known")
        self.state = state

    def array(self, most_bytes: int) -> NDArray[Any]:
        """The array, of no more than ``most_bytes``."""
        raise NotImplementedError


class ChumpyArray(Described):
    """Array of chumpy, in which SMPL's model files keep what they may learn."""

    def array(self, most_bytes: int) -> NDArray[Any]:
        """The values; of a selection, those that were selected."""
        if isinstance(values := self.state.get("x"), np.ndarray):
            return values
        whole, chosen = self.state.get("a"), self.state.get("idxs")
        if not (isinstance(whole, np.ndarray) and isinstance(chosen, np.ndarray)):
            raise Refused("holds an array of chumpy that stands for a calculation")
        part: NDArray[Any] = np.asarray(whole).ravel()[np.asarray(chosen)]
        shape = self.state.get("preferred_shape")
        return part.reshape(shape) if isinstance(shape, tuple) else part


class SparseMatrix(Described):
    """Matrix of scipy with rows or columns compressed."""

    by_row = True

    def array(self, most_bytes: int) -> NDArray[Any]:
        """The whole matrix."""
        shape: Any = self.state.get("_shape", self.state.get("shape"))
        parts = [self.state.get(name) for name in ("data", "indices", "indptr")]
        if not all(isinstance(part, np.ndarray) and part.ndim == 1 for part in parts):
            raise Refused("holds a sparse matrix in a form that is not known")
        if _size(shape, np.dtype(np.float64), most_bytes) and len(shape) != 2:
            raise Refused("holds a sparse matrix that is none")
        values, minor, starts = (np.asarray(part) for part in parts)
        counts = np.diff(starts)
        if (counts < 0).any() or counts.sum() != len(values) or len(minor) != len(values):
            raise Refused("holds a sparse matrix whose parts do not agree")
        major = np.repeat(np.arange(len(counts)), counts)
        dense = np.zeros(shape, np.float64)
        np.add.at(dense, (major, minor) if self.by_row else (minor, major), values)
        return dense


class ColumnMatrix(SparseMatrix):
    """One with columns compressed."""

    by_row = False


class StorageKind:
    """A class of torch that says of which type the numbers of a storage are."""

    def __init__(self, code: str) -> None:
        self.dtype = np.dtype(code)


class Storage:
    """Numbers that tensors of torch are views of; those of old files come after all tensors."""

    def __init__(self, dtype: np.dtype[Any], count: Any) -> None:
        if not isinstance(count, int) or count < 0:
            raise Refused("holds a torch storage without a size")
        self.dtype, self.count = dtype, count
        self.values: NDArray[Any] | None = None

    @property
    def size_bytes(self) -> int:
        """Bytes of all its numbers."""
        return self.count * self.dtype.itemsize

    def fill(self, content: bytes | bytearray) -> None:
        """Take the numbers from their bytes."""
        if len(content) < self.size_bytes:
            raise Refused("holds fewer numbers than a torch tensor in it needs")
        self.values = np.frombuffer(content, self.dtype, self.count)


def _tensor(storage: Any, offset: Any, shape: Any, steps: Any, *_: Any) -> NDArray[Any]:
    """``torch._utils._rebuild_tensor_v2``: an array that sees a part of a storage."""
    if not isinstance(storage, Storage) or storage.values is None:
        raise Refused("holds a torch tensor without numbers")
    tuples = isinstance(shape, tuple) and isinstance(steps, tuple) and len(shape) == len(steps)
    numbers = (offset, *shape, *steps) if tuples else (None,)
    if not all(isinstance(one, int) and one >= 0 for one in numbers):
        raise Refused("holds a torch tensor with an impossible shape")
    # Repeated values, such as one shape for all frames, take memory only where they are copied.
    _size(shape, storage.dtype, max(storage.size_bytes, _MAX_REPEATED_BYTES))
    last = offset + sum((length - 1) * step for length, step in zip(shape, steps, strict=True))
    if math.prod(shape) and last >= storage.count:
        raise Refused("holds a torch tensor beyond its numbers")
    if not math.prod(shape):
        return np.zeros(shape, storage.dtype)
    size = storage.dtype.itemsize
    return np.lib.stride_tricks.as_strided(
        storage.values[offset:], shape, [step * size for step in steps], writeable=False
    ).copy()


def _parameter(tensor: Any, *_: Any) -> Any:
    """``torch._utils._rebuild_parameter``: the tensor itself."""
    return tensor


def _reconstructed(kind: Any, base: Any = None, state: Any = None) -> Any:
    """``copy_reg._reconstructor``: an object of old protocols, whose attributes follow."""
    if kind not in DESCRIBED:
        raise Refused("makes an object without its constructor, which is forbidden")
    return kind()


_MAX_REPEATED_BYTES = 64 * 2**20


class Named:
    """A class that may be named, as an array's type or a factory, but neither called nor built."""

    def __init__(self, kind: type) -> None:
        self.kind = kind


def _array(content: Any, dtype: Any, shape: Any, order: Any) -> NDArray[Any]:
    """``numpy.core.numeric._frombuffer`` of pickle protocol 5."""
    plain = _checked_dtype(content, dtype, shape)
    return np.ndarray(shape, plain, buffer=content, order="F" if order == "F" else "C")


def _checked_dtype(content: Any, dtype: Any, shape: Any) -> np.dtype[Any]:
    """The dtype, when it, the shape and the bytes agree."""
    if not isinstance(dtype, PlainDtype):
        raise Refused("holds an array without a dtype")
    if dtype.plain.hasobject:
        raise Refused("holds objects in place of numbers")
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


def _new_array(kind: Any, shape: Any, code: Any) -> PlainArray:
    """``numpy.core.multiarray._reconstruct``: an empty array, filled by its state."""
    return PlainArray.__new__(PlainArray, (0,), dtype=np.int8)


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
    kind = factory.kind if isinstance(factory, Named) else factory
    if kind not in (None, set, *_FACTORIES):
        raise Refused("holds a defaultdict with a factory that is not a plain type")
    return collections.defaultdict(kind, *content)


DESCRIBED = (ChumpyArray, SparseMatrix, ColumnMatrix)
_STORAGES = {
    **{"Float": "<f4", "Double": "<f8", "Half": "<f2", "Bool": "?", "Byte": "u1", "Char": "i1"},
    **{"Short": "<i2", "Int": "<i4", "Long": "<i8"},
}
_FACTORIES = (dict, list, int, float, str, bool)
ALLOWED: dict[tuple[str, str], Any] = {
    **{("builtins", kind.__name__): Named(kind) for kind in (*_FACTORIES, object)},
    **{("builtins", kind.__name__): kind for kind in (set, frozenset, complex)},
    ("builtins", "bytes"): _bytes,
    ("builtins", "bytearray"): _bytearray,
    ("collections", "OrderedDict"): collections.OrderedDict,
    ("collections", "defaultdict"): _default_dict,
    ("_codecs", "encode"): _encode,
    ("numpy", "dtype"): PlainDtype,
    ("numpy", "ndarray"): Named(np.ndarray),
    ("numpy", "memmap"): Named(np.ndarray),
    ("joblib.numpy_pickle", "NumpyArrayWrapper"): JoblibArray,
    ("copy_reg", "_reconstructor"): _reconstructed,
    ("copyreg", "_reconstructor"): _reconstructed,
    ("chumpy.ch", "Ch"): ChumpyArray,
    ("chumpy.reordering", "Select"): ChumpyArray,
    ("torch._utils", "_rebuild_tensor_v2"): _tensor,
    ("torch._utils", "_rebuild_parameter"): _parameter,
    **{("torch", f"{name}Storage"): StorageKind(code) for name, code in _STORAGES.items()},
}
for _kind, _stand_in in (("csc", ColumnMatrix), ("csr", SparseMatrix)):
    for _module in (f"scipy.sparse.{_kind}", f"scipy.sparse._{_kind}"):
        ALLOWED[_module, f"{_kind}_matrix"] = _stand_in
        ALLOWED[_module, f"{_kind}_array"] = _stand_in
for _core in ("numpy.core", "numpy._core"):
    ALLOWED[f"{_core}.multiarray", "_reconstruct"] = _new_array
    ALLOWED[f"{_core}.multiarray", "scalar"] = _scalar
    ALLOWED[f"{_core}.numeric", "_frombuffer"] = _array
    ALLOWED[f"{_core}.memmap", "memmap"] = Named(np.ndarray)
OF_A_LIST = (set, frozenset, collections.OrderedDict)
