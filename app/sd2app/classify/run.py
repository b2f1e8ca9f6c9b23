"""Monitor of one training or comparison of classifiers, and what it told."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from PySide6.QtCore import QObject

from sd2app.background.run_command import CommandFolder
from sd2app.background.run_monitor import RunMonitor, take_lines
from sd2core.processes import ProcessId
from sd2core.runs.pace import Pace

MODEL_NAME = "classifier.safetensors"
TABLE_NAME = "table"
_MOST_POINTS = 1000
"""Limit of kept losses; beyond it, every second one is dropped."""


class LossPoint(NamedTuple):
    """Cross entropy of a batch."""

    step: int
    loss: float


class CheckPoint(NamedTuple):
    """Mean recall over classes, on the people held out to select the best model."""

    step: int
    recall: float
    best: bool


class ClassHistory:
    """Steps and checks of a run, read from its lines; damaged lines are left out."""

    def __init__(self) -> None:
        self.total = 0
        self.done = 0
        self.clips = 0
        self.elapsed_s: float | None = None
        self.losses: list[LossPoint] = []
        self.checks: list[CheckPoint] = []
        self.begun = False
        self.saving = False
        self._stride, self._skipped = 1, 0
        self._pace = Pace()

    @property
    def share(self) -> float | None:
        """Share of the whole that is done; None while that is not known."""
        return min(self.done / self.total, 1.0) if self.total else None

    @property
    def left_s(self) -> float | None:
        """Time left at the pace so far; None until that can be told."""
        return None if self.saving else self._pace.left_s(self.total - self.done)

    @property
    def best(self) -> CheckPoint | None:
        """The best check so far."""
        marked = [check for check in self.checks if check.best]
        return marked[-1] if marked else None

    def take(self, events: Iterable[dict[str, Any]]) -> bool:
        """Read lines; True if any was of use."""
        return take_lines(self, _READERS, events)

    def _start(self, event: dict[str, Any]) -> None:
        self.total, self.clips = int(event["steps"]), int(event.get("clips", 0))
        self.begun = True

    def _step(self, event: dict[str, Any]) -> None:
        step, loss = int(event["step"]), float(event["loss"])
        self._advance(step, float(event["elapsed_s"]))
        self._skipped += 1
        if math.isfinite(loss) and self._skipped >= self._stride:
            self._skipped = 0
            self.losses.append(LossPoint(step, loss))
            if len(self.losses) > _MOST_POINTS:
                self.losses = self.losses[::2]
                self._stride *= 2

    def _check(self, event: dict[str, Any]) -> None:
        step, recall = int(event["step"]), float(event["validation_mean_recall"])
        best = self.best
        self.checks.append(CheckPoint(step, recall, best is None or recall > best.recall))

    def _training_done(self, event: dict[str, Any]) -> None:
        """Count one of several trainings of a comparison."""
        self.total, self.begun = int(event["total"]), True
        self._advance(int(event["done"]), float(event["elapsed_s"]))

    def _end(self, event: dict[str, Any]) -> None:
        self.saving = True

    def _advance(self, done: int, elapsed_s: float) -> None:
        self.done = done
        if 0 <= elapsed_s < math.inf:
            self.elapsed_s = elapsed_s
            self._pace.take(done, elapsed_s)


_READERS = {
    "start": ClassHistory._start,
    "step": ClassHistory._step,
    "check": ClassHistory._check,
    "run": ClassHistory._training_done,
    "end": ClassHistory._end,
}


class ClassRun(RunMonitor[CommandFolder]):
    """A training or a comparison."""

    def __init__(
        self, path: Path, parent: QObject | None = None, *, process: ProcessId | None = None
    ) -> None:
        folder = CommandFolder(path)
        self.about = folder.facts
        self.history = ClassHistory()
        self._has_result = False
        super().__init__(folder, parent, process=process)

    @property
    def compares(self) -> bool:
        """True for a comparison."""
        return self.about.get("what") == "table"

    @property
    def result(self) -> Path | None:
        """The model, or the folder with the tables; None where there is none."""
        return self.path / self._result_name if self._has_result else None

    def on_events(self, events: Sequence[dict[str, Any]]) -> bool:
        """Read steps, checks and trainings that are done."""
        return self.history.take(events)

    @property
    def has_started(self) -> bool:
        """True once the data has been read."""
        return self.history.begun

    @property
    def share(self) -> float | None:
        """Share of the whole that is done; None while that is not known."""
        return self.history.share

    @property
    def is_saving(self) -> bool:
        """True while the model is written."""
        return self.history.saving

    def inspect(self) -> bool:
        """Check for a model, or a complete table."""
        result = self.path / self._result_name
        return (result / "table.json" if self.compares else result).is_file()

    def on_facts(self, facts: bool) -> None:
        """Store the facts."""
        self._has_result = facts

    @property
    def _result_name(self) -> str:
        return TABLE_NAME if self.compares else MODEL_NAME
