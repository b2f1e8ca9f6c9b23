"""Commands that record, or watch a place, in a process beside the window."""

from __future__ import annotations

import base64
import contextlib
import json
import sys
from collections.abc import Sequence
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, QProcess, QProcessEnvironment, Signal
from PySide6.QtGui import QImage

from sd2app.background.latest import ClosingModel
from sd2app.live.setup import ListenRequest
from sd2core.live.checking import Answer
from sd2core.placements.placements import Place
from sd2core.processes import ONE_THREAD

COMMAND = (sys.executable, "-m", "sd2core.cli")
CHECK_S = 60.0
State = Literal["idle", "opening", "starting", "running", "stopping", "stopped", "failed"]

_STOP_MS = 10_000
"""By then, all that waited to be stored is stored, or never will be."""


class SteeredCommand(ClosingModel):
    """A command that tells lines of JSON, and is steered by keys as on a terminal.

    A subclass takes its events.
    """

    changed = Signal()
    state_changed = Signal()
    warned = Signal(str)

    first_event: ClassVar[str]
    """With it the command has begun its work."""

    def __init__(self, parent: QObject, command: Sequence[str] = COMMAND) -> None:
        super().__init__(parent)
        self._command = list(command)
        self._process: QProcess | None = None
        self.state: State = "idle"
        self.text = ""  # why it failed
        self.request: ListenRequest | None = None

    @property
    def busy(self) -> bool:
        """True until it has ended."""
        return self.state in ("opening", "starting", "running", "stopping")

    def press(self, key: str) -> None:
        """Press a key, as on a terminal."""
        if self._process is not None and self.state == "running":
            self._process.write(key.encode())

    def stop(self) -> None:
        """End it; what is stored is kept."""
        if self._process is not None and self.state != "stopping":
            self._press_stop(self._process)
            self._set_state("stopping")

    def close(self) -> None:
        """End it with what shows it, and wait until all that was received is stored."""
        super().close()
        if (process := self._process) is not None:
            process.blockSignals(True)
            self._press_stop(process)
            if not process.waitForFinished(_STOP_MS):
                process.kill()
                process.waitForFinished(_STOP_MS)
            self._process, self.state = None, "stopped"

    def _launch(self, words: Sequence[str]) -> None:
        self.text = ""
        self._process = process = QProcess(self)
        environment = QProcessEnvironment.systemEnvironment()
        for name, value in {**ONE_THREAD, "PYTHONIOENCODING": "utf-8"}.items():
            environment.insert(name, value)
        process.setProcessEnvironment(environment)
        process.readyReadStandardOutput.connect(self._read)
        process.finished.connect(self._finish)
        process.errorOccurred.connect(self._fail_to_start)
        self._set_state("starting")
        program, *first = self._command
        process.start(program, [*first, *words])

    def _press_stop(self, process: QProcess) -> None:
        process.write(b"q")
        process.closeWriteChannel()

    def _read(self) -> None:
        process = self._process
        while process is not None and process.canReadLine():
            # A line that another program wrote, or half of one, is left out.
            with contextlib.suppress(ValueError, KeyError, TypeError):
                event = json.loads(bytes(process.readLine().data()))
                self._take(event)
                if event["event"] == self.first_event and self.state == "starting":
                    self._set_state("running")
        self._taken()

    def _finish(self, code: int) -> None:
        self._read()
        if self._process is not None:
            said = bytes(self._process.readAllStandardError().data())
            self._end(code, said.decode("utf-8", "replace"))

    def _fail_to_start(self, error: QProcess.ProcessError) -> None:
        if error == QProcess.ProcessError.FailedToStart and self._process is not None:
            why = self._process.errorString()
            self._end(1, f"{self._command[0]} cannot be started: {why}")

    def _take(self, event: dict[str, Any]) -> None:
        raise NotImplementedError

    def _taken(self) -> None:
        """Follow the events that had come."""
        self.changed.emit()

    def _end(self, code: int, error_text: str) -> None:
        if self._process is not None:
            self._process.deleteLater()
            self._process = None
        silent = "It ended without saying why."
        self.text = (error_text.strip().removeprefix("sd2: ") or silent) if code else ""
        self._set_state("failed" if code else "stopped")

    def _set_state(self, state: State) -> None:
        if state != self.state:
            self.state = state
            self.state_changed.emit()
            self.changed.emit()


def picture_in(event: dict[str, Any]) -> NDArray[np.uint8]:
    """RGB picture (H, W, 3) that an event holds as JPEG."""
    image = QImage.fromData(base64.b64decode(event["picture"]))
    image = image.convertToFormat(QImage.Format.Format_RGB888)
    rows = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), -1)
    return rows[:, : 3 * image.width()].reshape(image.height(), image.width(), 3).copy()


class PlaceCheck(SteeredCommand):
    """``sd2 record --check`` beside the window."""

    first_event = "findings"

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self.findings: tuple[Answer, ...] = ()
        self.place: Place | None = None  # of a radar beside the camera, as seen from what moves
        self.left_s = 0
        self.picture: NDArray[np.uint8] | None = None  # newest of the camera, RGB (H, W, 3)

    def start(self, request: ListenRequest) -> None:
        """Watch both for a minute."""
        if not self.busy:
            self.findings, self.place, self.left_s = (), None, round(CHECK_S)
            self._launch(request.check_words(CHECK_S))

    def _take(self, event: dict[str, Any]) -> None:
        match event["event"]:
            case "preview":
                self.picture = picture_in(event)
            case "findings":
                self.findings = tuple(Answer(**one) for one in event["findings"])
                self.place = None if event["place"] is None else Place(**event["place"])
                self.left_s = event["left_s"]

    def _end(self, code: int, error_text: str) -> None:
        # The exit code tells bad findings, too.
        super()._end(code if self.left_s else 0, error_text)
