"""Kinds of values: what is allowed, and how they are typed and written."""

from __future__ import annotations

import math
import re
from argparse import ArgumentTypeError
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

from sd2core.options.bounds import (
    AZIMUTH_DEG,
    COUNT,
    ELEVATION_DEG,
    NATURAL,
    NOT_NEGATIVE,
    POSITIVE,
    RANGE_M,
    SHARE,
    Bounds,
)


class Typed(NamedTuple):
    """How a value is read from what was typed, and written as it would be typed."""

    read: Callable[[str], Any]
    write: Callable[[Any], str] = str


class Filled:
    """Of a text or path in a plan: it is not blank."""

    def __get_pydantic_core_schema__(self, kind: Any, handler: Any) -> Any:
        """Check a field of a plan; pydantic asks for it."""
        from pydantic_core import PydanticCustomError, core_schema

        def check(value: Any) -> Any:
            if not str(value).strip():
                raise PydanticCustomError("blank", "a text that is not blank")
            return value

        return core_schema.no_info_before_validator_function(check, handler(kind))


FILLED = Filled()


def number_reader(bounds: Bounds) -> Callable[[str], Any]:
    """Make a reader of numbers within bounds."""

    def read(text: str) -> float:
        value = _numbers(text, single=True)[0]
        if value not in bounds:
            raise ArgumentTypeError(f"{text!r} is not {bounds.words}")
        return int(value) if bounds.whole else value

    return read


def vector(text: str) -> tuple[float, float, float]:
    """Read ``X,Y,Z`` of any unit."""
    values = _numbers(text)
    if len(values) != 3:
        raise ArgumentTypeError(f"{text!r} is not X,Y,Z, e.g. -1,0,2.5")
    return values[0], values[1], values[2]


def image_size(text: str) -> tuple[int, int]:
    """Read ``WxH`` in pixels."""
    match = re.fullmatch(r"([1-9]\d*)x([1-9]\d*)", text)
    if match is None:
        raise ArgumentTypeError(f"{text!r} is not a size in pixels, e.g. 640x480")
    return int(match[1]), int(match[2])


def span_m(text: str) -> tuple[float, float]:
    """Read ``LO,HI`` in metres."""
    values = _numbers(text)
    if len(values) != 2 or not 0 <= values[0] < values[1]:
        raise ArgumentTypeError(f"{text!r} is not LO,HI in metres, e.g. 0.5,4")
    return values[0], values[1]


def around(text: str) -> tuple[float, float, float]:
    """Read ``RANGE,AZIMUTH`` or ``RANGE,AZIMUTH,ELEVATION`` in metres and degrees."""
    values = _numbers(text)
    bounds = (RANGE_M, AZIMUTH_DEG, ELEVATION_DEG)
    if not 2 <= len(values) <= 3 or any(map(lambda one, within: one not in within, values, bounds)):
        raise ArgumentTypeError(
            f"{text!r} is not RANGE,AZIMUTH[,ELEVATION] in metres and degrees, e.g. 2.2,-15"
        )
    return values[0], values[1], values[2] if len(values) == 3 else 0.0


def name_list(text: str) -> tuple[str, ...]:
    """Read ``anna,ben`` or ``none``."""
    if text == "none":
        return ()
    return tuple(name.strip() for name in text.split(",") if name.strip())


def word_list(text: str) -> tuple[str, ...]:
    """Read ``anna,anna,ben``: words that each stand for something, in this order."""
    return tuple(word.strip() for word in text.split(","))


def bin_list(text: str) -> tuple[int, ...]:
    """Read ``14,15,16`` or ``none``."""
    if text == "none":
        return ()
    try:
        return tuple(int(part) for part in text.split(","))
    except ValueError:
        raise ArgumentTypeError(
            f"{text!r} is neither bin numbers such as 14,15,16 nor none"
        ) from None


def share(text: str) -> float:
    """Read a share above 0 and up to 1, as ``2%`` or ``0.02``."""
    try:
        value = float(text.removesuffix("%")) / (100 if text.endswith("%") else 1)
    except ValueError:
        value = math.nan
    if value not in SHARE:
        raise ArgumentTypeError(f"{text!r} is not a share above 0 and up to 100%, e.g. 2% or 0.02")
    return value


def assignment(text: str) -> tuple[str, Any]:
    """Read ``NAME=VALUE``."""
    name, sign, value = text.partition("=")
    if not name or not sign or not value:
        raise ArgumentTypeError(f"{text!r} is not NAME=VALUE, e.g. channels=64")
    if value in ("true", "false"):
        return name, value == "true"
    for kind in (int, float):
        try:
            return name, kind(value)
        except ValueError:
            continue
    return name, value


def assigned(pair: tuple[str, Any]) -> str:
    """Write ``NAME=VALUE``."""
    name, value = pair
    return f"{name}={str(value).lower() if isinstance(value, bool) else value}"


def joined(values: tuple[Any, ...]) -> str:
    """Write a list, separated by commas."""
    return ",".join(map(str, values)) or "none"


def _numbers(text: str, *, single: bool = False) -> list[float]:
    parts = [text] if single else text.split(",")
    try:
        values = [float(part) for part in parts]
    except ValueError:
        values = [math.nan]
    if not all(math.isfinite(value) for value in values):
        raise ArgumentTypeError(f"{text!r} is not a number" + ("" if single else " list"))
    return values


MapKind = Literal["synthetic", "simulated", "real", "denoised"]
"""synthetic: counted from a mesh; simulated: a computed radar signal; real: a capture."""

Text = Annotated[str, FILLED]
Count = Annotated[int, COUNT]
Natural = Annotated[int, NATURAL]
Positive = Annotated[float, POSITIVE]
NotNegative = Annotated[float, NOT_NEGATIVE]
Share = Annotated[float, SHARE, Typed(share)]
Around = Annotated[tuple[float, float, float], Typed(around, joined)]
Vector = Annotated[tuple[float, float, float], Typed(vector, joined)]
SpanM = Annotated[tuple[float, float], Typed(span_m, joined)]
ImageSize = Annotated[tuple[int, int], Typed(image_size, lambda size: f"{size[0]}x{size[1]}")]
Names = Annotated[tuple[str, ...], Typed(name_list, joined)]
Words = Annotated[tuple[str, ...], Typed(word_list, joined)]
Bins = Annotated[tuple[int, ...], Typed(bin_list, joined)]
Paths = Annotated[tuple[Path, ...], Typed(Path)]
Assignment = Annotated[tuple[str, Any], Typed(assignment, assigned)]

DemoScene = Literal["one", "two"]
"""Sample recordings by their people: one who swipes, bundled; two, made when asked for."""
