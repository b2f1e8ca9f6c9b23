"""Training of a classifier: its monitor, and what it told."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

from PySide6.QtCore import QObject

from sd2app.background.run_monitor import RunMonitor
from sd2app.training.run import LearningHistory
from sd2core.processes import ProcessId
from sd2core.runs.command_folder import CommandFolder
from sd2core.runs.pace import Pace

MODEL_NAME = "classifier.safetensors"


class LossPoint(NamedTuple):
    """Cross entropy of a batch."""

    step: int
    loss: float


class CheckPoint(NamedTuple):
    """Mean recall over classes, on the people held out to select the best model."""

    step: int
    recall: float
    best: bool


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


class ClassHistory(PacedHistory):
    """Steps and checks of a training."""

    def __init__(self) -> None:
        super().__init__()
        self.losses: list[LossPoint] = []
        self.checks: list[CheckPoint] = []

    @property
    def best(self) -> CheckPoint | None:
        """The best check so far."""
        return next((check for check in reversed(self.checks) if check.best), None)

    def _start(self, event: dict[str, Any]) -> None:
        self.total, self.begun = int(event["steps"]), True

    def _step(self, event: dict[str, Any]) -> None:
        step, loss = int(event["step"]), float(event["loss"])
        self._advance(step, float(event["elapsed_s"]))
        if math.isfinite(loss):
            self._note(self.losses, LossPoint(step, loss))

    def _check(self, event: dict[str, Any]) -> None:
        step, recall = int(event["step"]), float(event["validation_mean_recall"])
        best = self.best
        self.checks.append(CheckPoint(step, recall, best is None or recall > best.recall))

    def _end(self, event: dict[str, Any]) -> None:
        self.saving = True

    readers: ClassVar = {
        "start": _start,
        "step": _step,
        "check": _check,
        "end": _end,
    }


class ClassRun(RunMonitor[CommandFolder]):
    """A training."""

    history: ClassHistory
    facts = False  # there is a result

    def __init__(
        self, path: Path, parent: QObject | None = None, *, process: ProcessId | None = None
    ) -> None:
        folder = CommandFolder(path)
        self.about = folder.facts
        super().__init__(folder, parent, history=ClassHistory(), process=process)

    @property
    def result(self) -> Path | None:
        """The model; None where there is none."""
        return self.path / MODEL_NAME if self.facts else None

    def inspect(self) -> bool:
        """Check for a model."""
        return (self.path / MODEL_NAME).is_file()
