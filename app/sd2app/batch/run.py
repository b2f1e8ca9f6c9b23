"""Follows one batch, whoever started it, by looking at its folder."""

from __future__ import annotations

import os
import signal
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, NamedTuple

from PySide6.QtCore import QObject, Signal

from sd2app.background.detached import is_alive, last_words
from sd2app.background.poller import RepeatedLook
from sd2core.batch.folder import BatchFolder, BatchStatus, status_of
from sd2core.errors import Sd2Error
from sd2core.runs.progress import Event, ProgressTail

Phase = Literal[
    "starting", "running", "stopping", "finished", "stopped", "failed", "died", "gone"
]  # fmt: skip
"""``gone``: nothing is there."""

UNDER_WAY: tuple[Phase, ...] = ("starting", "running", "stopping")
"""A process is at it."""

POLL_MS = 400
SLOW_POLL_MS = 3000
_CLOCKS_S = 1.0
"""By so much the times of two processes may disagree."""
_KEPT_LINES = 500
"""Of failures: there may be thousands, and the report has all."""


@dataclass(frozen=True)
class Failed:
    """A task that cannot be done."""

    recording: str
    step: str
    placement: int | None
    reason: str


class _Found(NamedTuple):
    live: bool
    launching: bool
    status: BatchStatus | None
    failures: tuple[Failed, ...]
    log: str
    steps: tuple[str, ...]


def output_of(folder: Path) -> Path:
    """What the process of a batch writes besides; it may end before it has a folder."""
    return folder.with_name(f".{folder.name}.out")


def plan_of(folder: Path) -> Path:
    """What a batch is started with; it keeps a plan of its own in its folder."""
    return folder.with_name(f".{folder.name}.plan.toml")


class BatchFollower(QObject):
    """One batch: how it stands, what failed, and how to stop it.

    Parameters
    ----------
    path : Path
        Its folder; may not be there yet.
    pid : int, optional
        Of the process that was just started for it.

    Signals
    -------
    changed
    phase_changed
    """

    changed = Signal()
    phase_changed = Signal()

    def __init__(
        self, path: Path, parent: QObject | None = None, *, pid: int | None = None
    ) -> None:
        super().__init__(parent)
        self.folder = BatchFolder(path)
        self._pid, self._launched_s = pid, time.time()
        self._looker = _Looker(self.folder, output_of(path))
        self._phase: Phase = "starting"
        self._known = self._seen = self._stopping = False
        self._found: _Found | None = None
        self._text = ""
        self._looking = RepeatedLook("batch", self._look, POLL_MS, self)
        self._looking.found.connect(self._take)
        self._looking.failed.connect(self._fail)

    # --- what is known --------------------------------------------------------------------

    @property
    def known(self) -> bool:
        """Whether the folder has been looked at."""
        return self._known

    @property
    def phase(self) -> Phase:
        """How it stands; what was just asked for counts at once."""
        return "stopping" if self._stopping and self._phase in UNDER_WAY else self._phase

    @property
    def under_way(self) -> bool:
        """Whether a process is at it."""
        return self._phase in UNDER_WAY

    @property
    def status(self) -> BatchStatus | None:
        """Counts and times of the last run."""
        return self._found.status if self._found is not None else None

    @property
    def steps(self) -> tuple[str, ...]:
        """Steps of the plan, in order."""
        return self._found.steps if self._found is not None else ()

    @property
    def failures(self) -> tuple[Failed, ...]:
        """The first few hundred of this run."""
        return self._found.failures if self._found is not None else ()

    @property
    def log(self) -> str:
        """The end of what was noted."""
        return self._found.log if self._found is not None else ""

    @property
    def text(self) -> str:
        """Why the whole batch failed."""
        return self._text

    @property
    def resumable(self) -> bool:
        """Whether the same command would go on with it."""
        return not self.under_way and self._phase != "gone" and self.folder.plan.exists()

    # --- steering -------------------------------------------------------------------------

    def stop(self) -> None:
        """Tell the process to stop; what is done stays.

        Raises
        ------
        OSError
            When the word cannot be written.
        """
        if not self.under_way or self._stopping:
            return
        self._stopping = True
        with suppress(Sd2Error):  # not as far as that
            self.folder.tell("stop")
        self.phase_changed.emit()
        self.changed.emit()

    def close(self) -> None:
        """Look no more; the process goes on."""
        self._looking.close()

    # --- looking --------------------------------------------------------------------------

    def _look(self) -> _Found:
        return self._looker.look(self._pid)

    def _take(self, found: _Found) -> None:
        told = found != self._found
        self._found = found
        self._seen |= found.live or self._is_of_this_start(found)
        phase = self._phase_of(found)
        another = phase != self._phase or not self._known
        self._phase, self._known = phase, True
        if self._stopping and phase in UNDER_WAY:
            self._say_stop_again(found)
        if another:
            self._settle(found)
            self.phase_changed.emit()
        if told or another:
            self.changed.emit()

    def _phase_of(self, found: _Found) -> Phase:
        if found.live:
            return "running"
        # Once it has been at the folder, a process that still ends is of no interest.
        if found.launching and not self._seen:
            return "starting"
        if self._pid is not None and not self._seen:
            # It was refused, or told to stop, before it had a folder.
            return "stopped" if self._stopping else "failed"
        return found.status.state if found.status is not None else "gone"

    def _is_of_this_start(self, found: _Found) -> bool:
        """Whether what is there is of the process just started, which may be over by now."""
        status = found.status
        return (
            self._pid is not None
            and status is not None
            and status.started_unix_s >= self._launched_s - _CLOCKS_S
        )

    def _say_stop_again(self, found: _Found) -> None:
        """Where it had no folder when this was asked for, it may not have heard."""
        if found.live:
            with suppress(Sd2Error, OSError):
                self.folder.tell("stop")
        elif self._pid is not None:
            with suppress(OSError):
                os.kill(self._pid, signal.SIGTERM)

    def _settle(self, found: _Found) -> None:
        """The phase is another one."""
        under_way = self._phase in UNDER_WAY
        self._looking.set_interval(POLL_MS if under_way else SLOW_POLL_MS)
        if under_way:
            return
        self._stopping = False
        said = last_words(output_of(self.folder.path))
        self._text = ""
        if self._phase == "failed":
            error = found.status.error if found.status is not None else None
            self._text = error or said.removeprefix("sd2: ") or "The batch ended without a word."
        elif self._phase == "died":
            self._text = said.splitlines()[-1] if said else ""
        plan_of(self.folder.path).unlink(missing_ok=True)
        if self._phase in ("finished", "stopped"):
            output_of(self.folder.path).unlink(missing_ok=True)

    def _fail(self, error: Exception) -> None:
        # The disk is away for a moment; it is looked at again.
        if self._text != str(error):
            self._text = str(error)
            self.changed.emit()


class _Looker:
    """What is done in the background; reads only what was added since the last look."""

    def __init__(self, folder: BatchFolder, output: Path) -> None:
        self._folder, self._output = folder, output
        self._tail = ProgressTail(folder.progress)
        self._last: list[Event] = []
        self._failures: list[Failed] = []
        self._steps: tuple[str, ...] = ()

    def look(self, pid: int | None) -> _Found:
        folder = self._folder
        # The process first: when it is gone, all that it wrote is there to be read.
        launching = pid is not None and is_alive(pid)
        live = folder.live
        for event in self._tail.new():
            self._learn(event)
        status = None
        if folder.exists:
            about = folder.about()
            state = about["state"]
            if state == "running" and not live:
                state = "running" if folder.live else "died"
            status = status_of(state, about, self._last)
        return _Found(
            live, launching, status, tuple(self._failures), last_words(folder.log), self._steps
        )

    def _learn(self, event: Event) -> None:
        kind = event["event"]
        if kind == "start":
            # Only the last run counts.
            self._last, self._failures = [event], []
            self._steps = tuple(map(str, event.get("steps", ())))
        elif kind in ("progress", "end"):
            self._last = [*self._last[:1], event]
        elif kind == "failed" and len(self._failures) < _KEPT_LINES:
            self._failures.append(_failed(event))


def _failed(event: dict[str, Any]) -> Failed:
    error = event.get("error") or {}
    words = (str(error.get(part, "")) for part in ("found", "expected", "remedy"))
    placement = event.get("placement")
    return Failed(
        str(event.get("recording", "")),
        str(event.get("step", "")),
        placement if isinstance(placement, int) else None,
        str(Sd2Error(*words)),
    )
