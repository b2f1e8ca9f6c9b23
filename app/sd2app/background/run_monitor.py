"""Monitor of one run: follows its folder, whoever started it, and steers its process."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, ClassVar, Generic, Literal, NamedTuple, TypeVar

from PySide6.QtCore import QObject, QTimer, Signal

from sd2app.background.latest import ClosingModel, LatestRunner
from sd2core.errors import Sd2Error
from sd2core.processes import ProcessId
from sd2core.runs.command_folder import CommandFolder, last_output
from sd2core.runs.control import Command, read_control, write_control
from sd2core.runs.folder import LIVE, RunFolder, State
from sd2core.runs.progress import ProgressTail

Phase = Literal[
    "starting", "running", "pausing", "paused", "resuming", "stopping", "cancelling",
    "finished", "stopped", "failed", "died", "gone",
]  # fmt: skip
"""``gone`` is a run that was cancelled, or deleted by another program."""

UNDER_WAY: tuple[Phase, ...] = (
    "starting", "running", "pausing", "paused", "resuming", "stopping", "cancelling",
)  # fmt: skip
"""Phases with a process."""

POLL_MS = 250
"""Interval between two looks, also at runs that have ended: they may be resumed elsewhere."""
_CANCEL_PATIENCE_S = 30.0
"""After that a process that does not react to its cancellation is killed."""
_CLOSING_S = 10.0
"""A killed process is gone at once, unless the machine is busy."""
_SILENT = "It ended without saying why."

F = TypeVar("F", bound=RunFolder)


class History:
    """History of a run by its lines, at least how far it is.

    A method ``_take_EVENT`` takes the lines of an event; damaged ones are left out.
    """

    begun = True  # the process has said that it works
    paused = False  # the process has said that it pauses
    saving = False  # a result is written that a stop would lose
    error = ""  # reason of a failure as the run reported it
    elapsed_s: float | None = None  # time at work; None while that is not known
    done = total = 0  # steps; a total of 0 is not known
    told_left_s: float | None = None

    @property
    def share(self) -> float | None:
        """Share of the whole that is done; None while that is not known."""
        return min(self.done / self.total, 1.0) if self.total else None

    @property
    def left_s(self) -> float | None:
        """Time left; None while that is not known."""
        return self.told_left_s

    def take(self, events: Iterable[dict[str, Any]]) -> bool:
        """Take lines; True if any of them was of use."""
        taken = False
        for event in events:
            reader = getattr(self, f"_take_{event.get('event')}", None)
            if reader is None:
                continue
            try:
                reader(event)
            except (AttributeError, KeyError, TypeError, ValueError, OverflowError):
                continue
            taken = True
        return taken

    def _take_progress(self, event: dict[str, Any]) -> None:
        self.done, self.total = int(event["done"]), int(event.get("total") or 0)
        left_s = event.get("left_s")
        self.told_left_s = None if left_s is None else float(left_s)

    def _take_error(self, event: dict[str, Any]) -> None:
        self.error = str(event["text"])


def reason_in(event: Mapping[str, Any]) -> str:
    """Reason of a failure that a line reports as a JSON object; empty without one."""
    error = event.get("error")
    return str(Sd2Error(**error)) if isinstance(error, dict) else ""


class _Status(NamedTuple):
    """One look at the folder of a run."""

    launching: bool
    live: bool
    exists: bool
    state: State | None
    process: ProcessId | None
    word: Command
    events: list[dict[str, Any]]
    facts: Any


class RunMonitor(ClosingModel, Generic[F]):
    """State and progress of one run, and orders to its process, which goes on when it is closed.

    The folder may be missing at first; ``process`` is one that was just started for it.
    Subclasses say what the folder is, and who reads its lines.
    """

    changed = Signal()
    phase_changed = Signal()
    ended = Signal()  # the run came to its end while it was followed

    folders: ClassVar[type[RunFolder]]
    histories: ClassVar[type[History]] = History
    poll_ms: ClassVar[int | None] = None
    """Interval between two looks; None: :data:`POLL_MS`."""
    stop_patience_s: ClassVar[float | None] = None
    """A process that does not stop within this time is killed; None: it may take its time."""
    folder: F
    history: Any
    """What it has told: a :class:`History`."""
    facts: Any = None
    """Newest result of :meth:`inspect`."""

    def __init__(
        self, path: Path, parent: QObject | None = None, *, process: ProcessId | None = None
    ) -> None:
        super().__init__(parent)
        self.folder = self.folders(path)  # type: ignore[assignment]
        self.history = self.histories()
        self._launched = process
        self._clock_s = time.monotonic
        self._tail = ProgressTail(self.folder.progress)
        self.phase: Phase = "starting"  # an order that was just given counts at once
        self.loaded = False  # true once the folder has been read
        self.text = ""  # why it failed
        self._has_begun = False
        self._request: Command | None = None
        self._asked_s = 0.0  # time of the request
        self._looker = LatestRunner("run", self, self._take, self._fail)
        self._timer = QTimer(self)
        self._timer.timeout.connect(self.poll)
        self._timer.start(self.poll_ms or POLL_MS)
        self.poll()

    # --- what subclasses say ----------------------------------------------------------------

    def inspect(self) -> Any:
        """Read further :attr:`facts` from disk, in the background."""
        return None

    # --- what is known ----------------------------------------------------------------------

    @property
    def path(self) -> Path:
        """Path of the folder."""
        return self.folder.path

    @property
    def process(self) -> ProcessId | None:
        """Process that was started for it, or that the folder names."""
        return self._launched or self.folder.process

    @property
    def under_way(self) -> bool:
        """True while a process works on it."""
        return self.phase in UNDER_WAY

    # --- steering ---------------------------------------------------------------------------

    def tell(self, word: Command) -> None:
        """Give the process an order, or raise OSError; only a cancel may follow a stop."""
        if not self.under_way or word == self._request:
            return
        if self._request in ("stop", "cancel") and word != "cancel":
            return
        if word == "stop" and self.history.saving:
            return
        self._request, self._asked_s = word, self._clock_s()
        self.phase = self._phase_under_way(word)
        if self.path.is_dir():
            write_control(self.folder.control, word)
        elif word in ("stop", "cancel") and self._launched is not None:
            # Not as far as its folder: there is nothing to keep.
            self._launched.terminate()
        self.phase_changed.emit()
        self.changed.emit()

    def delete(self) -> None:
        """Delete what it made; only after its end."""
        if not self.under_way:
            self.folder.discard()
            self.folder.output.unlink(missing_ok=True)

    def poll(self) -> None:
        """Look at the folder now, in the background, unless a look is under way."""
        if not self._looker.busy:
            self._looker.submit(lambda emit: self._look())

    def kill(self) -> None:
        """Stop following the run, and end its process at once."""
        self.close()
        process = self.process
        if process is not None:
            process.terminate(at_once=True)
            until_s = time.monotonic() + _CLOSING_S
            while process.is_alive and time.monotonic() < until_s:
                time.sleep(0.01)

    # --- looking ----------------------------------------------------------------------------

    def _look(self) -> _Status:
        folder = self.folder
        # The process first: when it is gone, all that it wrote is there to be read.
        launching = self._launched is not None and self._launched.is_alive
        live = folder.live
        state: State | None = None
        if folder.exists:
            with suppress(Sd2Error):  # deleted meanwhile, or damaged
                state = folder.state()
        process = folder.process
        # Read last: of a run that has ended, the lines are complete.
        return _Status(
            launching, live, folder.exists, state, process,
            read_control(folder.control), self._tail.new(), self.inspect(),
        )  # fmt: skip

    def _take(self, status: _Status) -> None:
        has_news = self.history.take(status.events)
        has_news |= status.facts != self.facts
        self.facts = status.facts
        if self._launched is None or status.live or _is_begun_by(status.process, self._launched):
            self._has_begun = True
        before, was_loaded = self.phase, self.loaded
        self.phase, self.loaded = self._phase_of(status), True
        self._obey(status)
        another = self.phase != before or not was_loaded
        if another:
            self._settle()
            self.phase_changed.emit()
        if has_news or another:
            self.changed.emit()
        if before in UNDER_WAY and self.phase not in UNDER_WAY:
            self.ended.emit()

    def _phase_of(self, status: _Status) -> Phase:
        if status.live:
            return self._phase_under_way(self._request or status.word)
        ended = status.state in ("finished", "stopped", "failed", "cancelled")
        if status.launching and not (self._has_begun and ended):
            # It is taking its folder while one looks, or about to exit.
            is_told = self._request in ("stop", "cancel")
            return self.phase if self._has_begun or is_told else "starting"
        if self._request == "cancel":
            # It may have ended before it could clear up.
            self.folder.discard()
            return "gone"
        if not self._has_begun:
            # Refused, or told to stop, before it had its folder.
            return "stopped" if self._request == "stop" else "failed"
        if not status.exists or status.state == "cancelled":
            return "gone"
        state = status.state
        if state in LIVE:
            return "starting"  # a process took it up between the two looks
        if state == "finished" or state == "stopped" or state == "failed":
            return state
        return "stopped" if self._request == "stop" else "died"  # it was ended for not stopping

    def _phase_under_way(self, word: Command) -> Phase:
        if word == "cancel":
            return "cancelling"
        if word == "stop":
            return "stopping"
        if not self.history.begun:
            return "starting"
        if self.history.paused:
            return "paused" if word == "pause" else "resuming"
        return "pausing" if word == "pause" else "running"

    def _obey(self, status: _Status) -> None:
        """Repeat an order that the process may not have heard; forget one that it has obeyed."""
        if self._request is None or not self.under_way:
            return
        if status.live and status.word != self._request:
            # It had no folder when the order was given, and may have cleared up meanwhile.
            with suppress(FileNotFoundError):
                write_control(self.folder.control, self._request)
        elif not status.live and self._request in ("stop", "cancel") and self._launched is not None:
            self._launched.terminate()
        elif self.phase == {"run": "running", "pause": "paused"}.get(self._request):
            self._request = None
        process = status.process if status.live else self._launched
        if process is None:
            return
        patiences_s = {"stop": self.stop_patience_s, "cancel": _CANCEL_PATIENCE_S}
        patience_s = patiences_s.get(self._request or "")
        if patience_s is not None and self._clock_s() - self._asked_s > patience_s:
            process.terminate(at_once=True)

    def _settle(self) -> None:
        """Take over another phase."""
        if self.phase in UNDER_WAY:
            return
        self._request = None
        output = self.folder.output
        lines = [line for line in last_output(output).splitlines() if not line.startswith("{")]
        message = "\n".join(lines)
        self.text = ""
        if self.phase == "failed":
            self.text = self.history.error or message.removeprefix("sd2: ") or _SILENT
        elif self.phase == "died":
            self.text = lines[-1] if lines else ""
        if self.phase in ("finished", "stopped", "gone") and output.parent != self.path:
            output.unlink(missing_ok=True)

    def _fail(self, error: Exception) -> None:
        # The disk is away for a moment; it is looked at again.
        if self.text != str(error):
            self.text = str(error)
            self.changed.emit()


class CommandRun(RunMonitor[CommandFolder]):
    """A command of ``sd2`` under way, or one that has ended."""

    folders = CommandFolder
    result_name: ClassVar[str] = ""
    """Of the file that is its result; empty where there is none."""

    def __init__(
        self, path: Path, parent: QObject | None = None, *, process: ProcessId | None = None
    ) -> None:
        self.about = CommandFolder(path).facts  # as noted at the start
        super().__init__(path, parent, process=process)

    @property
    def out(self) -> Path:
        """Path of what it makes."""
        return Path(str(self.about.get("out", self.path)))

    @property
    def result(self) -> Path | None:
        """Result; None where there is nothing yet."""
        path = self.out / self.result_name
        return path if self.result_name and path.is_file() else None


def _is_begun_by(process: ProcessId | None, launched: ProcessId) -> bool:
    """True if the process of a folder is the launched one, or one that this began: see Windows."""
    return process is not None and (
        launched.is_same(process) or process.started_unix_s > launched.started_unix_s
    )
