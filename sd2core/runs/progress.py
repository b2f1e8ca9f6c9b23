"""Progress of a run as JSON lines: written by its process, read by all who follow it.

``docs/formats.md`` says what the lines mean. Lines are only ever appended, so that
a reader misses none; a run that is resumed says from where, and :func:`effective` drops what
that makes void.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

from sd2core.errors import Sd2Error
from sd2core.files.limits import open_regular
from sd2core.files.texts import parse_json, whole_lines

Event = dict[str, Any]


class ProgressWriter(AbstractContextManager["ProgressWriter"]):
    """Writer that appends lines to a file, made when missing, and flushes each.

    A last line that a kill tore off is ended first. ``watch`` is called with every line.
    """

    def __init__(self, path: Path, watch: Callable[[Event], None] | None = None) -> None:
        self._watch = watch
        torn = path.exists() and path.read_bytes()[-1:] not in (b"", b"\n")
        self._stream = path.open("a", encoding="utf-8")
        if torn:
            self._stream.write("\n")

    def say(self, event: str, **content: Any) -> None:
        """Write one line; numbers that are not finite become null."""
        line = {"event": event, **{key: _plain(value) for key, value in content.items()}}
        self._stream.write(json.dumps(line, ensure_ascii=False) + "\n")
        self._stream.flush()
        if self._watch is not None:
            self._watch(line)

    def __exit__(self, *_: object) -> None:
        self._stream.close()


class ProgressTail:
    """Reader of a file that grows; the file may not be there yet."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._offset = 0

    def new(self) -> list[Event]:
        """Whole lines since the last call; a line that is still being written comes later."""
        try:
            with open_regular(self._path) as stream:
                stream.seek(self._offset)
                events = [event for line in whole_lines(stream) if (event := _parsed(line))]
                self._offset = stream.tell()
        except (OSError, Sd2Error):  # not there yet, discarded, or no file
            return []
        return events


def read_events(path: Path) -> list[Event]:
    """Whole lines of a file; none where there is no file."""
    return ProgressTail(path).new()


def effective(events: Iterable[Event]) -> list[Event]:
    """Lines that count: those of steps that a resumed run did again are dropped.

    A kill loses the steps since the last checkpoint. They are done again, with the same
    result, and would be there twice.
    """
    kept: list[Event] = []
    for event in events:
        if event["event"] == "start" and event.get("resumed"):
            done = int(event.get("steps_done", 0))
            kept = [one for one in kept if not _undone(one, done)]
        kept.append(event)
    return kept


def last_of(events: Iterable[Event], kind: str) -> Event | None:
    """The last line of a kind."""
    return next((event for event in reversed([*events]) if event["event"] == kind), None)


def _undone(event: Event, done: int) -> bool:
    if event["event"] in ("end", "stopping", "paused", "resumed"):
        return True
    return event["event"] in ("step", "epoch") and int(event.get("step", 0)) > done


def _parsed(line: bytes) -> Event | None:
    if not line.endswith(b"\n"):  # a piece of what is no line
        return None
    try:
        event = parse_json(line.decode(errors="replace"), "The line", "an event")
    except Sd2Error:  # torn by a kill
        return None
    return event if isinstance(event, dict) and isinstance(event.get("event"), str) else None


def _plain(value: Any) -> Any:
    if isinstance(value, float):
        # Seven digits tell apart what single precision does.
        return float(f"{value:.7g}") if math.isfinite(value) else None
    return value
