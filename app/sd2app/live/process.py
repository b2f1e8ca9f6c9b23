"""Commands that record, or watch a place, in a process beside the window."""

from __future__ import annotations

import base64
import contextlib
import json
import sys
from collections.abc import Callable, Sequence
from typing import Any, Literal

from PySide6.QtCore import QObject, QProcess, QProcessEnvironment, Signal
from PySide6.QtGui import QImage

from sd2app.live.setup import ListenRequest
from sd2core.live.checking import Answer
from sd2core.placements.placements import Place
from sd2core.processes import ONE_THREAD

COMMAND = (sys.executable, "-m", "sd2core.cli")
State = Literal["idle", "starting", "running", "stopping", "ended", "failed"]

_STOP_MS = 10_000
"""By then, all that waited to be stored is stored, or never will be."""


class LiveProcess:
    """A process that tells lines of JSON, and is steered by keys as on a terminal.

    Parameters
    ----------
    command : sequence of str
        Program and words.
    parent : QObject
    take : callable
        Called with every event that it tells.
    taken : callable
        Called once those that had come were taken.
    ended : callable
        Called at the end with the exit status, and what was said on standard error.
    """

    def __init__(
        self,
        command: Sequence[str],
        parent: QObject,
        take: Callable[[dict[str, Any]], object],
        taken: Callable[[], object],
        ended: Callable[[int, str], object],
    ) -> None:
        self._command, self._take, self._taken, self._ended = command, take, taken, ended
        self._process = process = QProcess(parent)
        environment = QProcessEnvironment.systemEnvironment()
        for name, value in {**ONE_THREAD, "PYTHONIOENCODING": "utf-8"}.items():
            environment.insert(name, value)
        process.setProcessEnvironment(environment)
        process.readyReadStandardOutput.connect(self._read)
        process.finished.connect(self._end)
        process.errorOccurred.connect(self._fail_to_start)

    def start(self) -> None:
        """Begin."""
        program, *words = self._command
        self._process.start(program, words)

    def press(self, key: str) -> None:
        """Press a key."""
        self._process.write(key.encode())

    def stop(self) -> None:
        """Press the key that stops."""
        self.press("q")
        self._process.closeWriteChannel()

    def close(self) -> None:
        """Stop, and wait until all that was received is stored; nothing more is called."""
        self._process.blockSignals(True)
        self.stop()
        if not self._process.waitForFinished(_STOP_MS):
            self._process.kill()
            self._process.waitForFinished(_STOP_MS)

    def _read(self) -> None:
        while self._process.canReadLine():
            # A line that another program wrote, or half of one, is left out.
            with contextlib.suppress(ValueError, KeyError, TypeError):
                self._take(json.loads(bytes(self._process.readLine().data())))
        self._taken()

    def _end(self, code: int) -> None:
        self._read()
        error_text = bytes(self._process.readAllStandardError().data()).decode("utf-8", "replace")
        self._process.deleteLater()
        self._ended(code, error_text)

    def _fail_to_start(self, error: QProcess.ProcessError) -> None:
        if error == QProcess.ProcessError.FailedToStart:
            why = self._process.errorString()
            self._process.deleteLater()
            self._ended(1, f"{self._command[0]} cannot be started: {why}")


class SteeredCommand(QObject):
    """A command that records or watches, with its state; a subclass takes its events."""

    changed = Signal()
    state_changed = Signal()

    def __init__(self, parent: QObject, command: Sequence[str] = COMMAND) -> None:
        super().__init__(parent)
        self._command = list(command)
        self._process: LiveProcess | None = None
        self.state: State = "idle"
        self.text = ""  # why it failed

    @property
    def busy(self) -> bool:
        """True until it has ended."""
        return self.state in ("starting", "running", "stopping")

    def press(self, key: str) -> None:
        """Press a key, as on a terminal."""
        if self._process is not None and self.state == "running":
            self._process.press(key)

    def stop(self) -> None:
        """End it; what is stored is kept."""
        if self._process is not None and self.state != "stopping":
            self._process.stop()
            self._set_state("stopping")

    def close(self) -> None:
        """End it at once, with what shows it."""
        if self._process is not None:
            self._process.close()
            self._process, self.state = None, "ended"

    def _launch(self, words: Sequence[str]) -> None:
        self.text = ""
        command = [*self._command, *words]
        self._process = LiveProcess(command, self, self._take, self.changed.emit, self._end)
        self._set_state("starting")
        self._process.start()

    def _take(self, event: dict[str, Any]) -> None:
        raise NotImplementedError

    def _end(self, code: int, error_text: str) -> None:
        self._process = None
        self.text = why_it_ended(error_text) if code else ""
        self._set_state("failed" if code else "ended")

    def _set_state(self, state: State) -> None:
        self.state = state
        self.state_changed.emit()
        self.changed.emit()


def why_it_ended(error_text: str) -> str:
    """Reason of a failure, from what was said on standard error."""
    return error_text.strip().removeprefix("sd2: ") or "It ended without saying why."


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

    def _end(self, code: int, error_text: str) -> None:
        # The exit code tells bad findings, too.
        super()._end(code if self.left_s else 0, error_text)
