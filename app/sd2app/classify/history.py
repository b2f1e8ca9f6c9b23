"""What the training of classifiers has told so far, put together from its lines."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, NamedTuple

from sd2app.background.event_lines import take_lines

_MOST_POINTS = 1000
"""Beyond that, every second loss is forgotten: no screen shows more."""


class LossPoint(NamedTuple):
    """Cross entropy of a batch."""

    step: int
    loss: float


class CheckPoint(NamedTuple):
    """Mean recall of frames over classes, of the people who choose the best model."""

    step: int
    recall: float
    best: bool


class ClassHistory:
    """Takes lines one after another; what it cannot read it leaves out."""

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
        self._first: tuple[int, float] | None = None

    @property
    def share(self) -> float | None:
        """Share of the whole that is done; None while that is not known."""
        return min(self.done / self.total, 1.0) if self.total else None

    @property
    def step_s(self) -> float | None:
        """Time of a step, or of a training of a comparison; None until that can be told."""
        if self._first is None or self.elapsed_s is None:
            return None
        done, since_s = self._first
        return (self.elapsed_s - since_s) / (self.done - done) if self.done > done else None

    @property
    def left_s(self) -> float | None:
        """As long as it has taken so far, for what is left; None until that can be told."""
        step_s = self.step_s
        return None if step_s is None or self.saving else step_s * (self.total - self.done)

    @property
    def best(self) -> CheckPoint | None:
        """The best look so far."""
        marked = [check for check in self.checks if check.best]
        return marked[-1] if marked else None

    def take(self, events: Iterable[dict[str, Any]]) -> bool:
        """Take lines; whether any of them was of use."""
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

    def _run(self, event: dict[str, Any]) -> None:
        """One of several trainings of a comparison is done."""
        self.total, self.begun = int(event["total"]), True
        self._advance(int(event["done"]), float(event["elapsed_s"]))

    def _end(self, event: dict[str, Any]) -> None:
        self.saving = True

    def _advance(self, done: int, elapsed_s: float) -> None:
        self.done = done
        if 0 <= elapsed_s < math.inf:
            self.elapsed_s = elapsed_s
            if self._first is None:
                self._first = (done, elapsed_s)


_READERS = {
    "start": ClassHistory._start,
    "step": ClassHistory._step,
    "check": ClassHistory._check,
    "run": ClassHistory._run,
    "end": ClassHistory._end,
}
