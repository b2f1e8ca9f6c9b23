"""Numbers with units as text: ``2.5 m``, ``250cm``, ``30°``."""

from __future__ import annotations

import math
import re

from sd2core.errors import Sd2Error

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
