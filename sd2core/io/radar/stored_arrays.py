"""Arrays of radar samples in NumPy, HDF5 and SigMF files, read in parts."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.files.hdf5_files import member_of, open_hdf5_file, refusing_damage
from sd2core.files.limits import check_regular
from sd2core.files.numpy_files import open_npy_file
from sd2core.io.radar.sigmf import DATA, META, read_sigmf_meta

HDF5_SUFFIXES = (".h5", ".hdf5")
SUFFIXES = (".npy", *HDF5_SUFFIXES, META, DATA)
"""Files that such arrays are in."""


class StoredArray(NamedTuple):
    """Array in a file."""

    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    read: Callable[[tuple[slice, ...]], NDArray[Any]]


def open_stored(path: Path, dataset: str | None) -> StoredArray:
    """Open the array in a file; Sd2Error if there is none, or it is damaged."""
    suffix = path.suffix.lower()
    check_regular(path)
    if not path.is_file():
        raise Sd2Error(f"There is no file {path}", "samples of a radar", "Check the path")
    if suffix in HDF5_SUFFIXES:
        return _hdf5(path, dataset)
    if dataset is not None:
        raise Sd2Error(f"{path} is given with the dataset {dataset!r}", "datasets of HDF5 files")
    return _sigmf(path) if suffix in (META, DATA) else _numpy(path)


def _numpy(path: Path) -> StoredArray:
    array = open_npy_file(path, "a whole .npy of numbers", "It may be cut off: copy it again")
    return StoredArray(array.shape, array.dtype, array.__getitem__)


def _hdf5(path: Path, dataset: str | None) -> StoredArray:
    import h5py

    expected = "samples of a radar (.h5)"
    with open_hdf5_file(path, expected) as file, refusing_damage(path, expected):
        if dataset is None:
            names = [name for name in file if isinstance(member_of(file, path, name), h5py.Dataset)]
            if len(names) != 1:
                raise Sd2Error(
                    f"{path} holds {len(names)} datasets ({', '.join(names[:6]) or 'none'})",
                    "the name of one, as dataset",
                )
            dataset = names[0]
        found = member_of(file, path, dataset)
        if not isinstance(found, h5py.Dataset) or found.shape is None:
            raise Sd2Error(f"{path} has no dataset {dataset!r}", "the name of one, as dataset")
        shape, dtype = found.shape, found.dtype
    if dtype.fields is not None and set(dtype.fields) == {"real", "imag"}:
        if any(dtype[part].kind not in "iuf" for part in ("real", "imag")):
            raise Sd2Error(f"{dataset} of {path} is of {dtype}", "numbers")
        dtype = np.dtype(np.complex64)
    name = dataset

    def read(place: tuple[slice, ...]) -> NDArray[Any]:
        with open_hdf5_file(path, expected) as file, refusing_damage(path, expected):
            values = file[name][place]
        if values.dtype.fields is None:
            return np.asarray(values)
        return values["real"] + np.complex64(1j) * values["imag"].astype(np.float32)

    return StoredArray(shape, dtype, read)


def _sigmf(path: Path) -> StoredArray:
    meta, data = read_sigmf_meta(path), path.with_suffix(DATA)
    check_regular(data)
    if not data.is_file():
        raise Sd2Error(f"There is no file {data}", "the samples beside their metadata")
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
        words = np.fromfile(
            data, meta.word, (stop - start) * each, offset=start * each * meta.word.itemsize
        )
        if meta.is_complex:
            parts = words.reshape(-1, 2).astype(np.float32)
            words = parts[:, 0] + np.complex64(1j) * parts[:, 1]
        return words.reshape(-1, *shape[1:])

    return StoredArray(shape, dtype, read)
