"""Check of a place in a process beside the window: what radar and camera see, as it comes."""

from __future__ import annotations

import base64
from typing import Any

from PySide6.QtCore import QObject, Signal
from PySide6.QtGui import QImage

from sd2app.live.process import SteeredCommand
from sd2app.live.setup import ListenRequest
from sd2core.live.checking import Answer
from sd2core.placements.placements import Place

CHECK_S = 60.0


class PlaceCheck(SteeredCommand):
    """``sd2 record --check`` beside the window."""

    pictured = Signal(QImage)

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self.findings: tuple[Answer, ...] = ()
        self.place: Place | None = None  # of a radar beside the camera, as seen from what moves
        self.left_s = 0

    def start(self, request: ListenRequest) -> None:
        """Watch both for a minute."""
        if not self.busy:
            self.findings, self.place, self.left_s = (), None, round(CHECK_S)
            self._launch(request.check_words(CHECK_S))

    def _take(self, event: dict[str, Any]) -> None:
        match event["event"]:
            case "preview":
                self.pictured.emit(QImage.fromData(base64.b64decode(event["picture"])))
            case "findings":
                self.findings = tuple(Answer(**one) for one in event["findings"])
                self.place = None if event["place"] is None else Place(**event["place"])
                self.left_s = event["left_s"]
                if self.state == "starting":
                    self._set_state("running")

    def _end(self, code: int, said: str) -> None:
        # The exit code tells bad findings, too.
        super()._end(code if self.left_s else 0, said)
