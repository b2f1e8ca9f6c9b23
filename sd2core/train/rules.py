"""Rules for settings: each in words, and as a check that names key and value."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from sd2core.errors import Sd2Error

Rule = Callable[[str, Any], Any]
"""``rule(key, value)`` gives the value as it is kept, or raises :class:`Sd2Error`."""

Allowed = tuple[str, Rule]
"""What is allowed in words, and the rule."""


def refused(key: str, value: Any, allowed: str) -> Sd2Error:
    """Error for a value that is not allowed."""
    return Sd2Error(f"{key} is {value!r}", allowed)


def number(low: float, high: float, *, whole: bool = False) -> Allowed:
    """A number between two others, both included."""
    kind = "a whole number" if whole else "a number"
    allowed = f"{kind} from {low:g} to {high:g}" if high < math.inf else f"{kind} from {low:g} on"

    def rule(key: str, value: Any) -> Any:
        fits = isinstance(value, int | float) and not isinstance(value, bool)
        if not fits or (whole and int(value) != value) or not low <= value <= high:
            raise refused(key, value, allowed)
        return int(value) if whole else float(value)

    return allowed, rule


def choice(*values: str) -> Allowed:
    """One of a few words."""
    allowed = f"one of {', '.join(values)}"

    def rule(key: str, value: Any) -> str:
        if value not in values:
            raise refused(key, value, allowed)
        return str(value)

    return allowed, rule


def flag() -> Allowed:
    """A flag: true or false."""

    def rule(key: str, value: Any) -> bool:
        if not isinstance(value, bool):
            raise refused(key, value, "true or false")
        return value

    return "true or false", rule


def text() -> Allowed:
    """Any text that is not empty."""

    def rule(key: str, value: Any) -> str:
        if not isinstance(value, str) or not value:
            raise refused(key, value, "a text")
        return value

    return "a text", rule


def texts() -> Allowed:
    """A list of texts."""

    def rule(key: str, value: Any) -> tuple[str, ...]:
        if not isinstance(value, list | tuple) or not all(isinstance(one, str) for one in value):
            raise refused(key, value, "a list of texts")
        return tuple(value)

    return "a list of texts", rule


def paths() -> Allowed:
    """At least one path."""

    def rule(key: str, value: Any) -> tuple[Path, ...]:
        fits = isinstance(value, list | tuple) and value
        if not fits or not all(isinstance(one, str | Path) and str(one) for one in value):
            raise refused(key, value, "a list of at least one path")
        return tuple(Path(one) for one in value)

    return "a list of at least one path", rule


def table() -> Allowed:
    """A flat table of plain values."""

    def rule(key: str, value: Any) -> dict[str, Any]:
        plain = isinstance(value, Mapping) and all(
            isinstance(one, bool | int | float | str) for one in value.values()
        )
        if not plain:
            raise refused(key, value, "a table of numbers, texts, true or false")
        return dict(value)

    return "a table of numbers, texts, true or false", rule
