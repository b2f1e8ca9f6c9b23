"""Check of a place in a process beside the window: what radar and camera see, as it comes."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from typing import Any, Literal

from PySide6.QtCore import QObject, Signal
from PySide6.QtGui import QImage

from sd2app.live.model import COMMAND
from sd2app.live.process import LiveProcess, why_it_ended
from sd2app.live.setup import ListenRequest
from sd2core.live.checking import Answer
from sd2core.placements.placements import Place

CHECK_S = 60.0


class PlaceCheck(QObject):
    """``sd2 record --check`` beside the window."""

    changed = Signal()
    pictured = Signal(QImage)

    def __init__(self, parent: QObject, command: Sequence[str] = COMMAND) -> None:
        super().__init__(parent)
        self._command = list(command)
        self._process: LiveProcess | None = None
        self.state: Literal["idle", "running", "stopping", "ended", "failed"] = "idle"
        self.findings: tuple[Answer, ...] = ()
        self.place: Place | None = None  # of a radar beside the camera, as seen from what moves
        self.left_s = 0
        self.text = ""  # why it failed

    @property
    def busy(self) -> bool:
        """True while radar and camera are watched."""
        return self.state in ("running", "stopping")

    def start(self, request: ListenRequest) -> None:
        """Watch both for a minute."""
        if self.busy:
            return
        self.findings, self.place, self.left_s, self.text = (), None, round(CHECK_S), ""
        command = [*self._command, *request.check_words(CHECK_S)]
        self._process = LiveProcess(command, self, self._take, self.changed.emit, self._end)
        self.state = "running"
        self.changed.emit()
        self._process.start()

    def stop(self) -> None:
        """Watch no longer; what was found stays."""
        if self._process is not None and self.state == "running":
            self.state = "stopping"
            self._process.stop()
            self.changed.emit()

    def close(self) -> None:
        """Let go of radar and camera at once."""
        if self._process is not None:
            self._process.close()
            self._process, self.state = None, "ended"

    def _take(self, event: dict[str, Any]) -> None:
        match event["event"]:
            case "preview":
                self.pictured.emit(QImage.fromData(base64.b64decode(event["picture"])))
            case "findings":
                self.findings = tuple(Answer(**one) for one in event["findings"])
                self.place = None if event["place"] is None else Place(**event["place"])
                self.left_s = event["left_s"]

    def _end(self, code: int, said: str) -> None:
        self._process = None
        # Bad findings are told by the exit code, too.
        self.state = "failed" if code and self.left_s else "ended"
        self.text = why_it_ended(said) if self.state == "failed" else ""
        self.changed.emit()
