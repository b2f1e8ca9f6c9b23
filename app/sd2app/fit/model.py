"""A body fitted to a video: its background process, and what that has told.

Lines of progress are those of ``sd2 fit --progress-json``; see ``docs/formats.md``.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, Signal

from sd2app.background.run_monitor import CommandRun, History
from sd2app.fit.request import FitRequest, read_request, settled
from sd2app.settings import Settings
from sd2core.body.track import LANDMARKS
from sd2core.errors import Sd2Error
from sd2core.runs.command_folder import COMMAND_IN_FOLDER, CommandFolder

FORMAT, VERSION = "sd2-fit-progress", 1

WORDS = {
    "models": "fetching the landmark models",
    "people": "following everybody",
    "find": "finding the person",
    "refine": "looking again",
    "fit": "fitting the body",
    "write": "writing the mesh",
}
_WEIGHTS = {"models": 0.0, "find": 1.0, "refine": 4.0, "fit": 3.0, "write": 0.3}
"""Time of a frame in each stage, relative to the others."""
_UNKNOWN_WEIGHT = 0.5
_SETTLING_S = 2.0
"""Shortest time from which the rest is estimated."""
_POLL_MS = 100


class FitProgress(History):
    """Progress of one fit by its lines: stages, landmarks, and notes for the user.

    What is done counts in the stage under way.

    Landmarks stand by their frame, each of shape (33, 3): x and y in pixels of the upright
    picture, NaN where there is no person, and visibility from 0 to 1.
    """

    def __init__(self, clock_s: Callable[[], float] = time.monotonic) -> None:
        self.landmarks: dict[int, NDArray[np.float32]] = {}
        self._clock_s = clock_s
        self._stages: tuple[str, ...] = ()
        self._began: list[tuple[float, float]] = []  # time and share at a stage's first report
        self.size: tuple[int, int] | None = None  # of the upright picture, once the video is open
        self.resumed = False
        self.stage = self.unit = ""
        self.newest: int | None = None  # frame of the landmarks that came last
        self.notes: list[str] = []

    def _take_start(self, event: dict[str, Any]) -> None:
        if event["format"] != FORMAT or event["version"] > VERSION:
            raise ValueError("lines of another program, or of a later version")
        self.size = int(event["width"]), int(event["height"])
        self._stages = tuple(map(str, event["stages"]))
        self.resumed = bool(event.get("resumed", False))

    def _take_progress(self, event: dict[str, Any]) -> None:
        stage, done, total = str(event["stage"]), int(event["done"]), int(event["total"])
        another = stage != self.stage
        self.stage, self.done, self.total = stage, done, total
        self.unit = str(event.get("unit", ""))
        share = self.share
        if share is not None and (another or not self._began):
            self._began.append((self._clock_s(), share))

    def _take_landmarks(self, event: dict[str, Any]) -> None:
        image_px = np.array(event["image_px"], np.float32)  # null becomes NaN
        visibility = np.array(event["visibility"], np.float32)
        if image_px.shape != (len(LANDMARKS), 2) or visibility.shape != (len(LANDMARKS),):
            raise ValueError("another number of landmarks")
        self.newest = int(event["frame"])
        self.landmarks[self.newest] = np.concatenate([image_px, visibility[:, None]], axis=1)

    def _take_note(self, event: dict[str, Any]) -> None:
        if (text := str(event["text"])) not in self.notes:
            self.notes.append(text)

    @property
    def share(self) -> float | None:
        """Share of the whole work that is done, None while it is not known."""
        if self.stage not in self._stages:
            return None
        kinds = [stage.partition(" ")[0] for stage in self._stages]  # "fit 2": of person 2
        weights = [_WEIGHTS.get(kind, _UNKNOWN_WEIGHT) for kind in kinds]
        here = self._stages.index(self.stage)
        within = min(self.done / self.total, 1.0) if self.total else 0.0
        total = math.fsum(weights)
        done = math.fsum([*weights[:here], within * weights[here]])
        return min(done / total, 1.0) if total else None

    @property
    def left_s(self) -> float | None:
        """Seconds to the end at the speed of this stage, None while it is not known.

        At the beginning of a stage the speed is that since the one before, or before that.
        """
        share = self.share
        if share is None:
            return None
        for began_s, began_share in reversed(self._began):
            elapsed_s, gained = self._clock_s() - began_s, share - began_share
            if elapsed_s >= _SETTLING_S and gained > 0:
                return elapsed_s * (1.0 - share) / gained
        return None

    @property
    def text(self) -> str:
        """Stage and count in words."""
        kind, _, person = self.stage.partition(" ")
        words = WORDS.get(kind, self.stage) + (f", person {person}" if person else "")
        if not words:
            return "starting"
        if self.unit == "byte":
            megabytes = f"{self.done / 1e6:.1f}"
            return f"{words}, {megabytes} of {self.total / 1e6:.1f} MB" if self.total else words
        if not self.total:
            return words
        unit = {"frame": "frame ", "step": "step "}.get(self.unit, "")
        return f"{words}, {unit}{self.done} of {self.total}"


class FitRun(CommandRun):
    """A fit with its progress."""

    histories = FitProgress
    history: FitProgress
    poll_ms = _POLL_MS
    stop_patience_s = 3.0


UNFINISHED = "unfinished_fit"
"""Name in the settings of the folder in which a body is being fitted."""
State = Literal["idle", "running", "cancelling", "stopped", "failed", "finished"]


class FitModel(QObject):
    """At most one fit at a time; a stopped one can be continued, also after a restart."""

    changed = Signal()  # state, stage, count or landmarks; at most ten times a second
    finished = Signal(object)  # FitRequest: the mesh is written
    state_changed = Signal()  # the state alone

    def __init__(
        self,
        settings: Settings,
        parent: QObject | None = None,
        command: Sequence[str] = COMMAND_IN_FOLDER,
    ) -> None:
        super().__init__(parent)
        self._settings = settings
        self._command = tuple(command)
        self.state: State = "idle"
        self.text = ""  # why it failed
        self.request: FitRequest | None = None  # what is being fitted, or was last
        self._run: FitRun | None = None
        self._landmarks: dict[int, NDArray[np.float32]] = {}

    # --- what is there --------------------------------------------------------------------

    @property
    def busy(self) -> bool:
        """True while a process works."""
        return self.state in ("running", "cancelling")

    @property
    def progress(self) -> FitProgress | None:
        """Progress over all stages."""
        return self._run.history if self._run else None

    @property
    def notes(self) -> str:
        """Sentences of the last run that the user should read."""
        return " ".join(self.progress.notes) if self.progress else ""

    def landmarks_at(self, frame: int) -> NDArray[np.float32] | None:
        """X, y in pixels and visibility, (33, 3), as far as they were told; see `FitProgress`."""
        return self._landmarks.get(frame)

    # --- what one can do ------------------------------------------------------------------

    def start(self, request: FitRequest) -> None:
        """Begin, or continue what was stopped in the same folder.

        Raises Sd2Error if a fit is under way, here or in another window, or the folder cannot
        be used; OSError if the folder cannot be written.
        """
        if self.busy:
            raise Sd2Error(
                "A body is being fitted already", "one at a time", "Wait for it, or cancel it"
            )
        request = settled(request)
        if CommandFolder(request.run).taken:
            raise Sd2Error(
                f"{request.folder} is being fitted in another window",
                remedy="Wait for it, or save elsewhere",
            )
        request.save()
        self._settings.set_paths(UNFINISHED, [request.folder])
        if request != self.request:
            # Otherwise what was found before it was stopped is still so.
            self._landmarks = {}
        self.request = request
        if request.made:
            # Fitted, and the program ended before the recording was made.
            self._follow(None)
            self._complete()
        else:
            self._begin(request)

    def resume(self) -> None:
        """Continue what was stopped or failed; raises what :meth:`start` does."""
        if self.request is not None and self.state in ("stopped", "failed"):
            self.start(self.request)

    def cancel(self) -> None:
        """Stop; what was done is kept."""
        if self.state == "running" and self._run is not None:
            self._set_state("cancelling")
            self._run.tell("stop")

    def discard(self) -> None:
        """Give up what was stopped, and remove it."""
        if self.request is not None and not self.busy:
            self.request.discard()
            self.dismiss()

    def dismiss(self) -> None:
        """Hide the ended fit; a stopped one can still be continued from disk."""
        if not self.busy:
            request = self.request
            if self.state == "failed" and request and not any(map(Path.exists, request.partials)):
                request.discard()
            self._settings.set_paths(UNFINISHED, [])
            self._set_state("idle")

    def report_failure(self, text: str) -> None:
        """Fail for a reason that came after the fit."""
        self.text = text
        self._set_state("failed")

    def look_for_runs(self) -> None:
        """Take up what was under way when the program last ended."""
        for folder in self._settings.paths(UNFINISHED):
            self.take_up(folder)

    def take_up(self, folder: Path) -> bool:
        """Offer to continue what was stopped in a folder; False if there is no such thing.

        A fit that goes on although its window was killed is followed.
        """
        request = read_request(folder) if folder.is_dir() else None
        if request is None or not request.unfinished or self.busy:
            return False
        run = CommandFolder(request.run)
        if run.taken:
            if run.is_followed:
                return False  # by another window
            self.request, self._landmarks = request, {}
            run.take_up()
            self._follow(FitRun(request.run, self))
        else:
            self._follow(None)
            self.request = request
            self._set_state("stopped")
        return True

    def close(self) -> None:
        """End the process at once; what it has done is kept."""
        if self._run is not None:
            (self._run.kill if self.busy else self._run.close)()

    # --- the process ----------------------------------------------------------------------

    def _begin(self, request: FitRequest) -> None:
        self.text = ""
        self._follow(None)
        folder = CommandFolder(request.run)
        try:
            process = folder.start(request.arguments(), {"what": "fit"}, self._command, {})
        except Sd2Error as error:
            self.report_failure(str(error))
        else:
            self._follow(FitRun(request.run, self, process=process))

    def _follow(self, run: FitRun | None) -> None:
        if self._run is not None:
            self._run.close()
            self._run.deleteLater()
        self._run = run
        if run is not None:
            run.history.landmarks = self._landmarks  # goes on from a stopped one's
            run.changed.connect(self.changed)
            run.ended.connect(self._end)
            self._set_state("running")

    def _end(self) -> None:
        run, request = self._run, self.request
        assert run is not None
        assert request is not None
        run.close()
        if run.phase == "finished" and request.made:
            self._complete()
        elif self.state == "cancelling":
            self._set_state("stopped")
        else:
            silent = "The fit ended without saying why. What it has done is kept."
            self.report_failure(run.text or silent)

    def _complete(self) -> None:
        self._settings.set_paths(UNFINISHED, [])
        self._set_state("finished")
        self.finished.emit(self.request)

    def _set_state(self, state: State) -> None:
        self.state = state
        self.state_changed.emit()
        self.changed.emit()
