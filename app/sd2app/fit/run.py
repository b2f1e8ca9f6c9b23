"""Monitor of one fit in a background process."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject

from sd2app.background.run_command import CommandFolder
from sd2app.background.run_monitor import RunMonitor
from sd2app.fit.progress import (
    FitProgress,
    Found,
    Noted,
    Progressed,
    Refused,
    Started,
    message_of,
)
from sd2core.processes import ProcessId

_POLL_MS = 100
_PATIENCE_S = 3.0


class FitRun(RunMonitor[CommandFolder]):
    """A fit with its progress, its notes and the landmarks that it adds to the given dict."""

    stop_patience_s = _PATIENCE_S

    def __init__(
        self,
        folder: CommandFolder,
        landmarks: dict[int, NDArray[np.float32]],
        parent: QObject | None = None,
        *,
        process: ProcessId | None = None,
    ) -> None:
        self.landmarks = landmarks
        self.progress = FitProgress()
        self.notes: list[str] = []
        self.started: Started | None = None
        self._refused = ""
        self._newest: int | None = None
        super().__init__(folder, parent, process=process, poll_ms=_POLL_MS)

    @property
    def error(self) -> str:
        """Sentence of the command on what is wrong."""
        return self._refused

    def take_newest(self) -> int | None:
        """Newest frame whose landmarks came since the last call."""
        newest, self._newest = self._newest, None
        return newest

    def on_events(self, events: Sequence[dict[str, Any]]) -> bool:
        """Read stages, counts, landmarks and notes."""
        messages = [message for event in events if (message := message_of(event)) is not None]
        for message in messages:
            match message:
                case Started():
                    self.started = message
                    self.progress.start(message)
                case Progressed():
                    self.progress.report(message)
                case Found():
                    self.landmarks[message.frame] = message.points
                    self._newest = message.frame
                case Noted() if message.text not in self.notes:
                    self.notes.append(message.text)
                case Refused():
                    self._refused = message.text
        return bool(messages)
