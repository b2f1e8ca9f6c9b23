"""Tables of numbers in files: text, arrays of NumPy and MATLAB, a vector for each column."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.files.limits import open_regular
from sd2core.files.texts import lines_of
from sd2core.io.imu_columns import titles_of
from sd2core.io.radar.point_columns import named_columns
from sd2core.io.radar.stored_arrays import MATLAB_SUFFIX, array_names, open_stored

TEXT_SUFFIXES = (".csv", ".tsv")
SUFFIXES = (*TEXT_SUFFIXES, ".npy", MATLAB_SUFFIX)
EXPECTED = "a table of points with the columns frame and doppler"
MIN_COLUMNS, MAX_COLUMNS = 3, 12
"""Columns of a table."""


class Table:
    """Columns of numbers: their names, if they have any, and how to read some of them."""

    names: tuple[str, ...] = ()
    width: int
    frame: Any = None  # of arrays by frame: gives the number of every point's frame

    def read(self, places: tuple[int, ...], most: int | None = None) -> list[NDArray[np.float64]]:
        """Columns at some places, of the first rows or all."""
        raise NotImplementedError


class TextTable(Table):
    """Rows of text, under a heading or without one."""

    def __init__(self, path: Path) -> None:
        self._path = path
        with open_regular(path) as stream:
            first = next((one for one in lines_of(stream) if one.strip()), b"")
        if b"\0" in first:
            raise Sd2Error(f"{path} is not in UTF-8", EXPECTED, "Save it as UTF-8")
        self._separator, titles = titles_of(first.decode("utf-8-sig", "replace").strip())
        self.width = len(titles)
        self._headed = not all(map(_is_number, titles))
        self.names = tuple(titles) if self._headed else ()

    def read(
        self, places: tuple[int, ...], most: int | None = None, dated: int | None = None
    ) -> list[NDArray[np.float64]]:
        """Columns at some places; in one of them may be dates, as ISO 8601 writes them."""
        try:
            with open_regular(self._path) as stream:
                lines = (
                    text.decode("utf-8-sig", "replace") for text in lines_of(stream) if text.strip()
                )
                if self._separator == ";":  # then decimal points may be commas
                    lines = (line.replace(",", ".") for line in lines)
                if self._headed:
                    next(lines, None)
                first = next(lines, None)
                if first is None:
                    raise Sd2Error(f"{self._path} holds no rows", "at least one")
                table = np.loadtxt(
                    chain([first], lines),
                    delimiter=self._separator,
                    usecols=places,
                    ndmin=2,
                    max_rows=most,
                    comments=None,
                    converters=None if dated is None else {dated: _unix_s},
                    encoding="utf-8",
                )
        except (OSError, ValueError) as error:
            expected = "numbers in every row, separated alike"
            raise Sd2Error(f"{self._path} cannot be read ({error})", expected) from error
        return list(table.T.astype(np.float64))


class _Array(Table):
    def __init__(self, path: Path, dataset: str | None) -> None:
        stored = open_stored(path, dataset)
        fields = stored.dtype.names or ()
        self._stored, self.names = stored, tuple(fields)
        dimensions = len(stored.shape) + bool(fields)
        self.width = len(fields) or (stored.shape[-1] if dimensions in (2, 3) else 0)
        if not (dimensions in (2, 3) and MIN_COLUMNS <= self.width <= MAX_COLUMNS):
            raise Sd2Error(f"{path} has shape {stored.shape}", EXPECTED)
        if any(stored.dtype[name].kind not in "iuf" for name in fields) or (
            not fields and stored.dtype.kind not in "iuf"
        ):
            raise Sd2Error(f"{path} is of {stored.dtype}", "real numbers")
        self._by_frame = dimensions == 3
        if self._by_frame:
            self.frame = self._frames

    def _rows(self, most: int | None = None) -> NDArray[Any]:
        """Points, (P, columns); rows of zeros fill up frames, and are left out."""
        if most is None:
            return self._whole[0]
        return self._filled(-(-most // self._stored.shape[1]) if self._by_frame else most)[0]

    @cached_property
    def _whole(self) -> tuple[NDArray[Any], NDArray[np.bool_]]:
        return self._filled(None)

    def _filled(self, most: int | None) -> tuple[NDArray[Any], NDArray[np.bool_]]:
        """Points of the first rows or all, and where they are in the array."""
        values = np.asarray(self._stored.read((slice(0, most),)))
        if values.dtype.names:
            values = np.stack([values[name].astype(np.float64) for name in values.dtype.names], -1)
        values = values.astype(np.float64)
        filled = np.ones(len(values), bool)
        if self._by_frame:
            filled = np.asarray(values.any(axis=-1))
        return values[filled], filled

    def _frames(self) -> NDArray[np.float64]:
        return np.nonzero(self._whole[1])[0].astype(np.float64)

    def read(self, places: tuple[int, ...], most: int | None = None) -> list[NDArray[np.float64]]:
        rows = self._rows(most)
        return [np.ascontiguousarray(rows[:, place]) for place in places]


class _Vectors(Table):
    """A vector for each column, all of the same length."""

    def __init__(self, path: Path, names: Sequence[str]) -> None:
        self._path, self.names, self.width = path, tuple(names), len(names)

    def read(self, places: tuple[int, ...], most: int | None = None) -> list[NDArray[np.float64]]:
        columns = []
        for place in places:
            stored = open_stored(self._path, self.names[place])
            whole = np.asarray(stored.read(tuple(slice(None) for _ in stored.shape)))
            columns.append(whole.ravel().astype(np.float64)[:most])
        if len({len(one) for one in columns}) > 1:
            lengths = ", ".join(str(len(one)) for one in columns)
            raise Sd2Error(f"{self._path} has columns of {lengths} entries", "as many in each")
        return columns


def open_table(path: Path, dataset: str | None) -> Table:
    """Open the table of a file; Sd2Error if it holds none."""
    if path.suffix.lower() in TEXT_SUFFIXES:
        return TextTable(path)
    if path.suffix.lower() == MATLAB_SUFFIX and dataset is None:
        names = array_names(path)
        if named_columns(names) is not None:
            return _Vectors(path, names)
    return _Array(path, dataset)


def _unix_s(text: str) -> float:
    moment = np.datetime64(text.strip().strip('"').removesuffix("Z"), "us")
    return float(moment.astype(np.int64)) / 1e6


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
