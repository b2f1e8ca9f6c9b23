"""Numbers as text: in lists, ``1, 2.5, 4`` and ``-60:60:30``; with units, ``250cm`` and ``30°``."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

from sd2core.errors import Sd2Error

_MAX = 10_000
_AS_RANGE = 3
"""Count of evenly spaced numbers from which a range is shorter."""


def parse_numbers(text: str) -> tuple[float, ...]:
    """Parse numbers and ranges ``from:to:step`` (both ends included), separated by commas.

    Raises Sd2Error for anything else, and for more than 10,000 numbers.
    """
    numbers: list[float] = []
    for part in text.replace("−", "-").split(","):
        words = part.split(":")
        try:
            values = [float(word) for word in words]
        except ValueError:
            values = []
        if len(values) not in (1, 3) or not all(math.isfinite(value) for value in values):
            raise Sd2Error(
                f"{part.strip()!r} is not a number", "numbers such as 1, 2.5 or -60:60:30"
            )
        numbers += values if len(values) == 1 else _range(part, *values)
    return tuple(numbers)


def parse_interval(text: str) -> tuple[float, float]:
    """Parse ``from:to``, or a single number, which is both; Sd2Error for anything else."""
    try:
        values = [float(word) for word in text.replace("−", "-").split(":")]
    except ValueError:
        values = []
    if len(values) not in (1, 2) or not all(math.isfinite(value) for value in values):
        raise Sd2Error(f"{text!r} is not an interval", "from:to, such as -60:60, or one number")
    return (values[0], values[-1])


def format_numbers(numbers: Sequence[float]) -> str:
    """Write numbers for :func:`parse_numbers`; evenly spaced ones as a range."""
    first, last = numbers[0], numbers[-1]
    step = (last - first) / (len(numbers) - 1) if len(numbers) > 1 else 0.0
    if len(numbers) >= _AS_RANGE and step:
        text = ":".join(map(_plain, (first, last, step)))
        try:
            if parse_numbers(text) == tuple(numbers):
                return text
        except Sd2Error:  # a step that no longer leads to the end once it is rounded
            pass
    return ", ".join(map(_plain, numbers))


def _range(part: str, first: float, last: float, step: float) -> list[float]:
    length = (last - first) / step if step else math.inf
    steps = round(length) if abs(length) < _MAX else -1
    if steps < 0 or abs(length - steps) > 1e-6:
        raise Sd2Error(
            f"{part.strip()!r} does not come to its end",
            f"a step that leads from {first:g} to {last:g}, in at most {_MAX} steps",
        )
    # Without the digits that only rounding brings in.
    return [round(first + number * step, 9) for number in range(steps)] + [last]


def _plain(value: float) -> str:
    return repr(int(value)) if value == int(value) and abs(value) < 1e15 else repr(value)


_KINDS: dict[str, tuple[str, str, dict[str, float]]] = {
    "m": (
        "a length",
        "metres such as 2.5, or 250 cm",
        {"m": 1.0, "cm": 0.01, "mm": 0.001, "km": 1000.0},
    ),
    "°": (
        "an angle",
        "degrees such as 30, or 0.5 rad",
        {"°": 1.0, "deg": 1.0, "degrees": 1.0, "rad": 180.0 / math.pi},
    ),
    "s": ("a time", "seconds such as 0.25, or 250 ms", {"s": 1.0, "ms": 0.001, "min": 60.0}),
}
"""By unit: the kind of quantity, examples, and the factors of the units that are understood."""
_NUMBER = re.compile(r"\s*([+-]?(?:\d+(?:[.,]\d*)?|[.,]\d+)(?:[eE][+-]?\d+)?)\s*(.*?)\s*")


def parse_quantity(text: str, unit: str) -> float:
    """Parse a number in a unit, or in another one of its kind.

    Raises Sd2Error for anything else than a finite number, with a unit of another kind among them.

    Examples
    --------
    >>> parse_quantity("250cm", "m"), parse_quantity("2,5", "m")
    (2.5, 2.5)
    """
    kind, examples, factors = _KINDS.get(unit, ("a number", "a number such as 2.5", {unit: 1.0}))
    match = _NUMBER.fullmatch(text.replace("−", "-"))
    if match is None or match[2] not in {"", *factors}:
        raise Sd2Error(f"“{text.strip()}” is not {kind}", examples)
    value = float(match[1].replace(",", ".")) * factors.get(match[2], 1.0)
    if not math.isfinite(value):
        raise Sd2Error(f"“{text.strip()}” is not {kind}", examples)
    # Without the digits that only the factor brings in.
    return float(f"{value:.12g}")
