"""What the window tells the user, now and before."""

from __future__ import annotations

import re
import time
from dataclasses import dataclass

from PySide6.QtCore import QObject, Signal

_KEPT = 500
_NUMBER = re.compile(r"\d+(?:[.,:]\d+)*")


@dataclass(frozen=True)
class Message:
    """Something that was said."""

    text: str
    failed: bool
    time_unix_s: float


class MessagesModel(QObject):
    """Failures that wait to be read, or the newest remark; and everything that was said.

    Failures stand together until they are dismissed, the newest last; of those that differ in
    numbers alone, the newest stands for all. A remark gives way to them.
    """

    changed = Signal()

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.lines: tuple[str, ...] = ()
        self.failed = False
        self.history: tuple[Message, ...] = ()  # the newest last

    @property
    def text(self) -> str:
        """Text to be read now; empty without any."""
        return "\n".join(self.lines)

    def warn(self, text: str) -> None:
        """Say that something went wrong."""
        kept: dict[str, str] = {}
        for line in (*(self.lines if self.failed else ()), *text.splitlines()):
            kind = _NUMBER.sub("#", line)
            kept.pop(kind, None)  # it comes again, as the newest
            kept[kind] = line
        self.lines = tuple(kept.values())
        self.failed = True
        self.keep(text, failed=True)

    def note(self, text: str) -> None:
        """Say that something was done; a failure that is still to be read stays."""
        if not (self.lines and self.failed):
            self.lines, self.failed = tuple(text.splitlines()), False
        self.keep(text)

    def keep(self, text: str, *, failed: bool = False) -> None:
        """Keep for the history what was said elsewhere."""
        self.history = (*self.history, Message(text, failed, time.time()))[-_KEPT:]
        self.changed.emit()

    def dismiss(self) -> None:
        """Take off the screen what is there; the history keeps it."""
        if self.lines:
            self.lines, self.failed = (), False
            self.changed.emit()

    def forget(self) -> None:
        """Empty the history."""
        self.history = ()
        self.changed.emit()
