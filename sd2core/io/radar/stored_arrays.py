"""Arrays of radar samples in NumPy, HDF5, MATLAB and SigMF files, read in parts.

Of SigMF's metadata (``.sigmf-meta``) type of the samples, rate and carrier are read, after the
*Signal Metadata Format Specification* 1.x (sigmf.org): a few keys of one JSON file, for which the
``sigmf`` package is not needed.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import AliasPath, BaseModel, Field

from sd2core.errors import Sd2Error
from sd2core.files.hdf5_files import member_of, open_hdf5_file, refusing_damage
from sd2core.files.limits import check_regular, check_size, check_there
from sd2core.files.numpy_files import open_npy_file, read_words
from sd2core.files.texts import faults_in, read_json, reading_as

META, DATA = ".sigmf-meta", ".sigmf-data"
HDF5_SUFFIXES = (".h5", ".hdf5")
MATLAB_SUFFIX = ".mat"
SUFFIXES = (".npy", *HDF5_SUFFIXES, MATLAB_SUFFIX, META, DATA)
"""Files that such arrays are in."""

_SIGMF = "the metadata of a SigMF recording"
_HDF5 = "samples of a radar (.h5)"
_MATLAB_NUMBERS = frozenset(
    {"double", "single", *(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64))}
)
"""Classes of MATLAB."""
_reading_matlab = partial(reading_as, "MATLAB's", expected="a whole .mat", remedy="Copy it again")

_BLOCK_BYTES = 32 << 20
"""Of an .npy that are read at once, though a part of each row may be wanted."""


class SigmfMeta(NamedTuple):
    """Layout of a SigMF recording: a stream of samples."""

    word: np.dtype[np.generic]  # of one real number
    is_complex: bool
    channels: int
    sample_rate_hz: float | None
    carrier_hz: float | None


class _SigmfCapture(BaseModel):
    frequency: float | None = Field(default=None, alias="core:frequency", allow_inf_nan=False)
    header_bytes: int = Field(default=0, alias="core:header_bytes")


def _in_global(name: str, **how: Any) -> Any:
    return Field(validation_alias=AliasPath("global", f"core:{name}"), **how)


class _SigmfFile(BaseModel):
    datatype: str = _in_global("datatype")
    sample_rate: float | None = _in_global("sample_rate", default=None, gt=0, allow_inf_nan=False)
    num_channels: int = _in_global("num_channels", default=1, ge=1, le=1024)
    captures: list[_SigmfCapture] = Field(default_factory=list)


def read_sigmf_meta(path: Path) -> SigmfMeta:
    """Read the metadata that belong to a file of either suffix; Sd2Error if they are damaged."""
    path = path.with_suffix(META)
    with faults_in(path, _SIGMF):
        meta = _SigmfFile.model_validate(read_json(path, _SIGMF))
    kind = meta.datatype
    match = re.fullmatch(r"([cr])([fiu])(8|16|32|64)(?:_([lb])e)?", kind)
    if match is None or (match[2] == "f" and match[3] in ("8", "16")):
        raise Sd2Error(
            f"{path}: core:datatype is {kind!r:.40}", "a type such as ci16_le or cf32_le"
        )
    if len(meta.captures) > 1 or any(one.header_bytes for one in meta.captures):
        raise Sd2Error(
            f"{path} has {len(meta.captures)} captures, or headers between its samples",
            "one capture, of samples alone",
        )
    order = ">" if match[4] == "b" else "<"
    return SigmfMeta(
        np.dtype(f"{order}{match[2]}{int(match[3]) // 8}"),
        match[1] == "c",
        meta.num_channels,
        meta.sample_rate,
        meta.captures[0].frequency if meta.captures else None,
    )


class StoredArray(NamedTuple):
    """Array in a file."""

    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    read: Callable[[tuple[slice, ...]], NDArray[Any]]


def open_stored(path: Path, dataset: str | None) -> StoredArray:
    """Open the array in a file; Sd2Error if there is none, or it is damaged."""
    suffix = path.suffix.lower()
    check_there(path, "samples of a radar")
    if suffix in HDF5_SUFFIXES:
        return _hdf5(path, dataset)
    if suffix == MATLAB_SUFFIX:
        return _matlab(path, dataset)
    if dataset is not None:
        raise Sd2Error(
            f"{path} is given with the dataset {dataset!r}", "datasets of HDF5 and MATLAB files"
        )
    if suffix in (META, DATA):
        return _sigmf(path)
    return stored_npy(path, "a whole .npy of numbers")


def stored_npy(path: Path, expected: str) -> StoredArray:
    """Array of an .npy, which is read from its file each time, some rows of its order at once."""
    mapped: Any = open_npy_file(path, expected, "It may be cut off: copy it again")
    dtype, by_column = mapped.dtype, not mapped.flags.c_contiguous
    shape = mapped.shape[::-1] if by_column else mapped.shape
    each, skipped = math.prod(shape[1:]), mapped.offset // max(dtype.itemsize, 1)
    at_once = max(_BLOCK_BYTES // max(each * dtype.itemsize, 1), 1)

    def read(place: tuple[slice, ...]) -> NDArray[Any]:
        place += (slice(None),) * (len(shape) - len(place))
        first, *others = place[::-1] if by_column else place
        start, stop, _ = first.indices(shape[0])
        blocks = []
        for low in range(start, max(stop, start + 1), at_once):  # one at least: it has the shape
            words = slice(skipped + low * each, skipped + min(low + at_once, stop) * each)
            rows = read_words(path, dtype, words).reshape(-1, *shape[1:])
            blocks.append(rows[(slice(None), *others)])
        values = blocks[0] if len(blocks) == 1 else np.concatenate(blocks)
        return values.T if by_column else values

    return StoredArray(mapped.shape, dtype, read)


def array_names(path: Path) -> list[str]:
    """Names of the arrays of numbers in an HDF5 or MATLAB file; none of another or damaged one."""
    suffix = path.suffix.lower()
    try:
        if suffix == MATLAB_SUFFIX and not _is_hdf5(path):
            return [name for name, shape, kind in _matlab_arrays(path) if kind in _MATLAB_NUMBERS]
        if suffix == MATLAB_SUFFIX or suffix in HDF5_SUFFIXES:
            return _hdf5_names(path)
    except Sd2Error:
        pass
    return []


def _hdf5_names(path: Path) -> list[str]:
    import h5py

    with open_hdf5_file(path, _HDF5) as file, refusing_damage(path, _HDF5):
        members = {name: member_of(file, path, name) for name in file}
        return [
            name
            for name, one in members.items()
            if isinstance(one, h5py.Dataset) and one.shape and one.dtype.kind in "iufcV"
        ]


def _one_of(path: Path, names: list[str]) -> str:
    if len(names) != 1:
        raise Sd2Error(
            f"{path} holds {len(names)} arrays of numbers ({', '.join(names[:6]) or 'none'})",
            "the name of one: --dataset of `sd2 radar describe`, or dataset in the description",
        )
    return names[0]


def _hdf5(path: Path, dataset: str | None, *, by_column: bool = False) -> StoredArray:
    import h5py

    name = _one_of(path, _hdf5_names(path)) if dataset is None else dataset
    with open_hdf5_file(path, _HDF5) as file, refusing_damage(path, _HDF5):
        member = member_of(file, path, name)
        if not isinstance(member, h5py.Dataset) or member.shape is None:
            raise Sd2Error(f"{path} has no dataset {name!r}", "the name of one, as dataset")
        shape, dtype = member.shape, member.dtype
    if dtype.fields is not None and set(dtype.fields) == {"real", "imag"}:
        if any(dtype[part].kind not in "iuf" for part in ("real", "imag")):
            raise Sd2Error(f"{name} of {path} is of {dtype}", "numbers")
        dtype = np.dtype(np.complex64)

    def read(place: tuple[slice, ...]) -> NDArray[Any]:
        with open_hdf5_file(path, _HDF5) as file, refusing_damage(path, _HDF5):
            values = file[name][place[::-1] if by_column else place]
        if values.dtype.fields is not None:
            values = values["real"] + np.complex64(1j) * values["imag"].astype(np.float32)
        return np.asarray(values.T if by_column else values)

    return StoredArray(shape[::-1] if by_column else shape, dtype, read)


def _is_hdf5(path: Path) -> bool:
    """True for MATLAB's files from version 7.3 on."""
    import h5py

    return bool(h5py.is_hdf5(path))


def _matlab(path: Path, dataset: str | None) -> StoredArray:
    if _is_hdf5(path):
        return _hdf5(path, dataset, by_column=True)
    arrays = {name: shape for name, shape, kind in _matlab_arrays(path) if kind in _MATLAB_NUMBERS}
    name = _one_of(path, list(arrays)) if dataset is None else dataset
    if name not in arrays:
        raise Sd2Error(f"{path} has no array {name!r}", f"one of {', '.join(arrays) or 'none'}")
    from scipy.io import loadmat

    declared_bytes = 16 * math.prod(arrays[name])
    check_size(f"{name} of {path}", declared_bytes, path.stat().st_size)
    with _reading_matlab(path):
        values: NDArray[Any] = loadmat(path, variable_names=[name])[name]
    return StoredArray(values.shape, values.dtype, values.__getitem__)


def _matlab_arrays(path: Path) -> list[tuple[str, tuple[int, ...], str]]:
    """Name, shape and class of the variables of a file up to version 7."""
    from scipy.io import whosmat

    check_regular(path)
    with _reading_matlab(path):
        return [(str(name), tuple(map(int, shape)), kind) for name, shape, kind in whosmat(path)]


def _sigmf(path: Path) -> StoredArray:
    meta, data = read_sigmf_meta(path), path.with_suffix(DATA)
    check_there(data, "the samples beside their metadata")
    each = meta.channels * (2 if meta.is_complex else 1)
    count, left = divmod(data.stat().st_size, each * meta.word.itemsize)
    if left or not count:
        raise Sd2Error(
            f"{data} has {data.stat().st_size:,} bytes",
            f"a multiple of {each * meta.word.itemsize}, as core:datatype says",
            "It may be cut off: copy it again",
        )
    dtype = np.dtype(np.complex64) if meta.is_complex else meta.word
    shape = (count,) if meta.channels == 1 else (count, meta.channels)

    def read(place: tuple[slice, ...]) -> NDArray[Any]:
        start, stop, _ = place[0].indices(count)
        words = read_words(data, meta.word, slice(start * each, stop * each))
        if meta.is_complex:
            parts = words.reshape(-1, 2).astype(np.float32)
            words = parts[:, 0] + np.complex64(1j) * parts[:, 1]
        return words.reshape(-1, *shape[1:])

    return StoredArray(shape, dtype, read)
