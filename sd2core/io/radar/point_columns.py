"""Columns of a table of points by their titles: what they hold, and in which unit."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from sd2core.errors import Sd2Error
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
