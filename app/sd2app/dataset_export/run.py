"""A data set being written by a process that outlives the window."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from PySide6.QtCore import QObject

from sd2app.background.run_monitor import CommandRun
from sd2app.dataset_export.messages import Exported, Progressed, Refused, message_of


def user_exports_folder() -> Path:
    """Where exports under way are noted; it need not be there yet."""
    import platformdirs

    return Path(platformdirs.user_data_dir("sd2-studio", appauthor=False)) / "exports"


class ExportRun(CommandRun):
    """A run with how far it is, and what it has written.

    Parameters
    ----------
    path : Path
        Of the folder of the command, not of the data set.
    pid : int, optional
        Of the process that was just started for it.
    """

    def __init__(
        self, path: Path, parent: QObject | None = None, *, pid: int | None = None
    ) -> None:
        super().__init__(path, parent, pid=pid)
        self.done = self.total = 0
        self.written: Exported | None = None
        self.refused = ""

    @property
    def out(self) -> Path:
        """The data set."""
        return Path(str(self.about.get("out", "data set")))

    @property
    def choice(self) -> Mapping[str, Any]:
        """What it is to hold, as it was noted at the start."""
        choice = self.about.get("choice")
        return choice if isinstance(choice, dict) else {}

    def hear(self, events: Sequence[dict[str, Any]]) -> bool:
        """How far it is, what it has written, or why nothing."""
        messages = [message for event in events if (message := message_of(event)) is not None]
        for message in messages:
            if isinstance(message, Progressed):
                self.done, self.total = message.done, message.total
            elif isinstance(message, Exported):
                self.written = message
            elif isinstance(message, Refused):
                self.refused = message.text
        return bool(messages)
