"""Time that long work takes, from the pace of its own items.

Nothing is done only to be timed. A run takes its pace from its items, the first of which warms
up, and the pace is kept on this machine to estimate the next run of the same kind.
"""

from __future__ import annotations

import json
import platform
from pathlib import Path

from sd2core.errors import Sd2Error
from sd2core.files.atomic import keep_text
from sd2core.files.paths import user_cache
from sd2core.files.texts import read_json

Kind = tuple[str | int | None, ...]
"""What is done, with all that the time of an item depends on: ``("fit", "medium")``."""

_SHORT_S = 3.0
"""Shorter work is mostly overhead, and does not replace what longer work has measured."""

_MAX_KINDS = 200


class Throughput:
    """Seconds per item of work under way, counted from its first item on."""

    def __init__(self) -> None:
        self._first: tuple[float, float] | None = None
        self._items = self._seconds = 0.0

    def take(self, done: float, elapsed_s: float) -> None:
        """Note that so many items are done so long after the beginning."""
        if self._first is None:
            self._first = done, elapsed_s
        self._items, self._seconds = done - self._first[0], elapsed_s - self._first[1]

    @property
    def each_s(self) -> float | None:
        """Seconds per item; None until a second one is done."""
        if self._items <= 0 or self._seconds <= 0:
            return None
        return self._seconds / self._items

    def left_s(self, items: float) -> float | None:
        """Seconds that so many more items take; None until that can be told."""
        return None if self.each_s is None else self.each_s * items

    def keep(self, kind: Kind) -> None:
        """Keep the pace for the next run of this kind on this machine."""
        keep_pace(kind, self._seconds, self._items)


def fit_kind(resolution: str) -> Kind:
    """Kind of a fit of a body, whose items are frames."""
    return ("fit", resolution)


def known_pace_s(kind: Kind) -> float | None:
    """Seconds per item of the last run of this kind on this machine; None if there was none."""
    return _known().get(_name(kind), (None, 0.0))[0]


def keep_pace(kind: Kind, seconds: float, items: float) -> None:
    """Keep what a run has measured, where the user's cache can be written."""
    if seconds <= 0 or items <= 0:
        return
    name, known = _name(kind), _known()
    before = known.pop(name, (0.0, 0.0))
    now = float(f"{seconds / items:.4g}"), round(seconds, 3)
    known[name] = before if seconds < min(before[1], _SHORT_S) else now
    newest = dict(list(known.items())[-_MAX_KINDS:])
    keep_text(_path(), json.dumps(newest, indent=1) + "\n")


def _name(kind: Kind) -> str:
    return " ".join(map(str, kind))


def _known() -> dict[str, tuple[float, float]]:
    """Seconds per item, and those of the whole work, by kind."""
    try:
        content = read_json(_path())
        return {name: (float(each_s), float(all_s)) for name, (each_s, all_s) in content.items()}
    except (Sd2Error, ValueError, TypeError, AttributeError):  # none yet, or damaged
        return {}


def _path() -> Path:
    # A home folder may be shared by machines of different speed.
    return user_cache("pace") / f"{platform.node() or 'here'}.json"
