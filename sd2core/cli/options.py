"""Options and argument types that several subcommands share."""

from __future__ import annotations

import argparse
import math
import re
from collections.abc import Callable, Iterable
from typing import Any

from sd2core.options.bounds import Bounds


def add_json(parser: argparse._ActionsContainer) -> None:
    """Add ``--json``."""
    parser.add_argument(
        "--json", action="store_true", help="print JSON, for other programs; an error as well"
    )


def given(options: argparse.Namespace, names: Iterable[str]) -> dict[str, Any]:
    """Those of the named options that the command has and the user gave."""
    values = {name: getattr(options, name, None) for name in names}
    return {name: value for name, value in values.items() if value is not None}


def flag(name: str) -> str:
    """Option of a name as it is typed: ``--v-max`` of ``v_max``."""
    return f"--{name.replace('_', '-')}"


def position(text: str) -> tuple[float, float, float]:
    """Parse ``X,Y,Z`` in metres."""
    values = _numbers(text)
    if len(values) != 3:
        raise argparse.ArgumentTypeError(f"{text!r} is not X,Y,Z in metres, e.g. -1,0,2.5")
    return values[0], values[1], values[2]


def vector(text: str) -> tuple[float, float, float]:
    """Parse ``X,Y,Z`` of any unit."""
    values = _numbers(text)
    if len(values) != 3:
        raise argparse.ArgumentTypeError(f"{text!r} is not X,Y,Z, e.g. 0,-1,0")
    return values[0], values[1], values[2]


def image_size(text: str) -> tuple[int, int]:
    """Parse ``WxH`` in pixels."""
    match = re.fullmatch(r"([1-9]\d*)x([1-9]\d*)", text)
    if match is None:
        raise argparse.ArgumentTypeError(f"{text!r} is not a size in pixels, e.g. 640x480")
    return int(match[1]), int(match[2])


def span_m(text: str) -> tuple[float, float]:
    """Parse ``LO,HI`` in metres."""
    values = _numbers(text)
    if len(values) != 2 or not 0 <= values[0] < values[1]:
        raise argparse.ArgumentTypeError(f"{text!r} is not LO,HI in metres, e.g. 0.5,4")
    return values[0], values[1]


def name_list(text: str) -> tuple[str, ...]:
    """Parse ``anna,ben`` or ``none``."""
    if text == "none":
        return ()
    return tuple(name.strip() for name in text.split(",") if name.strip())


def bin_list(text: str) -> tuple[int, ...]:
    """Parse ``14,15,16`` or ``none``."""
    if text == "none":
        return ()
    try:
        return tuple(int(part) for part in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(
            f"{text!r} is neither bin numbers such as 14,15,16 nor none"
        ) from None


def positive_int(text: str) -> int:
    """Parse a whole number above 0."""
    try:
        value = int(text)
    except ValueError:
        value = 0
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number above 0")
    return value


def finite_float(text: str) -> float:
    """Parse a number."""
    return _numbers(text, single=True)[0]


def positive_float(text: str) -> float:
    """Parse a number above 0."""
    value = finite_float(text)
    if value <= 0:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number above 0")
    return value


def within(bounds: Bounds) -> Callable[[str], Any]:
    """Make a parser of a number within bounds."""

    def parse(text: str) -> float:
        value = finite_float(text)
        if value not in bounds:
            raise argparse.ArgumentTypeError(f"{text!r} is not {bounds.words}")
        return int(value) if bounds.whole else value

    return parse


def share(text: str) -> float:
    """Parse a share above 0 and up to 1, as ``2%`` or ``0.02``."""
    try:
        value = float(text.removesuffix("%")) / (100 if text.endswith("%") else 1)
    except ValueError:
        value = math.nan
    if not 0 < value <= 1:
        raise argparse.ArgumentTypeError(
            f"{text!r} is not a share above 0 and up to 100%, e.g. 2% or 0.02"
        )
    return value


def not_negative_float(text: str) -> float:
    """Parse a number from 0 on."""
    value = finite_float(text)
    if value < 0:
        raise argparse.ArgumentTypeError(f"{text!r} is below 0")
    return value


def _numbers(text: str, *, single: bool = False) -> list[float]:
    parts = [text] if single else text.split(",")
    try:
        values = [float(part) for part in parts]
    except ValueError:
        values = [math.nan]
    if not all(math.isfinite(value) for value in values):
        raise argparse.ArgumentTypeError(f"{text!r} is not a number" + ("" if single else " list"))
    return values
