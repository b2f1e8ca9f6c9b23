"""Lines that a training writes, taken one after another."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any, TypeVar

T = TypeVar("T")

Readers = Mapping[str, Callable[[T, dict[str, Any]], None]]
"""What takes a line, by the name of its event."""


def take_lines(target: T, readers: Readers[T], events: Iterable[dict[str, Any]]) -> bool:
    """Let ``target`` take lines; whether any of them was of use. What is damaged is left out."""
    taken = False
    for event in events:
        reader = readers.get(str(event.get("event")))
        if reader is None:
            continue
        try:
            reader(target, event)
        except (KeyError, TypeError, ValueError, OverflowError):
            continue
        taken = True
    return taken
