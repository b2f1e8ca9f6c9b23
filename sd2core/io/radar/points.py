"""Point clouds of a radar as tables: a row per point with its frame, velocity, and what else.

Columns go by their names, in any order: text under a heading (``.csv``, ``.tsv``), NumPy
(``.npy`` with named fields) or MATLAB (``.mat``, a vector per column). Arrays without names,
(points, columns) or (frames, points, columns), are read where their numbers leave no doubt, else
as the description beside them says.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from sd2core.errors import Sd2Error
from sd2core.files.texts import faults_in, read_toml
from sd2core.io.radar.point_tables import (
    COLUMNS,
    EXPECTED,
    IGNORED,
    MAX_COLUMNS,
    MIN_COLUMNS,
    SUFFIXES,
    Table,
    TextTable,
    is_in_decibels,
    named_columns,
    open_table,
    speed_unit_mps,
    time_unit_s,
)
from sd2core.timebase import Timebase

COLUMNS_OPTION = "--columns frame,x,y,z,doppler,intensity (- for others)"
"""How the user names the columns, for messages."""
_LOOKED_AT = 20_000
_FASTEST_MPS = 30.0
_SHUFFLED = 0.1
"""Share of rows whose frame is before the last one's: beyond it they are in no order."""


class PointsDescription(BaseModel):
    """Description of a table of points, in the TOML beside it.

    ``columns`` name the columns in order, ``-`` one that is not needed. With ``sign`` 1 a positive
    velocity is that of a point whose distance grows, with -1 of one that comes nearer.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    format: Literal["sd2-radar"] = "sd2-radar"
    version: Literal[1] = 1
    columns: tuple[str, ...] = Field(min_length=2, max_length=MAX_COLUMNS)
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
    content = _description_beside(path)
    return described_points(path.with_suffix(".toml"), content) if "columns" in content else None


def described_points(place: Path, content: Mapping[str, Any]) -> PointsDescription:
    """Description of a table by what is told of it; Sd2Error where that is not possible."""
    with faults_in(place, "the description of a table of points"):
        description = PointsDescription.model_validate(dict(content))
    columns = description.columns
    named = [one for one in columns if one != IGNORED]
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
    content = _description_beside(path)
    try:
        return bool("columns" in content or (not content and _recognised(open_table(path, None))))
    except Sd2Error:
        return False


def holds_unnamed_columns(path: Path) -> bool:
    """True if a file is a table of numbers whose columns nothing names, perhaps of points."""
    if path.suffix.lower() not in SUFFIXES or _description_beside(path):
        return False
    try:
        table = open_table(path, None)
    except Sd2Error:
        return False
    return (
        not table.names and MIN_COLUMNS <= table.width <= MAX_COLUMNS and _recognised(table) is None
    )


def has_columns_told(path: Path) -> bool:
    """True if the description beside a file, right or wrong, is of a table of points."""
    return "columns" in _description_beside(path)


def _description_beside(path: Path) -> dict[str, Any]:
    """Content of the description of radar data beside a file; empty where there is none."""
    beside = path.with_suffix(".toml")
    if path.suffix.lower() not in SUFFIXES or not beside.is_file():
        return {}
    try:
        content = read_toml(beside, EXPECTED)
    except Sd2Error:
        return {}
    return content if content.get("format") == "sd2-radar" else {}


def read_points(path: Path, description: PointsDescription | None = None) -> RadarPoints:
    """Read a table.

    Raises Sd2Error if its columns are not known, or it holds what is no finite number.
    """
    table = open_table(path, description.dataset if description else None)
    columns, guessed = (description.columns, False) if description else _known(path, table)
    if len(columns) != table.width:
        raise Sd2Error(
            f"{path} has {table.width} columns, its description {len(columns)}", "as many"
        )
    places = {name: place for place, name in enumerate(columns) if name in COLUMNS}
    if table.by_frame:
        places["frame"] = table.width
    try:
        numbers = dict(zip(places, table.read(tuple(places.values())), strict=True))
    except Sd2Error:
        if "time" not in places or not isinstance(table, TextTable):
            raise
        numbers = _with_dates(table, places)
    finite = np.isfinite(numbers["doppler"])
    if not finite.all():
        row = int(np.flatnonzero(~finite)[0])
        raise Sd2Error(f"{path}: the velocity of row {row + 1} is no number", "a finite number")
    titles = {columns[place]: title for place, title in enumerate(table.names)}
    numbers["doppler"] *= speed_unit_mps(path, titles.get("doppler", ""))
    if is_in_decibels(titles.get("intensity", "")):
        with np.errstate(over="ignore"):
            numbers["intensity"] = 10.0 ** (0.1 * numbers["intensity"])
    unit_s = time_unit_s(titles.get("time", ""))
    return _sorted(path, numbers, columns, unit_s, guessed)


def _with_dates(table: TextTable, places: dict[str, int]) -> dict[str, NDArray[np.float64]]:
    """Columns of a table whose times are dates, or else are left out where frames are numbered."""
    try:
        read = table.read(tuple(places.values()), dated=places["time"])
    except Sd2Error:
        if "frame" not in places:
            raise
        del places["time"]
        read = table.read(tuple(places.values()))
    return dict(zip(places, read, strict=True))


def column_names(path: Path, dataset: str | None = None) -> tuple[str, ...]:
    """Columns of a table as far as they are known; Sd2Error where they are not, or it is none."""
    return _known(path, open_table(path, dataset))[0]


def _known(path: Path, table: Table) -> tuple[tuple[str, ...], bool]:
    """What :func:`_recognised` returns; Sd2Error where columns are not known."""
    if (recognised := _recognised(table)) is not None:
        return recognised
    held = ", ".join(table.names) if table.names else f"{table.width} columns without names"
    raise Sd2Error(
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
        moments, of_point = np.unique(time, return_inverse=True)
        finite = moments[np.isfinite(moments)]
        steps = np.diff(moments) / Timebase(finite if len(finite) else [0.0]).frame_duration_s
        # Frames without a point have no row; points without a time are in one more frame.
        passed = np.where(np.isfinite(steps), np.maximum(np.round(steps), 1.0), 1.0)
        numbers["frame"] = np.append(0.0, np.cumsum(passed))[of_point]
    frame = numbers["frame"]
    if not (np.isfinite(frame).all() and (frame == np.round(frame)).all()):
        raise Sd2Error(f"{path}: frames are numbered {frame[frame % 1 != 0][0]:g}", "whole numbers")
    if (np.diff(frame) < 0).sum() > _SHUFFLED * len(frame):
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


def _recognised(table: Table) -> tuple[tuple[str, ...], bool] | None:
    """Columns in order, and True if by their numbers; None where they are not known."""
    if table.names:
        named = named_columns(table.names, framed=table.by_frame)
        return None if named is None else (named, False)
    guessed = _by_numbers(table)
    return None if guessed is None else (guessed, True)


def _by_numbers(table: Table) -> tuple[str, ...] | None:
    """Columns of an array without names, where nothing else is possible."""
    try:
        columns = table.read(tuple(range(table.width)), _LOOKED_AT)
    except Sd2Error:
        return None
    if not columns or len(columns[0]) < 20 or not all(np.isfinite(one).all() for one in columns):
        return None
    names: dict[int, str] = {}
    if not table.by_frame:
        frames = [place for place, one in enumerate(columns) if _is_frame(one)]
        if len(frames) != 1:
            return None
        names[frames[0]] = "frame"
    moving = [
        place for place, one in enumerate(columns) if place not in names and doppler_step(one) > 0
    ]
    if len(moving) != 1:
        return None
    names[moving[0]] = "doppler"
    strong = [
        place
        for place, one in enumerate(columns)
        if place not in names and (one >= 0).all() and one.max() > _FASTEST_MPS
    ]
    if len(strong) == 1:
        names[strong[0]] = "intensity"
    return tuple(names.get(place, IGNORED) for place in range(table.width))


def _is_frame(values: NDArray[np.float64]) -> bool:
    steps = np.diff(values)
    whole = (values == np.round(values)).all()
    return bool(whole and (steps >= 0).all() and 0 < (steps > 0).sum() < 0.8 * len(steps))


def doppler_step(velocities: NDArray[np.float64]) -> float:
    """Resolution of a radar of which velocities are multiples; 0 where they are not."""
    distinct = np.unique(np.round(velocities[:_LOOKED_AT], 3))
    if not (3 <= len(distinct) <= 257 and distinct[0] < 0 < distinct[-1]):
        return 0.0
    if len(distinct) > 0.3 * len(velocities) or np.abs(distinct).max() > _FASTEST_MPS:
        return 0.0
    step = float(np.diff(distinct).min())
    # Rounding of the file adds up over many steps: the largest multiple tells the step.
    step = float(np.abs(distinct).max() / round(np.abs(distinct).max() / step)) if step > 0 else 0.0
    if step < 0.01 or (np.abs(distinct / step - np.round(distinct / step)) > 0.1).any():
        return 0.0
    return round(step, 6)
