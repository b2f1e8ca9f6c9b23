"""Tables of numbers in files: text, arrays of NumPy and MATLAB; what columns of points hold."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import chain
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.files.limits import open_regular
from sd2core.files.texts import lines_of
from sd2core.io.imu_columns import titles_of
from sd2core.io.radar.stored_arrays import MATLAB_SUFFIX, array_names, open_stored
from sd2core.plausibility.clock import UNITS_S

_NAMES = {
    "frame": ("frame", "frameid", "framenum", "framenumber", "frameno", "frameindex", "frameidx"),
    "time": ("time", "timestamp", "abstime", "t", "ts"),
    "x": ("x", "px", "posx", "xpos", "pointx"),
    "y": ("y", "py", "posy", "ypos", "pointy"),
    "z": ("z", "pz", "posz", "zpos", "pointz"),
    "range": ("range", "r", "distance", "dist"),
    "doppler": ("doppler", "velocity", "radialvelocity", "dopplervelocity", "vel", "speed", "vr",
                "v"),
    "intensity": ("intensity", "snr", "power", "peak", "peakval", "energy", "amplitude", "rcs"),
}  # fmt: skip
COLUMNS = tuple(_NAMES)
"""Columns that are known; the velocity alone must be there, and the frame or the time."""
_SPEEDS_MPS = {
    "m/s": 1.0, "mps": 1.0, "ms": 1.0, "ms-1": 1.0, "cm/s": 0.01, "cmps": 0.01, "mm/s": 0.001,
    "km/h": 1 / 3.6, "kmh": 1 / 3.6, "kph": 1 / 3.6,
}  # fmt: skip
_UNITS = {"m", "db", "dbm", *_SPEEDS_MPS, *UNITS_S}
IGNORED = "-"
"""Name of a column that is not needed."""


def named_columns(titles: Sequence[str], *, framed: bool = False) -> tuple[str, ...] | None:
    """Columns by their titles, the first of several for the same."""
    plain = [_plain(title) for title in titles]
    columns: dict[int, str] = {}
    for name, aliases in _NAMES.items():
        place = next((plain.index(one) for one in aliases if one in plain), None)
        if place is not None:
            if plain.count(plain[place]) > 1 and name in ("frame", "doppler"):
                return None  # which of them is meant?
            columns[place] = name
    has = set(columns.values())
    if "doppler" not in has or not (framed or has & {"frame", "time"}):
        return None
    if not has & {"x", "y", "range", "intensity"}:
        return None
    return tuple(columns.get(place, IGNORED) for place in range(len(titles)))


def _plain(title: str) -> str:
    """Letters of a title alone, without a unit."""
    words = re.findall(r"[a-z]+", re.sub(r"[\[(].*?[\])]", "", title.lower()))
    while len(words) > 1 and words[-1] in _UNITS:
        words.pop()
    return "".join(words)


def time_unit_s(title: str) -> float | None:
    """Unit of times that a title names after the column, or in brackets."""
    words = re.findall(r"[a-zµ]+", title.lower())
    return UNITS_S.get(words[-1]) if len(words) > 1 else None


def speed_unit_mps(path: Path, title: str) -> float:
    """Unit of velocities that a title names likewise, m/s where it names none."""
    brackets = re.search(r"[\[(](.*?)[\])]", title.lower())
    unit = "" if brackets is None else re.sub(r"[\s^·]", "", brackets[1])
    if unit not in _SPEEDS_MPS and unit:
        raise Sd2Error(
            f"{path}: {title} has the unit {unit}", f"one of {', '.join(_SPEEDS_MPS)}",
            "Write velocities in m/s",
        )  # fmt: skip
    last = re.split(r"[\s_]", title.lower())[-1]
    return _SPEEDS_MPS.get(unit or last, 1.0)


def is_in_decibels(title: str) -> bool:
    """True if a title names them likewise."""
    return re.findall(r"[a-z]+", title.lower())[1:][-1:] in (["db"], ["dbm"])


TEXT_SUFFIXES = (".csv", ".tsv")
SUFFIXES = (*TEXT_SUFFIXES, ".npy", MATLAB_SUFFIX)
EXPECTED = "a table of points with the columns frame and doppler"
MIN_COLUMNS, MAX_COLUMNS = 3, 12
"""Columns of a table."""


class Table:
    """Columns of numbers: their names, if they have any, and how to read some of them."""

    names: tuple[str, ...] = ()
    width: int
    by_frame = False  # then the numbers of the points' frames are one more column, the last

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
        self._separator, titles = titles_of(first.decode("utf-8-sig", "replace").strip(" \r\n"))
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
        self.by_frame = dimensions == 3

    def read(self, places: tuple[int, ...], most: int | None = None) -> list[NDArray[np.float64]]:
        if most is not None and self.by_frame:
            most = -(-most // self._stored.shape[1])
        values = np.asarray(self._stored.read((slice(0, most),)))
        if values.dtype.names:
            values = np.stack([values[name].astype(np.float64) for name in values.dtype.names], -1)
        values = values.astype(np.float64)
        if self.by_frame:  # rows of zeros fill up their frames
            filled = values.any(axis=-1)
            values = np.column_stack([values[filled], np.nonzero(filled)[0]])
        return [np.ascontiguousarray(values[:, place]) for place in places]


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
