"""Tables of an inertial sensor's samples as text: columns with units, found by their names.

A column is called by its quantity and axis, with the unit after it or in brackets: ``acc_x_mps2``,
``gyr_z (deg/s)``, ``Accelerometer X [g]``, ``time_s``, ``timestamp (ms)``.
"""

from __future__ import annotations

import math
import re
from array import array
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.files.limits import open_regular
from sd2core.files.texts import lines_of
from sd2core.imu.signals import InertialSignals

AccelerationUnit = Literal["m/s²", "g"]
TurnRateUnit = Literal["rad/s", "°/s"]

EXPECTED = (
    "a table of an inertial sensor: a heading with acc_x, acc_y, acc_z and gyr_x, gyr_y, gyr_z,"
    " then numbers"
)
STANDARD_GRAVITY_MPS2 = 9.80665
"""The unit g (CGPM 1901)."""

_UNITS: dict[str, dict[str, float]] = {
    "acc": {
        "m/s²": 1.0, "m/s2": 1.0, "m/s^2": 1.0, "mps2": 1.0, "ms-2": 1.0, "m/s/s": 1.0,
        "g": STANDARD_GRAVITY_MPS2, "mg": STANDARD_GRAVITY_MPS2 / 1000,
    },
    "gyr": {
        "rad/s": 1.0, "radps": 1.0, "rads": 1.0,
        "°/s": math.pi / 180, "deg/s": math.pi / 180, "degps": math.pi / 180, "dps": math.pi / 180,
    },
    "time": {"s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9},
}  # fmt: skip
_NAMES = {
    "acc": ("acc", "accel", "acceleration", "accelerometer", "a"),
    "gyr": ("gyr", "gyro", "gyroscope", "angular velocity", "turn rate", "omega", "w", "g"),
    "time": ("time", "timestamp", "t"),
}
_WORDS = {"acc": "accelerations", "gyr": "turn rates", "time": "times"}
_PARTS = re.compile(r"(?P<name>.*?)[\s_]*(?:[\[(](?P<unit>[^\])]*)[\])])?\s*")
_RATE = re.compile(rb"#\s*rate_hz\s*[:=]\s*(\S+)\s*")
_SLOWEST_HZ, _FASTEST_HZ = 0.5, 50_000.0
_LONGEST_HEADING = 10_000


@dataclass(frozen=True)
class _Column:
    """Column that a heading has."""

    number: int
    title: str
    quantity: str  # acc, gyr or time
    axis: str  # x, y, z, or empty
    unit: str  # empty if it is not stated


def read_table(
    path: Path,
    *,
    rate_hz: float | None = None,
    acceleration_unit: AccelerationUnit | None = None,
    turn_rate_unit: TurnRateUnit | None = None,
) -> InertialSignals:
    """Read a table of a real or virtual sensor: separated by commas, semicolons or tabs.

    Lines that begin with ``#`` are skipped; ``# rate_hz: 100`` among those before the heading
    stands for a column of times. An empty cell or NaN is a value that is not known.

    Parameters
    ----------
    path : Path
        Times are in the unit that their column states, otherwise in seconds.
    rate_hz : float, optional
        Samples per second of a table without times.
    acceleration_unit, turn_rate_unit : str, optional
        Of columns that do not state it.

    Raises
    ------
    Sd2Error
        When the file is no such table, a column or a unit is missing or there twice, a value is no
        number, or times do not increase or come at a rate that no sensor has.
    """
    given: dict[str, str] = {"acc": acceleration_unit or "", "gyr": turn_rate_unit or ""}
    with open_regular(path) as stream:
        rate_text, heading, lines = _heading(path, lines_of(stream))
        separator = max(",;\t", key=heading.count)
        titles = [_cell(title) for title in heading.split(separator)]
        columns = _columns_of(path, titles)
        factors = _factors(path, columns, given)
        values = _numbers(path, lines, separator, columns)  # (N, 6 or 7)
    with np.errstate(over="ignore"):  # what becomes infinite is refused
        values *= factors
    if values.shape[1] == 7:
        times_s = values[:, 6]
    else:
        rate_hz = _rate(path, rate_text) if rate_hz is None else rate_hz
        times_s = np.arange(len(values)) / _plausible(path, rate_hz)
    meta = {"source": path.name, "columns": [one.title for one in columns]}
    try:
        signals = InertialSignals(times_s, values[:, :3], values[:, 3:6], meta)
    except Sd2Error as error:
        raise error.within(path) from error
    if len(times_s) > 1:
        _plausible(path, signals.rate_hz)
    return signals


def _heading(path: Path, lines: Iterable[bytes]) -> tuple[str, str, Iterator[tuple[int, str]]]:
    """Rate that a comment states, the heading, and the numbered lines after it."""
    rate, numbered = "", _texts(path, lines)
    for _, line in numbered:
        if not line.startswith("#"):
            if len(line) > _LONGEST_HEADING:
                break
            return rate, line, (one for one in numbered if not one[1].startswith("#"))
        if found := _RATE.fullmatch(line.encode()):
            rate = found[1].decode()
    raise Sd2Error(f"{path} has no heading", EXPECTED, "Name the columns in the first line")


def _texts(path: Path, lines: Iterable[bytes]) -> Iterator[tuple[int, str]]:
    """Lines that are not empty, with their numbers."""
    for number, line in enumerate(lines, start=1):
        try:
            text = line.decode("utf-8-sig" if number == 1 else "utf-8").strip()
        except UnicodeDecodeError:
            text = "\0"
        if "\0" in text:
            raise Sd2Error(f"{path}: line {number} is no text in UTF-8", EXPECTED)
        if text:
            yield number, text


def _columns_of(path: Path, titles: Sequence[str]) -> list[_Column]:
    found: dict[tuple[str, str], _Column] = {}
    for number, title in enumerate(titles):
        column = _column(number, title)
        if column is None:
            continue
        before = found.setdefault((column.quantity, column.axis), column)
        if before is not column:
            raise Sd2Error(
                f"{path} has two columns {column.quantity} {column.axis}".rstrip()
                + f": {before.title!r} and {title!r}",
                "one sensor per file",
                "Leave the other columns out",
            )
    wanted = [(quantity, axis) for quantity in ("acc", "gyr") for axis in "xyz"]
    missing = [f"{quantity}_{axis}" for quantity, axis in wanted if (quantity, axis) not in found]
    if missing:
        shown = ", ".join(titles)[:200]
        raise Sd2Error(
            f"{path} has no column {', '.join(missing)}; its heading is {shown!r}",
            EXPECTED,
            "Name the columns so",
        )
    time = found.get(("time", ""))
    return [found[one] for one in wanted] + ([time] if time else [])


def _column(number: int, title: str) -> _Column | None:
    """Quantity, axis and unit that a title states; None for a column of something else."""
    parts = _PARTS.fullmatch(title)
    assert parts is not None
    words = [word for word in re.split(r"[\s_.\-:]+", parts["name"].lower()) if word]
    unit = (parts["unit"] or "").strip().lower().replace("⁻²", "-2").replace("μ", "µ")
    units = {name for table in _UNITS.values() for name in table}
    if not unit and len(words) > 1 and words[-1] in units:
        unit = words.pop()
    name = " ".join(words)
    for quantity, names in _NAMES.items():
        for one in names:
            if quantity == "time":
                if name == one:
                    return _Column(number, title, quantity, "", unit)
            elif name in {f"{one}{gap}{axis}" for gap in ("", " ") for axis in "xyz"}:
                return _Column(number, title, quantity, name[-1], unit)
    return None


def _factors(path: Path, columns: list[_Column], given: dict[str, str]) -> NDArray[np.float64]:
    """Factors that make m/s², rad/s and s of the columns' values."""
    factors = []
    for column in columns:
        known = _UNITS[column.quantity]
        unit = column.unit or given.get(column.quantity, "s")
        if unit not in known:
            stated = f"the unit {unit!r}" if unit else "no unit"
            raise Sd2Error(
                f"{path}: the column {column.title!r} has {stated}",
                f"{_WORDS[column.quantity]} in {', '.join(known)}",
                f"State it in the heading, such as {f'{column.quantity} {column.axis}'.strip()}"
                f" ({next(iter(known))})",
            )
        factors.append(known[unit])
    return np.array(factors)


def _cell(text: str) -> str:
    return text.strip().strip('"')


def _numbers(
    path: Path, lines: Iterable[tuple[int, str]], separator: str, columns: list[_Column]
) -> NDArray[np.float64]:
    """Values of the columns, (N, columns)."""
    values, last = array("d"), max(one.number for one in columns)
    for number, line in lines:
        cells = line.split(separator)
        if len(cells) <= last:
            raise Sd2Error(
                f"{path}: line {number} has {len(cells)} cells",
                f"{last + 1} at least, as the heading says",
                "Copy the file again, or delete that line",
            )
        for column in columns:
            text = _cell(cells[column.number])
            try:
                values.append(float(text) if text else math.nan)
            except ValueError:
                raise Sd2Error(
                    f"{path}: {column.title} of line {number} is {text[:40]!r}", "a number"
                ) from None
    if not values:
        raise Sd2Error(f"{path} has a heading and no rows", "one at least")
    return np.array(values).reshape(-1, len(columns))


def _rate(path: Path, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        stated = f"the rate {text[:40]!r}" if text else "neither times nor a rate"
        raise Sd2Error(
            f"{path} has {stated}",
            "a column time_s, or the line `# rate_hz: 100` before the heading",
        ) from None


def _plausible(path: Path, rate_hz: float) -> float:
    if not _SLOWEST_HZ <= rate_hz <= _FASTEST_HZ:
        raise Sd2Error(
            f"{path} has {rate_hz:.4g} samples per second",
            f"{_SLOWEST_HZ:g} to {_FASTEST_HZ:,.0f}",
            "State the unit of the times: time (ms), for example",
        )
    return rate_hz
