"""A program in a separate process that reports its progress line by line."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass

from PySide6.QtCore import QObject, QProcess, QProcessEnvironment, QTimer, Signal

_PATIENCE_MS = 3000
_KEPT_BYTES = 64 * 1024
"""Length of the end of standard error that is kept."""


@dataclass(frozen=True)
class Ending:
    """Exit code and error output of a process."""

    code: int | None  # None when it did not start, was killed or died
    errors: str  # standard error, or why it did not start

    def reason(self, otherwise: str) -> str:
        """Reason of a failure from the last line of ``sd2``, or else these words."""
        said = self.errors.splitlines()[-1:]
        return said[0].removeprefix("sd2: ") if said else otherwise


class LineProcess(QObject):
    """Runs a program once; lines arrive whole, however the pipe cuts them."""

    line = Signal(str)
    ended = Signal(object)  # Ending: exactly once, after the last line

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._rest = b""
        self._errors = b""
        self._over = False
        self._process = QProcess(self)
        environment = QProcessEnvironment.systemEnvironment()
        environment.insert("PYTHONIOENCODING", "utf-8")
        self._process.setProcessEnvironment(environment)
        self._process.readyReadStandardOutput.connect(self._read)
        self._process.readyReadStandardError.connect(self._read_errors)
        self._process.finished.connect(self._finish)
        self._process.errorOccurred.connect(self._fail)
        self._patience = QTimer(self)
        self._patience.setSingleShot(True)
        self._patience.setInterval(_PATIENCE_MS)
        self._patience.timeout.connect(self._process.kill)

    def start(self, command: Sequence[str]) -> None:
        """Start it: the program and its arguments."""
        self._process.start(command[0], list(command[1:]))
        self._process.closeWriteChannel()

    def stop(self) -> None:
        """Ask it to end, and end it when it does not."""
        if self._over:
            return
        if sys.platform == "win32":  # nothing there listens to a request
            self._process.kill()
        else:
            self._process.terminate()
            self._patience.start()

    def close(self) -> None:
        """End it at once and wait until it is gone; nothing more is said."""
        self._over = True
        self._patience.stop()
        if self._process.state() != QProcess.ProcessState.NotRunning:
            self._process.kill()
            self._process.waitForFinished(2000)

    def _read(self) -> None:
        *lines, self._rest = (
            self._rest + bytes(self._process.readAllStandardOutput().data())
        ).split(b"\n")
        for line in lines:
            if not self._over:
                self.line.emit(line.decode("utf-8", "replace").rstrip("\r"))

    def _read_errors(self) -> None:
        self._errors += bytes(self._process.readAllStandardError().data())
        self._errors = self._errors[-_KEPT_BYTES:]

    def _finish(self, code: int, status: QProcess.ExitStatus) -> None:
        self._read()
        self._read_errors()
        if self._rest and not self._over:
            self.line.emit(self._rest.decode("utf-8", "replace"))
        died = status == QProcess.ExitStatus.CrashExit
        self._end(None if died else code, self._errors.decode("utf-8", "replace").strip())

    def _fail(self, error: QProcess.ProcessError) -> None:
        # Every other error is followed by `finished`.
        if error == QProcess.ProcessError.FailedToStart:
            self._end(None, self._process.errorString())

    def _end(self, code: int | None, errors: str) -> None:
        self._patience.stop()
        if not self._over:
            self._over = True
            self.ended.emit(Ending(code, errors))
