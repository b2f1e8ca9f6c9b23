"""Runs of ``sd2`` commands that the Train panel starts, other than trainings of denoisers."""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar

from PySide6.QtCore import QObject

from sd2app.background.run_monitor import RunMonitor
from sd2app.background.runs import KnownRun, Sentences
from sd2app.training.run import LearningHistory
from sd2app.widgets.text import about, clock_text, exact_text
from sd2core.processes import ProcessId
from sd2core.runs.command_folder import CommandFolder, commands_in
from sd2core.runs.pace import Pace

SENTENCES = Sentences(
    busy="{} is under way. Wait for it, or stop it.",
    found="{} is under way. The Train panel shows it.",
    finished="{} is done. The Train panel shows what came of it.",
    failed="{} did not come to its end. The Train panel says more.",
)
PHASES = {
    "starting": "Starting…",
    "stopping": "Stopping…",
    "cancelling": "Cancelling…",
    "finished": "Finished",
    "stopped": "Stopped",
    "failed": "It failed",
    "died": "Its process is gone",
    "gone": "",
}
_STATES = {0: "finished", 130: "stopped", None: "not ended"}


class PacedHistory(LearningHistory):
    """Steps of which the number is known, and the pace at which they are done."""

    def __init__(self) -> None:
        super().__init__()
        self.total = 0
        self._pace = Pace()

    @property
    def share(self) -> float | None:
        """Share of the whole that is done; None while that is not known."""
        return min(self.steps_done / self.total, 1.0) if self.total else None

    @property
    def left_s(self) -> float | None:
        """Time left at the pace so far; None until that can be told."""
        return None if self.saving else self._pace.left_s(self.total - self.steps_done)

    def _advance(self, steps: int, elapsed_s: float) -> None:
        super()._advance(steps, elapsed_s)
        if self.elapsed_s is not None:
            self._pace.take(steps, self.elapsed_s)


class CommandRun(RunMonitor[CommandFolder]):
    """A command under way, or one that has ended."""

    history: PacedHistory
    histories: ClassVar[type[PacedHistory]]
    facts = False  # there is a result

    def __init__(
        self, path: Path, parent: QObject | None = None, *, process: ProcessId | None = None
    ) -> None:
        folder = CommandFolder(path)
        self.about = folder.facts
        super().__init__(folder, parent, history=self.histories(), process=process)

    @property
    def time_text(self) -> str:
        """Elapsed time, and time left."""
        history, parts = self.history, []
        if self.phase == "running" and history.left_s is not None:
            parts.append(f"{about(history.left_s)} left")
        if history.elapsed_s is not None:
            passed = exact_text(history.elapsed_s)
            parts.append(f"{passed} so far" if self.under_way else f"took {passed}")
        return " · ".join(parts)


def known_commands(folder: Path, what: str = "") -> list[KnownRun]:
    """Return the commands of a folder, titled by what they are, or else by their names."""
    return [KnownRun(one.path, _title(one, what), one.live) for one in commands_in(folder)]


def _title(folder: CommandFolder, what: str) -> str:
    state = "under way" if folder.live else _STATES.get(folder.code, "failed")
    started = clock_text(folder.facts.get("started_unix_s", 0.0))
    return f"{started} · {what or folder.path.name} · {state}"
