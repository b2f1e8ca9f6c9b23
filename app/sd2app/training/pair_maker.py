"""Pairs made of recordings in a background process."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from PySide6.QtCore import QObject, QProcess, QProcessEnvironment, QTimer, Signal

from sd2core.errors import Sd2Error
from sd2core.files.paths import remove
from sd2core.recording.recording import is_recording, open_recording
from sd2core.runs.command_folder import COMMAND

_PATIENCE_MS = 3000
"""A process that does not end within this time when it is asked to is killed."""


class PairMaker(QObject):
    """Runs ``sd2 pairs recordings`` once at a time, with ``command``.

    Pairs are kept in ``folder``, which is made on demand.
    """

    changed = Signal()  # making pairs began or ended
    made = Signal(object)  # path of a finished store
    failed = Signal(str)  # why there is none

    def __init__(
        self,
        folder: Path,
        parent: QObject | None = None,
        command: Sequence[str] = COMMAND,
    ) -> None:
        super().__init__(parent)
        self._folder = folder
        self._command = tuple(command)
        self._process: QProcess | None = None
        self._patience = QTimer(self, singleShot=True, interval=_PATIENCE_MS)
        self._patience.timeout.connect(self._kill)
        self._out: Path | None = None
        self._cancelled = False

    @property
    def out(self) -> Path | None:
        """Store that is being made."""
        return self._out

    @property
    def cancelling(self) -> bool:
        """True once it has been asked to end."""
        return self._out is not None and self._cancelled

    def make(self, place: Path) -> None:
        """Make pairs of a recording, or of all recordings in a folder.

        Raises Sd2Error if there is none with a mesh and a radar capture, or some are being made;
        OSError if the folder cannot be read, or that of the pairs not be made.
        """
        if self._out is not None:
            raise Sd2Error(
                f"{self._out.stem} is being made already", "one at a time", "Wait for it"
            )
        recordings = usable_recordings(place)
        self._folder.mkdir(parents=True, exist_ok=True)
        self._out = _free(self._folder, place.stem)
        self._cancelled = False
        program, *words = self._command
        words += ["pairs", "recordings", *map(str, recordings), "--out", str(self._out)]
        environment = QProcessEnvironment.systemEnvironment()
        environment.insert("PYTHONIOENCODING", "utf-8")
        self._process = process = QProcess(self)
        process.setProcessEnvironment(environment)
        process.setStandardOutputFile(QProcess.nullDevice())
        process.finished.connect(self._end)
        process.errorOccurred.connect(self._refuse)
        process.start(program, words)
        process.closeWriteChannel()
        self.changed.emit()

    def cancel(self) -> None:
        """Cancel, and remove the unfinished pairs."""
        if self._process is not None and not self._cancelled:
            self._cancelled = True
            if sys.platform == "win32":  # nothing there listens to a request
                self._kill()
            else:
                self._process.terminate()
                self._patience.start()
            self.changed.emit()

    def close(self) -> None:
        """End the process at once."""
        if self._process is not None:
            self._process.blockSignals(True)
            self._kill()
            self._process.waitForFinished(2000)
            self._let_go()

    def _kill(self) -> None:
        if self._process is not None:
            self._process.kill()

    def _refuse(self, error: QProcess.ProcessError) -> None:
        # Every other error is followed by `finished`.
        if error == QProcess.ProcessError.FailedToStart and self._process is not None:
            self._end(1, QProcess.ExitStatus.CrashExit)

    def _end(self, code: int, status: QProcess.ExitStatus) -> None:
        out, process = self._out, self._process
        assert out is not None
        assert process is not None
        if code == 0 and status == QProcess.ExitStatus.NormalExit:
            self._process, self._out = None, None
            self.made.emit(out)
        else:
            errors = bytes(process.readAllStandardError().data()).decode("utf-8", "replace")
            said = errors.strip().splitlines() or [f"{out.stem} could not be made."]
            self._let_go()
            if not self._cancelled:
                self.failed.emit(said[-1].removeprefix("sd2: "))
        self._patience.stop()
        process.deleteLater()
        self.changed.emit()

    def _let_go(self) -> None:
        """Forget the process, and remove what it left."""
        out, self._process, self._out = self._out, None, None
        if out is not None and out.exists():
            remove(out)


def usable_recordings(place: Path) -> list[Path]:
    """The recording itself, or those in a folder that have a mesh and a radar capture.

    Raises Sd2Error if there is none.
    """
    folders = [place] if is_recording(place) else sorted(place.iterdir())
    found = []
    for folder in folders:
        if is_recording(folder):
            try:
                recording = open_recording(folder)
            except Sd2Error:
                continue  # damaged: the others are still of use
            if recording.mesh is not None and recording.radar is not None:
                found.append(folder)
    if not found:
        raise Sd2Error(
            f"{place} holds no recording with a mesh and a radar capture",
            "a recording (.sd2), or a folder of some",
        )
    return found


def _free(folder: Path, name: str) -> Path:
    path, number = folder / f"{name}.zarr", 2
    while path.exists():
        path, number = folder / f"{name}-{number}.zarr", number + 1
    return path
