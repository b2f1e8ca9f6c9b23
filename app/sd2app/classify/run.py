"""Training of a classifier: its monitor, and what it told."""

from __future__ import annotations

import math
from typing import Any, ClassVar, NamedTuple

from sd2app.background.run_monitor import CommandRun
from sd2app.training.run import StepHistory

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


class ClassHistory(StepHistory):
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

    readers: ClassVar = {"start": _start, "step": _step, "check": _check, "end": _end}


class ClassRun(CommandRun):
    """A training."""

    histories = ClassHistory
    history: ClassHistory
    result_name = MODEL_NAME
