"""A body fitted to a video, in a process beside the window."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QLockFile, QObject, QTimer, Signal

from sd2app.background.line_process import Ending, LineProcess
from sd2app.fit.messages import (
    Done,
    Found,
    Noted,
    Progressed,
    Refused,
    Started,
    message_of,
)
from sd2app.fit.progress import FitProgress
from sd2app.fit.request import LOCK_NAME, FitRequest, read_request, settled
from sd2app.settings import Settings
from sd2core.errors import Sd2Error

State = Literal["idle", "running", "cancelling", "stopped", "failed", "finished"]

COMMAND = (sys.executable, "-u", "-m", "sd2app.background.run_command")
_TICK_MS = 100


@dataclass(eq=False)
class Run:
    """What one run has told so far."""

    request: FitRequest
    landmarks: dict[int, NDArray[np.float32]]
    progress: FitProgress = field(default_factory=FitProgress)
    notes: list[str] = field(default_factory=list)
    started: Started | None = None
    done: Done | None = None


class FitModel(QObject):
    """At most one fit at a time; what was stopped can be continued, also after a restart.

    Signals
    -------
    changed
        State, stage or count; at most ten times a second while running.
    state_changed
        The state alone.
    advanced : int
        Landmarks of this frame (and of some before) are there; as often.
    finished : FitRequest
        The mesh is written.
    """

    changed = Signal()
    advanced = Signal(int)
    finished = Signal(object)
    state_changed = Signal()

    def __init__(
        self,
        settings: Settings,
        parent: QObject | None = None,
        command: Sequence[str] = COMMAND,
    ) -> None:
        super().__init__(parent)
        self._settings = settings
        self._command = tuple(command)
        self._state: State = "idle"
        self._text = ""
        self._run: Run | None = None
        self._process: LineProcess | None = None
        self._lock: QLockFile | None = None
        self._newest: int | None = None
        self._stale = False
        # Twenty lines a second are more than anybody can follow.
        self._tick = QTimer(self)
        self._tick.setInterval(_TICK_MS)
        self._tick.timeout.connect(self._tell)

    # --- what is there --------------------------------------------------------------------

    @property
    def state(self) -> State:
        """What it is doing."""
        return self._state

    @property
    def busy(self) -> bool:
        """Whether a process is there."""
        return self._state in ("running", "cancelling")

    @property
    def request(self) -> FitRequest | None:
        """What is being fitted, or was last."""
        return self._run.request if self._run else None

    @property
    def progress(self) -> FitProgress | None:
        """How far it is."""
        return self._run.progress if self._run else None

    @property
    def text(self) -> str:
        """Why it failed."""
        return self._text

    @property
    def notes(self) -> tuple[str, ...]:
        """What the user should know of the last run."""
        return tuple(self._run.notes) if self._run else ()

    @property
    def picture_size(self) -> tuple[int, int] | None:
        """Width and height of the upright picture, once the video is open."""
        started = self._run.started if self._run else None
        return (started.width, started.height) if started else None

    def landmarks_at(self, frame: int) -> NDArray[np.float32] | None:
        """X, y in pixels and visibility, (33, 3), as far as they were told; see ``Found``."""
        return self._run.landmarks.get(frame) if self._run else None

    # --- what one can do ------------------------------------------------------------------

    def start(self, request: FitRequest) -> None:
        """Begin, or continue what was stopped in the same folder.

        Raises
        ------
        Sd2Error
            When a fit is under way, here or in another window, or the folder cannot be used.
        OSError
            When the folder cannot be written.
        """
        if self.busy:
            raise Sd2Error(
                "A body is being fitted already", "one at a time", "Wait for it, or cancel it"
            )
        request = settled(request)
        made = not request.folder.exists()
        request.save()
        lock = QLockFile(str(request.folder / LOCK_NAME))
        lock.setStaleLockTime(0)
        if not lock.tryLock(0):
            if made:
                request.discard()
            raise Sd2Error(
                f"{request.folder} is being fitted in another window",
                remedy="Wait for it, or save elsewhere",
            )
        self._lock = lock
        self._settings.set_unfinished_fit(request.folder)
        if request.mesh.exists():
            # Fitted, and the program ended before the recording was made.
            self._run = Run(request, {})
            self._complete(request)
        else:
            self._begin(request)

    def resume(self) -> None:
        """Continue what was stopped or failed; raises what :meth:`start` does."""
        if self._run is not None and self._state in ("stopped", "failed"):
            self.start(self._run.request)

    def cancel(self) -> None:
        """Stop; what was done is kept."""
        if self._state == "running" and self._process is not None:
            self._set_state("cancelling")
            self._process.stop()

    def discard(self) -> None:
        """Give up what was stopped, and remove it."""
        if self._run is not None and not self.busy:
            self._run.request.discard()
            self.dismiss()

    def dismiss(self) -> None:
        """Say no more of it; what a stopped fit left stays on disk."""
        if not self.busy:
            request = self.request
            if self._state == "failed" and request is not None and not request.partial.exists():
                request.discard()
            self._settings.set_unfinished_fit(None)
            self._set_state("idle")

    def report_failure(self, text: str) -> None:
        """What came after the fit went wrong."""
        self._text = text
        self._set_state("failed")

    def look_for_unfinished(self) -> None:
        """Take up what was under way when the program last ended."""
        folder = self._settings.unfinished_fit
        if folder is not None:
            self.take_up(folder)

    def take_up(self, folder: Path) -> bool:
        """Offer to continue what was stopped in a folder; whether there is such a thing."""
        request = read_request(folder) if folder.is_dir() else None
        if request is None or not request.unfinished or self.busy:
            return False
        lock = QLockFile(str(folder / LOCK_NAME))
        lock.setStaleLockTime(0)
        if not lock.tryLock(0):
            return False  # another window is at it
        lock.unlock()
        self._run = Run(request, {})
        self._set_state("stopped")
        return True

    def close(self) -> None:
        """End the process at once; what it has done is kept."""
        self._tick.stop()
        if self._process is not None:
            self._process.close()
        self._unlock()

    # --- the process ----------------------------------------------------------------------

    def _begin(self, request: FitRequest) -> None:
        before = self._run
        same = before is not None and before.request == request
        # What was found before it was stopped is still so.
        landmarks = before.landmarks if before is not None and same else {}
        self._run = Run(request, landmarks)
        self._text, self._newest = "", None
        if self._process is not None:
            self._process.deleteLater()
        self._process = LineProcess(self)
        self._process.line.connect(self._read)
        self._process.ended.connect(self._end)
        self._set_state("running")
        self._tick.start()
        self._process.start([*self._command, *request.arguments()])

    def _read(self, line: str) -> None:
        run, message = self._run, message_of(line)
        if run is None or message is None:
            return
        match message:
            case Started():
                run.started = message
                run.progress.start(message)
            case Progressed():
                run.progress.report(message)
            case Found():
                run.landmarks[message.frame] = message.points
                self._newest = message.frame
            case Noted() if message.text not in run.notes:
                run.notes.append(message.text)
            case Done():
                run.done = message
            case Refused():
                self._text = message.text
        self._stale = True

    def _tell(self) -> None:
        if self._stale:
            self._stale = False
            self.changed.emit()
        if self._newest is not None:
            newest, self._newest = self._newest, None
            self.advanced.emit(newest)

    def _end(self, ending: Ending) -> None:
        self._tick.stop()
        self._unlock()
        run = self._run
        assert run is not None
        if ending.code == 0 and run.request.mesh.exists():
            self._complete(run.request)
        elif self._state == "cancelling":
            self._set_state("stopped")
        else:
            self._text = self._text or _reason(ending)
            self._set_state("failed")

    def _complete(self, request: FitRequest) -> None:
        self._unlock()
        self._settings.set_unfinished_fit(None)
        self._set_state("finished")
        self.finished.emit(request)

    def _unlock(self) -> None:
        if self._lock is not None:
            self._lock.unlock()
            self._lock = None

    def _set_state(self, state: State) -> None:
        self._state = state
        self.state_changed.emit()
        self.changed.emit()


def _reason(ending: Ending) -> str:
    """What the command said, as it said it."""
    said = ending.errors.removeprefix("sd2: ")
    if ending.code is None:
        return said or "The fit ended without a word. What it has done is kept."
    return said or f"The fit ended with exit code {ending.code} and without a word."
