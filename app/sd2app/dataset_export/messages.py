"""What ``sd2 export --progress-json`` says, line by line; see ``docs/formats.md``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class Progressed:
    """``done`` of ``total``; 0 of 0 while the preview sheet is drawn."""

    done: int
    total: int


@dataclass(frozen=True)
class Exported:
    """The data set is written.

    Parameters
    ----------
    path, card, sheet : Path
    segments, sources : int
    left_out : tuple of str
        Sources that could not be made, each with its reason.
    """

    path: Path
    card: Path
    sheet: Path
    segments: int
    sources: int
    left_out: tuple[str, ...] = ()


@dataclass(frozen=True)
class Refused:
    """A sentence on what is wrong."""

    text: str


Message = Progressed | Exported | Refused


def message_of(told: Mapping[str, Any]) -> Message | None:
    """Read a line; None for one that says nothing that is known."""
    try:
        event = told["event"]
        if event == "progress":
            return Progressed(int(told["done"]), int(told["total"]))
        if event == "error":
            return Refused(str(told["text"]))
        if event == "done":
            return Exported(
                Path(told["dataset"]),
                Path(told["card"]),
                Path(told["sheet"]),
                int(told["segments"]),
                int(told["sources"]),
                tuple(map(str, told["failed"])),
            )
    except (ValueError, KeyError, TypeError):
        return None
    return None
