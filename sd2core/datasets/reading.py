"""Reading of data sets, the same for Zarr, HDF5 and NPZ."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.datasets import formats, store
from sd2core.datasets.layout import SPLITS, FileFormat, Header, format_of
from sd2core.errors import Sd2Error
from sd2core.options.declared import DeclaredColumn, SourceEntry, check_record, column_bounds


@dataclass(eq=False)
class Dataset:
    """Open data set, whose arrays are read in parts.

    Get one from :func:`open_dataset`. ``dataset["synthetic"][10:20]`` is an array of shape
    (10, length, bins); ``docs/formats.md`` lists all names.
    """

    path: Path
    form: FileFormat
    header: Header
    arrays: dict[str, Any]
    source_count: int
    _lines: Callable[[], Iterable[dict[str, Any]]]  # Of the sources.
    _file: Any = None

    def __len__(self) -> int:
        """Return the number of segments."""
        return int(self.arrays["start_s"].shape[0])

    def __getitem__(self, name: str) -> Any:
        """Return an array by its name, to be sliced."""
        if name not in self.arrays:
            raise Sd2Error(f"{self.path} has no {name!r}", f"one of {', '.join(self.arrays)}")
        return self.arrays[name]

    def __enter__(self) -> Dataset:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the file, if there is one."""
        if self._file is not None:
            self._file.close()
            self._file = None

    def sources(self) -> Iterator[dict[str, Any]]:
        """Yield the facts of each source, in the order of the array ``source``."""
        for number, entry in enumerate(self._lines(), start=1):
            check_record(SourceEntry, entry, f"{self.path}: source {number}")
            yield entry

    def of_split(self, split: str) -> NDArray[np.int64]:
        """Return the indices of the segments of a split, ascending.

        Raises Sd2Error for a name that is none.
        """
        if split not in SPLITS:
            raise Sd2Error(f"The split is {split!r}", f"one of {', '.join(SPLITS)}")
        return np.flatnonzero(self["split"][:] == SPLITS.index(split))


def open_dataset(path: Path) -> Dataset:
    """Open a data set of any format.

    Raises
    ------
    Sd2Error
        When it is none, damaged, not finished, or of a later version.
    """
    opened = _opened(Path(path))
    header = opened.header
    bounds = column_bounds(
        len(header.labels), len(header.subjects), opened.source_count, len(SPLITS)
    )
    for name in bounds.keys() & opened.arrays.keys():
        array = opened.arrays[name]
        opened.arrays[name] = DeclaredColumn(array, f"{path}: {name}", bounds[name])
    return opened


def _opened(path: Path) -> Dataset:
    form = format_of(path)
    if not path.exists():
        raise Sd2Error(f"{path} does not exist", "a data set that `sd2 export` made")
    if form == "zarr":
        header, arrays = store.open_arrays(path)
        index = path / store.SOURCES_NAME
        count, lines = store.count_sources(index), partial(store.read_sources, index)
        return Dataset(path, form, header, arrays, count, lines)
    if form == "hdf5":
        header, arrays, count, file = formats.open_hdf5(path)
        lines = partial(formats.hdf5_sources, file, path)
        return Dataset(path, form, header, arrays, count, lines, file)
    header, arrays, sources = formats.open_npz(path)
    return Dataset(path, form, header, arrays, len(sources), lambda: sources)
