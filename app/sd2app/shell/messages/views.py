"""The messages of the window: as a notice, and as a list of all there were."""

from __future__ import annotations

from PySide6.QtWidgets import QDialogButtonBox, QPlainTextEdit, QWidget

from sd2app.background.latest import delayed
from sd2app.shell.messages.model import Message, MessagesModel
from sd2app.widgets.dialogs import Dialog, closing
from sd2app.widgets.layouts import column_of
from sd2app.widgets.notices import Notice
from sd2app.widgets.text import clock_text

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
