"""Data sets as one file, HDF5 or NPZ, with the same arrays and description as the store."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.datasets.layout import (
    FORMAT,
    VERSION,
    Header,
    bytes_per_segment,
    check_arrays,
    chunk_of,
    row_shapes,
    whole_names,
)
from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_file, atomic_write
from sd2core.files.hdf5_files import member_of, open_hdf5_file, refusing_damage
from sd2core.files.limits import check_size
from sd2core.files.numpy_files import open_npz_file
from sd2core.files.stores import Damage, Depth, unreadable
from sd2core.progress import Progress, silent

NPZ_LIMIT_BYTES = 1 << 30
"""An NPZ is written and read whole: larger ones do not fit beside what else is in memory."""

META, SOURCES = "meta", "sources"
_EXPECTED = "a data set that `sd2 export` made"


def refuse_large_npz(out: Path, segments: int, header: Header) -> None:
    """Refuse an NPZ too large to be opened."""
    size = segments * bytes_per_segment(header)
    if size > NPZ_LIMIT_BYTES:
        raise Sd2Error(
            f"{out} would hold {segments:,} segments, {size / 1e9:.1f} GB",
            f"up to {NPZ_LIMIT_BYTES / 1e9:.1f} GB in an .npz, which is read whole",
            "Write it as .zarr or .h5, which are read in parts",
        )


class Hdf5Rows:
    """Array of an HDF5 data set that stays on disk; Sd2Error names what is damaged."""

    def __init__(self, array: Any, path: Path, name: str) -> None:
        self._array = array
        self.path, self.name = path, name
        self.checksums = bool(array.fletcher32)
        self.shape: tuple[int, ...] = tuple(array.shape)
        self.dtype: np.dtype[Any] = np.dtype(array.dtype)

    def __len__(self) -> int:
        return self.shape[0]

    def __getitem__(self, key: Any) -> NDArray[Any]:
        try:
            return np.asarray(self._array[key])
        except (OSError, RuntimeError, ValueError) as error:
            cause = self.damage("values") or f"{self.name} ({error})"
            raise unreadable(self.path, cause) from error

    def damage(
        self, depth: Depth, rows: range | None = None, progress: Progress = silent
    ) -> tuple[Damage, ...]:
        """Return the chunks of rows that cannot be read; HDF5 looks at all at every depth."""
        rows = range(self.shape[0]) if rows is None else rows
        step = (self._array.chunks or self.shape)[0]
        damaged = []
        for start in range(rows.start // step * step, rows.stop, step):
            progress(start - rows.start, len(rows))
            stop = min(start + step, self.shape[0])
            try:
                self._array[start:stop]
            except (OSError, RuntimeError, ValueError) as error:
                damaged.append(Damage(self.name, start, stop, "segments", str(error)))
        return tuple(damaged)


def open_hdf5(path: Path) -> tuple[Header, dict[str, Any], int, Any]:
    """Open an HDF5 data set: header, arrays, number of the sources, and the open file."""
    file = open_hdf5_file(path, _EXPECTED)
    with ExitStack() as stack, refusing_damage(path, _EXPECTED):
        stack.push(file)
        meta = member_of(file, path, META)
        text = "null" if meta is None else meta[()].decode("utf-8")
        header = Header.from_dict(_json(text, path), path)
        arrays = {
            name: Hdf5Rows(member_of(file, path, name), path, name)
            for name in whole_names(header, file.keys(), path)
        }
        check_arrays(header, arrays, path)
        count = len(member_of(file, path, SOURCES))
        stack.pop_all()
    return header, arrays, count, file


def open_npz(path: Path) -> tuple[Header, dict[str, Any], list[dict[str, Any]]]:
    """Read an NPZ data set: header, arrays and sources."""
    with open_npz_file(path, "a data set", _EXPECTED) as data:
        members = dict(data)
    header = Header.from_dict(_json(str(members.get(META, "null")), path), path)
    lines = [_json(str(line), path) for line in members.get(SOURCES, ())]
    arrays = {name: members[name] for name in whole_names(header, members.keys(), path)}
    check_arrays(header, arrays, path)
    return header, arrays, lines


def hdf5_sources(file: Any, path: Path) -> Iterator[dict[str, Any]]:
    """Yield the sources of an open HDF5 data set."""
    with refusing_damage(path, _EXPECTED):
        lines = member_of(file, path, SOURCES)
        read_bytes = 0
        for number in range(len(lines)):
            line = lines[number]
            # All lines may be one and the same in the file.
            read_bytes += len(line)
            check_size(f"{SOURCES} of {path}", read_bytes, path.stat().st_size)
            yield _json(line.decode("utf-8"), path)


def write_npz(
    out: Path, header: Header, arrays: dict[str, Any], sources: Iterable[dict[str, Any]]
) -> None:
    """Write a data set as an NPZ, in one step and from memory.

    Parameters
    ----------
    out : Path
        File to write.
    header : Header
        Description, which says what arrays there are.
    arrays : dict
        Arrays of Zarr or h5py by name, (segments, …).
    sources : iterable of dict
        Lines of the sources.
    """
    content: dict[str, Any] = {name: np.asarray(arrays[name][:]) for name in row_shapes(header)}
    content[META] = json.dumps(header.as_dict())
    content[SOURCES] = np.array([json.dumps(entry, ensure_ascii=False) for entry in sources])
    with atomic_write(out) as stream:
        np.savez_compressed(stream, **content)


def write_hdf5(
    out: Path,
    header: Header,
    arrays: dict[str, Any],
    sources: Iterable[dict[str, Any]],
    progress: Progress = silent,
) -> None:
    """Write a data set as HDF5, in one step and in parts.

    Parameters
    ----------
    out, header, arrays, sources
        As for :func:`write_npz`.
    progress : Progress
        Counts rows of all arrays; may raise Cancelled.
    """
    import h5py

    rows = arrays["start_s"].shape[0]
    names = row_shapes(header)
    # HDF5 writes to a file of its own, not to a stream.
    with atomic_file(out) as made, h5py.File(made, "w") as file:
        file.attrs["format"], file.attrs["version"] = FORMAT, VERSION
        file[META] = json.dumps(header.as_dict(), ensure_ascii=False)
        for number, (name, (kind, row)) in enumerate(names.items()):
            chunk = (min(chunk_of(row)[0], rows), *row)
            target = file.create_dataset(
                name, shape=(rows, *row), dtype=kind, chunks=chunk, compression="gzip",
                compression_opts=1, shuffle=True, fletcher32=True,
            )  # fmt: skip
            step = 16 * chunk_of(row)[0]
            for start in range(0, rows, step):
                stop = min(start + step, rows)
                target[start:stop] = arrays[name][start:stop]
                progress(number * rows + stop, len(names) * rows)
        text = h5py.string_dtype("utf-8")
        lines = file.create_dataset(SOURCES, shape=(0,), maxshape=(None,), dtype=text, chunks=(64,))
        for number, entry in enumerate(sources):
            lines.resize((number + 1,))
            lines[number] = json.dumps(entry, ensure_ascii=False)


def _json(text: str, path: Path) -> Any:
    try:
        return json.loads(text)
    except ValueError as error:
        raise Sd2Error(f"{path}: its description is damaged ({error})", "JSON") from error
