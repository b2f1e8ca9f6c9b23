"""Tables of an inertial sensor's samples as text: columns with units, found by their titles.

Titles are those of :mod:`sd2core.io.imu_columns`.
"""

from __future__ import annotations

import json
import math
import re
from array import array
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.files.limits import open_regular
from sd2core.files.texts import errors_in, lines_of
from sd2core.imu.signals import InertialSignals
from sd2core.io.imu_columns import AXES, UNITS, Column, cell_text, column_of, titles_of

EXPECTED = (
    "a table of an inertial sensor: a heading with acc_x, acc_y, acc_z and gyr_x, gyr_y, gyr_z,"
    " then numbers"
)
_WORDS = {"acc": "accelerations", "gyr": "turn rates", "time": "times"}
_FACT = re.compile(r"#\s*(\w{1,40})\s*[:=]\s*(.{1,1000})")
_SLOWEST_HZ, _FASTEST_HZ = 0.5, 50_000.0
_LONGEST_HEADING = 10_000
_MOST_FACTS = 200


def read_table(path: Path) -> InertialSignals:
    """Read a table of a real or virtual sensor: separated by commas, semicolons, tabs or spaces.

    Lines that begin with ``#`` are skipped; those before the heading of the form ``# name: value``
    are metadata, of which ``# rate_hz: 100`` stands for a column of times. An empty cell or NaN is
    a value that is not known. Times are in the unit that their column states, otherwise in seconds.

    Raises Sd2Error when the file is no such table, a column or a unit is missing or there twice, a
    value is no number, or times do not increase or come at a rate that no sensor has.
    """
    with open_regular(path) as stream:
        facts, heading, lines = _heading(path, lines_of(stream))
        separator, titles = titles_of(heading)
        columns = _columns_of(path, titles)
        factors = _factors(path, columns)
        values = _numbers(path, lines, separator, columns)  # (N, 6 or 7)
    with np.errstate(over="ignore"):  # what becomes infinite is refused
        values *= factors
    if values.shape[1] == 7:
        times_s = values[:, 6]
    else:
        rate_hz = _rate(path, facts.get("rate_hz", ""))
        times_s = np.arange(len(values)) / _plausible(path, rate_hz)
    meta = {"source": path.name, **meta_of(facts), "columns": [one.title for one in columns]}
    with errors_in(path, remedy=""):
        signals = InertialSignals(times_s, values[:, :3], values[:, 3:6], meta)
    if len(times_s) > 1:
        _plausible(path, signals.rate_hz)
    return signals


def meta_of(facts: Mapping[str, str]) -> dict[str, Any]:
    """Metadata of texts as :func:`text_of` writes them."""
    return {name: _value_of(text) for name, text in facts.items()}


def text_of(value: object) -> str:
    """A value of the metadata in one line, from which it can be read."""
    plain = isinstance(value, str) and isinstance(_value_of(value), str)
    return " ".join((str(value) if plain else json.dumps(value)).split())


def _value_of(text: str) -> Any:
    try:
        return json.loads(text)
    except (ValueError, RecursionError):
        return text


def _heading(
    path: Path, lines: Iterable[bytes]
) -> tuple[dict[str, str], str, Iterator[tuple[int, str]]]:
    """Facts that comments state, the heading, and the numbered lines after it."""
    facts, numbered = dict[str, str](), _texts(path, lines)
    for _, line in numbered:
        if not line.startswith("#"):
            if len(line) > _LONGEST_HEADING:
                break
            return facts, line, (one for one in numbered if not one[1].startswith("#"))
        if (match := _FACT.fullmatch(line)) and len(facts) < _MOST_FACTS:
            facts[match[1]] = match[2]
    raise Sd2Error(f"{path} has no heading", EXPECTED, "Name the columns in the first line")


def _texts(path: Path, lines: Iterable[bytes]) -> Iterator[tuple[int, str]]:
    """Lines that are not empty, with their numbers."""
    for number, line in enumerate(lines, start=1):
        try:
            # Not tabs, between which the first or last cell may be empty.
            text = line.decode("utf-8-sig" if number == 1 else "utf-8").strip(" \r\n")
        except UnicodeDecodeError:
            text = "\0"
        if "\0" in text:
            raise Sd2Error(f"{path}: line {number} is no text in UTF-8", EXPECTED)
        if bare := text.strip():
            yield number, bare if bare.startswith("#") else text


def _columns_of(path: Path, titles: Sequence[str]) -> list[Column]:
    columns: dict[tuple[str, str], Column] = {}
    for number, title in enumerate(titles):
        column = column_of(number, title)
        if column is None:
            continue
        before = columns.setdefault((column.quantity, column.axis), column)
        if before is not column:
            raise Sd2Error(
                f"{path} has two columns {column.quantity} {column.axis}".rstrip()
                + f": {before.title!r} and {title!r}",
                "one sensor per file",
                "Leave the other columns out",
            )
    missing = [f"{quantity}_{axis}" for quantity, axis in AXES if (quantity, axis) not in columns]
    if missing:
        shown = ", ".join(titles)[:200]
        raise Sd2Error(
            f"{path} has no column {', '.join(missing)}; its heading is {shown!r}",
            EXPECTED,
            "Name the columns so",
        )
    time = columns.get(("time", ""))
    return [columns[one] for one in AXES] + ([time] if time else [])


def _factors(path: Path, columns: list[Column]) -> NDArray[np.float64]:
    """Factors that make m/s², rad/s and s of the columns' values."""
    factors = []
    for column in columns:
        known = UNITS[column.quantity]
        unit = column.unit or ("s" if column.quantity == "time" else "")
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


def _numbers(
    path: Path, lines: Iterable[tuple[int, str]], separator: str | None, columns: list[Column]
) -> NDArray[np.float64]:
    """Values of the columns, (N, columns)."""
    values, last = array("d"), max(one.number for one in columns)
    for number, line in lines:
        if separator == ";":  # then decimal points may be commas
            line = line.replace(",", ".")
        cells = line.split(separator)
        if len(cells) <= last:
            raise Sd2Error(
                f"{path}: line {number} has {len(cells)} cells",
                f"{last + 1} at least, as the heading says",
                "Copy the file again, or delete that line",
            )
        for column in columns:
            text = cell_text(cells[column.number])
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
