"""Point clouds of a radar as tables: a row per point with its frame, velocity, and what else.

Columns go by their names, in any order: text under a heading (``.csv``, ``.tsv``), NumPy
(``.npy`` with named fields) or MATLAB (``.mat``, a vector per column). Arrays without names,
(points, columns) or (frames, points, columns), are read where their numbers leave no doubt, else
as the description beside them says.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import chain
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from sd2core.errors import Sd2Error
from sd2core.files.limits import open_regular
from sd2core.files.texts import faults_in, lines_of, read_toml
from sd2core.io.imu_columns import titles_of
from sd2core.io.radar.stored_arrays import MATLAB_SUFFIX, array_names, open_stored
from sd2core.plausibility.clock import UNITS_S

TEXT_SUFFIXES = (".csv", ".tsv")
SUFFIXES = (*TEXT_SUFFIXES, ".npy", MATLAB_SUFFIX)

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
COLUMNS_OPTION = "--columns frame,x,y,z,doppler,intensity (- for others)"
"""How the user names the columns, for messages."""
_SPEEDS_MPS = {
    "m/s": 1.0, "mps": 1.0, "ms": 1.0, "ms-1": 1.0, "cm/s": 0.01, "cmps": 0.01, "mm/s": 0.001,
    "km/h": 1 / 3.6, "kmh": 1 / 3.6, "kph": 1 / 3.6,
}  # fmt: skip
_UNITS = {"m", "db", "dbm", *_SPEEDS_MPS, *UNITS_S}
_IGNORED = "-"
_EXPECTED = "a table of points with the columns frame and doppler"
_FEWEST, _MAX = 3, 12
_LOOKED_AT = 20_000
_FASTEST_MPS = 30.0
_SHUFFLED = 0.1
"""Share of rows whose frame is before the last one's: beyond it they are in no order."""


class PointsDescription(BaseModel):
    """What a table of points does not say itself, in the TOML beside it.

    ``columns`` name the columns in order, ``-`` one that is not needed. With ``sign`` 1 a positive
    velocity is that of a point whose distance grows, with -1 of one that comes nearer.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    format: Literal["sd2-radar"] = "sd2-radar"
    version: Literal[1] = 1
    columns: tuple[str, ...] = Field(min_length=2, max_length=_MAX)
    dataset: str | None = None
    frame_repetition_s: float | None = Field(default=None, ge=1e-3, le=1e3)
    sign: Literal[1, -1] | None = None


@dataclass(frozen=True, eq=False)
class RadarPoints:
    """Points in the order of their frames; what a file does not say is None."""

    frame: NDArray[np.float64]  # (P,) ascending
    doppler: NDArray[np.float64]  # (P,) as in the file
    time: NDArray[np.float64] | None
    time_unit_s: float | None  # None: its heading does not name it
    range_m: NDArray[np.float64] | None
    intensity: NDArray[np.float64] | None
    columns: tuple[str, ...]  # names in the order of the file, "-" for what is not needed
    guessed: bool  # by their numbers alone


def points_description(path: Path) -> PointsDescription | None:
    """Description of a table that lies beside it, if there is one; Sd2Error if it is damaged."""
    told = _told_beside(path)
    return described_points(path.with_suffix(".toml"), told) if "columns" in told else None


def described_points(place: Path, told: Mapping[str, Any]) -> PointsDescription:
    """Description of a table by what is told of it; Sd2Error where that is not possible."""
    with faults_in(place, "the description of a table of points"):
        description = PointsDescription.model_validate(dict(told))
    columns = description.columns
    named = [one for one in columns if one != _IGNORED]
    if not set(named) <= set(COLUMNS) or len(set(named)) < len(named) or "doppler" not in named:
        raise Sd2Error(
            f"{place}: columns are {', '.join(columns)}",
            f"doppler, and of {', '.join(COLUMNS)} each at most once; - for others",
        )
    return description


def looks_like_points(path: Path) -> bool:
    """True if a file is a table of points, by its description, names or numbers."""
    if path.suffix.lower() not in SUFFIXES or not path.is_file():
        return False
    told = _told_beside(path)
    try:
        return bool("columns" in told or (not told and _recognised(_opened(path, None))))
    except Sd2Error:
        return False


def holds_unnamed_columns(path: Path) -> bool:
    """True if a file is a table of numbers whose columns nothing names, perhaps of points."""
    if path.suffix.lower() not in SUFFIXES or _told_beside(path):
        return False
    try:
        table = _opened(path, None)
    except Sd2Error:
        return False
    return not table.names and _FEWEST <= table.width <= _MOST and _recognised(table) is None


def has_columns_told(path: Path) -> bool:
    """True if the description beside a file, right or wrong, is of a table of points."""
    return "columns" in _told_beside(path)


def _told_beside(path: Path) -> dict[str, Any]:
    """Content of the description of radar data beside a file; empty where there is none."""
    beside = path.with_suffix(".toml")
    if path.suffix.lower() not in SUFFIXES or not beside.is_file():
        return {}
    try:
        content = read_toml(beside, _EXPECTED)
    except Sd2Error:
        return {}
    return content if content.get("format") == "sd2-radar" else {}


def read_points(path: Path, description: PointsDescription | None = None) -> RadarPoints:
    """Read a table.

    Raises Sd2Error if its columns are not known, or it holds what is no finite number.
    """
    table = _opened(path, description.dataset if description else None)
    found = _recognised(table) if description is None else (description.columns, False)
    if found is None:
        raise _unknown(path, table)
    columns, guessed = found
    if len(columns) != table.width:
        raise Sd2Error(
            f"{path} has {table.width} columns, its description {len(columns)}", "as many"
        )
    places = {name: place for place, name in enumerate(columns) if name in COLUMNS}
    try:
        numbers = dict(zip(places, table.read(tuple(places.values())), strict=True))
    except Sd2Error:
        if "time" not in places or not isinstance(table, _Text):
            raise
        numbers = _with_dates(table, places)
    if table.frame is not None:
        numbers["frame"] = table.frame()
    finite = np.isfinite(numbers["doppler"])
    if not finite.all():
        row = int(np.flatnonzero(~finite)[0])
        raise Sd2Error(f"{path}: the velocity of row {row + 1} is no number", "a finite number")
    titles = {name: table.names[place] for name, place in places.items() if table.names}
    numbers["doppler"] *= _speed_mps(path, titles.get("doppler", ""))
    unit_s = _unit_s(titles.get("time", ""))
    return _sorted(path, numbers, columns, unit_s, guessed)


def _with_dates(table: _Text, places: dict[str, int]) -> dict[str, NDArray[np.float64]]:
    """Columns of a table whose times are dates, or else are left out where frames are numbered."""
    try:
        read = table.read_dates(tuple(places.values()), places["time"])
    except Sd2Error:
        if "frame" not in places:
            raise
        del places["time"]
        read = table.read(tuple(places.values()))
    return dict(zip(places, read, strict=True))


def column_names(path: Path, dataset: str | None = None) -> tuple[str, ...]:
    """Columns of a table as far as they are known; Sd2Error where they are not, or it is none."""
    table = _opened(path, dataset)
    found = _recognised(table)
    if found is None:
        raise _unknown(path, table)
    return found[0]


def _unknown(path: Path, table: _Table) -> Sd2Error:
    held = ", ".join(table.names) if table.names else f"{table.width} columns without names"
    return Sd2Error(
        f"{path} holds {held}",
        "frame (or time) and doppler, and x, y, z, intensity where they are known",
        f"Name the columns in order: sd2 radar describe {path.name} {COLUMNS_OPTION}",
    )


def _sorted(
    path: Path,
    numbers: dict[str, NDArray[np.float64]],
    columns: tuple[str, ...],
    time_unit_s: float | None,
    guessed: bool,
) -> RadarPoints:
    """Points by their frames: their numbers, or moments of the same time."""
    time = numbers.get("time")
    if "frame" not in numbers:
        if time is None:
            raise Sd2Error(f"{path} has columns {', '.join(columns)}", "a frame or a time")
        numbers["frame"] = np.unique(time, return_inverse=True)[1].astype(np.float64)
    frame = numbers["frame"]
    if not (np.isfinite(frame).all() and (frame == np.round(frame)).all()):
        raise Sd2Error(f"{path}: frames are numbered {frame[frame % 1 != 0][0]:g}", "whole numbers")
    if (np.diff(frame) < 0).mean() > _SHUFFLED:
        order = np.argsort(frame, kind="stable")
        numbers = {name: values[order] for name, values in numbers.items()}
        frame, time = numbers["frame"], numbers.get("time")
    # A number that falls begins another recording in the same file.
    starts = np.flatnonzero(np.diff(frame) < 0) + 1
    for start in starts.tolist():
        frame[start:] += frame[start - 1] - frame[start] + LONGEST_GAP_FRAMES + 1
    place = [numbers[name] for name in ("x", "y", "z") if name in numbers]
    range_m = numbers.get("range")
    if range_m is None and len(place) > 1:
        range_m = np.sqrt(sum(axis * axis for axis in place))
    return RadarPoints(
        frame,
        numbers["doppler"],
        time,
        time_unit_s,
        range_m,
        numbers.get("intensity"),
        columns,
        guessed,
    )


LONGEST_GAP_FRAMES = 10
"""Frames without a point that are taken for silence; a longer gap is one in time."""


# --- tables in files -------------------------------------------------------------------------


class _Table:
    """Columns of numbers: their names, if they have any, and how to read some of them."""

    names: tuple[str, ...] = ()
    width: int
    frame: Any = None  # of arrays by frame: gives the number of every point's frame

    def read(self, places: tuple[int, ...], most: int | None = None) -> list[NDArray[np.float64]]:
        """Columns at some places, of the first rows or all."""
        raise NotImplementedError


class _Text(_Table):
    def __init__(self, path: Path) -> None:
        self._path = path
        with open_regular(path) as stream:
            first = next((one for one in lines_of(stream) if one.strip()), b"")
        if b"\0" in first:
            raise Sd2Error(f"{path} is not in UTF-8", _EXPECTED, "Save it as UTF-8")
        self._separator, titles = titles_of(first.decode("utf-8-sig", "replace").strip())
        self.width = len(titles)
        self._headed = not all(map(_is_number, titles))
        self.names = tuple(titles) if self._headed else ()

    def read(self, places: tuple[int, ...], most: int | None = None) -> list[NDArray[np.float64]]:
        return self._read(places, most, {})

    def read_dates(self, places: tuple[int, ...], dated: int) -> list[NDArray[np.float64]]:
        """Columns at some places; what one of them has are dates as ISO 8601 writes them."""
        return self._read(places, None, {dated: _unix_s})

    def _read(
        self, places: tuple[int, ...], most: int | None, converters: dict[int | str, Any]
    ) -> list[NDArray[np.float64]]:
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
                    converters=converters or None,
                    encoding="utf-8",
                )
        except (OSError, ValueError) as error:
            expected = "numbers in every row, separated alike"
            raise Sd2Error(f"{self._path} cannot be read ({error})", expected) from error
        return list(table.T.astype(np.float64))


class _Array(_Table):
    def __init__(self, path: Path, dataset: str | None) -> None:
        stored = open_stored(path, dataset)
        fields = stored.dtype.names or ()
        self._stored, self.names = stored, tuple(fields)
        dimensions = len(stored.shape) + bool(fields)
        self.width = len(fields) or (stored.shape[-1] if dimensions in (2, 3) else 0)
        if not (dimensions in (2, 3) and _FEWEST <= self.width <= _MAX):
            raise Sd2Error(f"{path} has shape {stored.shape}", _EXPECTED)
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
        there = np.ones(len(values), bool)
        if self._by_frame:
            there = np.asarray(values.any(axis=-1))
        return values[there], there

    def _frames(self) -> NDArray[np.float64]:
        return np.nonzero(self._whole[1])[0].astype(np.float64)

    def read(self, places: tuple[int, ...], most: int | None = None) -> list[NDArray[np.float64]]:
        rows = self._rows(most)
        return [np.ascontiguousarray(rows[:, place]) for place in places]


class _Vectors(_Table):
    """A vector for each column, all of the same length."""

    def __init__(self, path: Path, names: Sequence[str]) -> None:
        self._path, self.names, self.width = path, tuple(names), len(names)

    def read(self, places: tuple[int, ...], most: int | None = None) -> list[NDArray[np.float64]]:
        found = []
        for place in places:
            stored = open_stored(self._path, self.names[place])
            whole = np.asarray(stored.read(tuple(slice(None) for _ in stored.shape)))
            found.append(whole.ravel().astype(np.float64)[:most])
        if len({len(one) for one in found}) > 1:
            told = ", ".join(str(len(one)) for one in found)
            raise Sd2Error(f"{self._path} has columns of {told} entries", "as many in each")
        return found


def _opened(path: Path, dataset: str | None) -> _Table:
    if path.suffix.lower() in TEXT_SUFFIXES:
        return _Text(path)
    if path.suffix.lower() == MATLAB_SUFFIX and dataset is None:
        names = array_names(path)
        if _named(names) is not None:
            return _Vectors(path, names)
    return _Array(path, dataset)


# --- which column is what --------------------------------------------------------------------


def _recognised(table: _Table) -> tuple[tuple[str, ...], bool] | None:
    """Columns in order, and True if by their numbers; None where they are not known."""
    if table.names:
        named = _named(table.names, framed=table.frame is not None)
        return None if named is None else (named, False)
    guessed = _by_numbers(table)
    return None if guessed is None else (guessed, True)


def _named(titles: Sequence[str], *, framed: bool = False) -> tuple[str, ...] | None:
    """Columns by their titles, the first of several for the same."""
    plain = [_plain(title) for title in titles]
    found: dict[int, str] = {}
    for name, aliases in _NAMES.items():
        place = next((plain.index(one) for one in aliases if one in plain), None)
        if place is not None:
            if plain.count(plain[place]) > 1 and name in ("frame", "doppler"):
                return None  # which of them is meant?
            found[place] = name
    has = set(found.values())
    if "doppler" not in has or not (framed or has & {"frame", "time"}):
        return None
    if not has & {"x", "y", "range", "intensity"}:
        return None
    return tuple(found.get(place, _IGNORED) for place in range(len(titles)))


def _plain(title: str) -> str:
    """Letters of a title alone, without a unit."""
    words = re.findall(r"[a-z]+", re.sub(r"[\[(].*?[\])]", "", title.lower()))
    while len(words) > 1 and words[-1] in _UNITS:
        words.pop()
    return "".join(words)


def _unit_s(title: str) -> float | None:
    """Unit of times that a title names after the column, or in brackets."""
    words = re.findall(r"[a-zµ]+", title.lower())
    return UNITS_S.get(words[-1]) if len(words) > 1 else None


def _speed_mps(path: Path, title: str) -> float:
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


def _by_numbers(table: _Table) -> tuple[str, ...] | None:
    """Columns of an array without names, where nothing else is possible."""
    try:
        columns = table.read(tuple(range(table.width)), _LOOKED_AT)
    except Sd2Error:
        return None
    if not columns or len(columns[0]) < 20 or not all(np.isfinite(one).all() for one in columns):
        return None
    found: dict[int, str] = {}
    if table.frame is None:
        frames = [place for place, one in enumerate(columns) if _is_frame(one)]
        if len(frames) != 1:
            return None
        found[frames[0]] = "frame"
    moving = [
        place for place, one in enumerate(columns) if place not in found and doppler_step(one) > 0
    ]
    if len(moving) != 1:
        return None
    found[moving[0]] = "doppler"
    strong = [
        place
        for place, one in enumerate(columns)
        if place not in found and (one >= 0).all() and one.max() > _FASTEST_MPS
    ]
    if len(strong) == 1:
        found[strong[0]] = "intensity"
    return tuple(found.get(place, _IGNORED) for place in range(table.width))


def _is_frame(values: NDArray[np.float64]) -> bool:
    steps = np.diff(values)
    whole = (values == np.round(values)).all()
    return bool(whole and (steps >= 0).all() and 0 < (steps > 0).sum() < 0.8 * len(steps))


def doppler_step(velocities: NDArray[np.float64]) -> float:
    """Resolution of a radar of which velocities are multiples; 0 where they are not."""
    found = np.unique(np.round(velocities[:_LOOKED_AT], 3))
    if not (3 <= len(found) <= 257 and found[0] < 0 < found[-1]):
        return 0.0
    if len(found) > 0.3 * len(velocities) or np.abs(found).max() > _FASTEST_MPS:
        return 0.0
    step = float(np.diff(found).min())
    # Rounding of the file adds up over many steps: the largest multiple tells the step.
    step = float(np.abs(found).max() / round(np.abs(found).max() / step)) if step > 0 else 0.0
    if step < 0.01 or (np.abs(found / step - np.round(found / step)) > 0.1).any():
        return 0.0
    return round(step, 6)


def _unix_s(text: str) -> float:
    moment = np.datetime64(text.strip().strip('"').removesuffix("Z"), "us")
    return float(moment.astype(np.int64)) / 1e6


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
