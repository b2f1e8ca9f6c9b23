"""Progress of long work: a bar on a terminal, lines in a log."""

from __future__ import annotations

import sys
import time
from contextlib import AbstractContextManager
from typing import Any, TextIO

_EVERY_S = 5.0


class Lines(AbstractContextManager["Lines"]):
    """A bar of tqdm, as far as commands use one, as a line of text every few seconds.

    Of what is soon done there is none.
    """

    def __init__(self, what: str, unit: str, total: int | None) -> None:
        self.n = self.initial = 0
        self.unit, self.total = unit, total
        self._what, self._more = what, ""
        self._last_s = time.monotonic()

    def __exit__(self, *_: object) -> None:
        pass

    def update(self, steps: int) -> None:
        """Count some steps more."""
        self.n += steps
        self.refresh()

    def set_postfix_str(self, text: str) -> None:
        """Add words after the figures."""
        self._more = text
        self.refresh()

    def write(self, text: str, file: TextIO) -> None:
        """Print a line of its own."""
        print(text, file=file, flush=True)

    def refresh(self) -> None:
        """Print a line if the last is some seconds old."""
        now_s = time.monotonic()
        if now_s - self._last_s < _EVERY_S:
            return
        self._last_s = now_s
        units = self.unit if self.unit in ("B", "s") else f"{self.unit}s"
        words = f"{self._what}: {self.n:,} {units}"
        if self.total:
            counted = f"{self.n:,} of {self.total:,} {units}, " if self.unit else ""
            words = f"{self._what}: {counted}{100 * self.n // self.total} %"
        print(words + (f", {self._more}" if self._more else ""), file=sys.stderr, flush=True)


def bar(what: str, unit: str, total: int | None = None) -> AbstractContextManager[Any]:
    """Bar on standard error, or lines where that is no terminal."""
    if not sys.stderr.isatty():
        return Lines(what, unit, total)
    from tqdm import tqdm

    form = None if unit else "{l_bar}{bar}| [{elapsed}<{remaining}]"
    return tqdm(desc=what, unit=unit, total=total, file=sys.stderr, leave=False, bar_format=form)
