"""Numbers in the texts of label files."""

from __future__ import annotations

import math

import numpy as np


def positional(value: float, *, min_digits: int | None = None) -> str:
    """Format the shortest decimal number, without an exponent, that reads back as the same."""
    return np.format_float_positional(value, unique=True, trim="0", min_digits=min_digits)


def finite_number(text: str) -> float | None:
    """Parse a number; None for a text that is none, or not a finite one."""
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def whole_number(text: str) -> int | None:
    """Parse a text of at most 18 digits; None for any other."""
    return int(text) if text.isascii() and text.isdigit() and len(text) <= 18 else None
