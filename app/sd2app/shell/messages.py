"""What the window tells the user, now and before."""

from __future__ import annotations

import re
import time
from dataclasses import dataclass

from PySide6.QtCore import QObject, Signal
from PySide6.QtWidgets import QDialogButtonBox, QPlainTextEdit, QWidget

from sd2app.background.latest import delayed
from sd2app.widgets.dialogs import Dialog, closing
from sd2app.widgets.layouts import column_of
from sd2app.widgets.notices import Notice
from sd2app.widgets.text import clock_text

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


_REMARK_MS, _FAILURE_MS = 12_000, 30_000
_MAX_LINES = 6
_NOTHING = "Nothing was said yet."


class MessageNotice(Notice):
    """Message on screen for a while: failures for longer, and not while nobody is there."""

    def __init__(self, messages: MessagesModel) -> None:
        super().__init__("Message", close=messages.dismiss)
        self._messages = messages
        self._timer = delayed(self._time_out, _REMARK_MS, self)
        messages.changed.connect(self._refresh)

    def _refresh(self) -> None:
        messages = self._messages
        lines, several = messages.lines, len(messages.lines) > 1 and messages.failed
        shown = list(lines[-_MAX_LINES:])
        if several:
            shown = [f"• {line}" for line in shown]
        if len(lines) > len(shown):
            shown.append(f"{len(lines) - len(shown)} more: View → Messages")
        head = f"{len(lines)} things went wrong" if several else ""
        before = self._words
        self.show_words(head, "\n".join(shown), "warning" if messages.failed else "plain")
        if self._words == before:
            return
        self._timer.stop()
        if lines:
            self._timer.start(_FAILURE_MS if messages.failed else _REMARK_MS)

    def _time_out(self) -> None:
        unread = self._messages.failed and not self.isActiveWindow()
        if unread or self.underMouse():
            self._timer.start()
        else:
            self._messages.dismiss()


class MessagesDialog(Dialog):
    """All messages since the window was opened, the newest first, to be read and copied."""

    def __init__(self, messages: MessagesModel, parent: QWidget) -> None:
        super().__init__("Messages", parent)
        self.resize(640, 420)
        self._messages = messages
        self.list = QPlainTextEdit(self)
        self.list.setReadOnly(True)
        self.list.setAccessibleName("Messages, the newest first")
        self.list.setPlaceholderText(_NOTHING)
        buttons = closing(self)
        clear = buttons.addButton("Clear", QDialogButtonBox.ButtonRole.ResetRole)
        clear.clicked.connect(messages.forget)
        clear.setAutoDefault(False)
        self.setLayout(column_of(self.list, buttons))
        messages.changed.connect(self._refresh)
        self._refresh()

    def _refresh(self) -> None:
        self.list.setPlainText("\n".join(map(_line, reversed(self._messages.history))))


def _line(message: Message) -> str:
    mark = "Failed: " if message.failed else ""
    return f"{clock_text(message.time_unix_s)}   {mark}{message.text}"
