"""Columns of an inertial sensor's table by their titles, and files that look like one.

A column is called by its quantity and axis, with the unit after it or in brackets: ``acc_x_mps2``,
``gyr_z (deg/s)``, ``Accelerometer X [g]``, ``time_s``, ``timestamp (ms)``.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from sd2core.errors import Sd2Error
from sd2core.files.limits import open_regular
from sd2core.files.numpy_files import npz_names
from sd2core.plausibility.clock import UNITS_S

STANDARD_GRAVITY_MPS2 = 9.80665
"""The unit g (CGPM 1901)."""

UNITS: dict[str, dict[str, float]] = {
    "acc": {
        "m/s²": 1.0, "m/s2": 1.0, "m/s^2": 1.0, "mps2": 1.0, "ms-2": 1.0, "m/s/s": 1.0,
        "g": STANDARD_GRAVITY_MPS2, "mg": STANDARD_GRAVITY_MPS2 / 1000,
    },
    "gyr": {
        "rad/s": 1.0, "radps": 1.0, "rads": 1.0,
        "°/s": math.pi / 180, "deg/s": math.pi / 180, "degps": math.pi / 180, "dps": math.pi / 180,
        "mdps": math.pi / 180_000,
    },
    "time": UNITS_S,
}  # fmt: skip
"""Factors from a column's unit to m/s², rad/s and s."""
AXES = tuple((quantity, axis) for quantity in ("acc", "gyr") for axis in "xyz")
"""Quantity and axis of the columns that every table has."""

_NAMES = {
    "acc": ("acc", "accel", "acceleration", "accelerometer", "a"),
    "gyr": ("gyr", "gyro", "gyroscope", "angular velocity", "turn rate", "omega", "w", "g"),
    "time": ("time", "timestamp", "t"),
}
_PARTS = re.compile(r"(?P<name>.*?)[\s_]*(?:[\[(](?P<unit>[^\])]*)[\])])?\s*")
_LONGEST_TITLE = 100
_LOOKED_AT_BYTES = 1 << 16
_MEMBERS = {"acceleration_mps2", "turn_rate_radps"}


@dataclass(frozen=True)
class Column:
    """Column that a heading has."""

    number: int
    title: str
    quantity: str  # acc, gyr or time
    axis: str  # x, y, z, or empty
    unit: str  # empty if it is not stated


def titles_of(heading: str) -> tuple[str | None, list[str]]:
    """Separator of a heading, None where it is spaces, and the titles between."""
    heading = heading.rstrip()  # a tab at its end begins no column
    separator = max(",;\t", key=heading.count)
    if separator not in heading:
        return None, [cell_text(title) for title in heading.split()]
    return separator, [cell_text(title) for title in heading.split(separator)]


def cell_text(text: str) -> str:
    """Text of a cell without what is around it."""
    return text.strip().strip('"')


def column_of(number: int, title: str) -> Column | None:
    """Quantity, axis and unit that a title states; None for a column of something else."""
    parts = _PARTS.fullmatch(title) if len(title) <= _LONGEST_TITLE else None
    if parts is None:
        return None
    words = [word for word in re.split(r"[\s_.\-:]+", parts["name"].lower()) if word]
    unit = (parts["unit"] or "").strip().lower()
    for theirs, ours in (("⁻²", "-2"), ("μ", "µ"), ("/sec", "/s")):
        unit = unit.replace(theirs, ours)
    units = {name for table in UNITS.values() for name in table}
    if not unit and len(words) > 1 and words[-1] in units:
        unit = words.pop()
    name = " ".join(words)
    for quantity, names in _NAMES.items():
        for one in names:
            if quantity == "time":
                if name == one:
                    return Column(number, title, quantity, "", unit)
            elif name in {f"{one}{gap}{axis}" for gap in ("", " ") for axis in "xyz"}:
                return Column(number, title, quantity, name[-1], unit)
    return None


def holds_inertial_signals(path: Path) -> bool:
    """True if a file looks like samples of an inertial sensor by its heading; reads little.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     wrist, labels = Path(folder, "wrist.csv"), Path(folder, "labels.csv")
    ...     _ = wrist.write_text("t,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps")
    ...     _ = labels.write_text("start_s,end_s,label")
    ...     holds_inertial_signals(wrist), holds_inertial_signals(labels)
    (True, False)
    """
    suffix = path.suffix.lower()
    if suffix == ".npz":
        return npz_names(path) >= _MEMBERS
    if suffix not in (".csv", ".sto"):
        return False
    try:
        with open_regular(path) as stream:
            text = stream.read(_LOOKED_AT_BYTES).decode("utf-8-sig", errors="replace")
    except (OSError, Sd2Error):
        return False
    lines = [line.strip() for line in text.splitlines()]
    return _is_table(lines) if suffix == ".csv" else _is_sto(lines)


def _is_table(lines: Sequence[str]) -> bool:
    heading = next((line for line in lines if line and not line.startswith("#")), "")
    columns = [column_of(number, title) for number, title in enumerate(titles_of(heading)[1])]
    return {*AXES} <= {(one.quantity, one.axis) for one in columns if one is not None}


def _is_sto(lines: Sequence[str]) -> bool:
    if "endheader" not in lines:
        return False
    titles = lines[lines.index("endheader") + 1 :][:1]
    return "DataType=Vec3" in lines and any("_accelerometer" in title for title in titles)
