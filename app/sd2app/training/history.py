"""History of a training run, read from its lines of progress."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Literal, get_args

from sd2app.background.run_monitor import take_lines
from sd2core.errors import Sd2Error

Outcome = Literal["finished", "stopped", "cancelled", "failed"]

_MOST_STEPS = 2000
"""Limit of kept steps; beyond it, every second one is dropped."""


@dataclass(frozen=True)
class StepPoint:
    """Error on the batches up to a step."""

    at: float  # in epochs: 1.5 is the middle of the second
    train_rmse: float


@dataclass(frozen=True)
class EpochPoint:
    """Errors after an epoch; NaN if not reported."""

    epoch: int  # from 1
    train_rmse: float
    validation_rmse: float
    validation_mae_mps: float  # of the peak velocity per frame
    best: bool  # better than all before


class TrainingHistory:
    """Steps and epochs of a run, read from its lines; damaged lines are left out."""

    def __init__(self) -> None:
        self.model = ""
        self.device = ""
        self.parameters = 0
        self.epochs = 0
        self.minutes = 0.0
        self.steps_per_epoch = 0
        self.segments = 0
        self.begun = False
        self.paused = False
        self.elapsed_s: float | None = None
        self.left_s: float | None = None
        self.step_points: list[StepPoint] = []
        self.epoch_points: list[EpochPoint] = []
        self.steps_done = 0
        self.outcome: Outcome | None = None
        self.error = ""
        self._epoch = 0
        self._stride, self._skipped = 1, 0

    # --- what is known --------------------------------------------------------------------

    @property
    def epoch(self) -> int:
        """Number of the epoch under way, from 1; zero before the first."""
        return self._epoch

    @property
    def best(self) -> EpochPoint | None:
        """The best epoch so far."""
        marked = [point for point in self.epoch_points if point.best]
        return marked[-1] if marked else None

    @property
    def share(self) -> float | None:
        """Share of the whole that is done; None while that is not known."""
        total = self.epochs * self.steps_per_epoch
        if total:
            return min(self.steps_done / total, 1.0)
        if self.minutes and self.elapsed_s is not None:
            return min(self.elapsed_s / (60.0 * self.minutes), 1.0)
        return None

    # --- taking lines ---------------------------------------------------------------------

    def take(self, events: Iterable[dict[str, Any]]) -> bool:
        """Take lines; True if any of them was of use."""
        return take_lines(self, _READERS, events)

    def _start(self, event: dict[str, Any]) -> None:
        steps_per_epoch, epochs = _count(event["steps_per_epoch"], 1), _count(event.get("epochs"))
        minutes, done = _number(event.get("minutes")), _count(event.get("steps_done"))
        parameters = _count(event.get("parameters"))
        segments = _count(event.get("train_segments"))
        self.model, self.device = str(event["model"]), str(event.get("device", ""))
        self.epochs, self.steps_per_epoch = epochs, steps_per_epoch
        self.minutes = minutes if minutes > 0 else 0.0
        self.parameters, self.segments = parameters, segments
        # What was done after the checkpoint is done again.
        self._go_back(done if event.get("resumed") else 0)
        self.begun, self.paused = True, False
        self.outcome, self.error = None, ""

    def _go_back(self, steps: int) -> None:
        at = steps / self.steps_per_epoch if self.steps_per_epoch else 0.0
        self.step_points = [point for point in self.step_points if point.at <= at]
        self.epoch_points = [point for point in self.epoch_points if point.epoch <= at]
        self.steps_done = steps
        self._epoch = math.ceil(at)
        self.left_s = None

    def _stepped(self, event: dict[str, Any]) -> None:
        # Counted from the start of the run.
        step, rmse = _count(event["step"]), _number(event.get("train_rmse"))
        self._advance(_count(event["epoch"], 1), step, event)
        self._skipped += 1
        if math.isfinite(rmse) and rmse > 0 and self._skipped >= self._stride:
            self._skipped = 0
            self.step_points.append(StepPoint(step / max(self.steps_per_epoch, 1), rmse))
            if len(self.step_points) > _MOST_STEPS:
                self.step_points = self.step_points[::2]
                self._stride *= 2

    def _advance(self, epoch: int, steps: int, event: dict[str, Any]) -> None:
        elapsed_s, left_s = _number(event.get("elapsed_s")), _number(event.get("left_s"))
        self._epoch, self.steps_done = epoch, steps
        self.left_s = left_s if 0 <= left_s < math.inf else None
        if 0 <= elapsed_s < math.inf:
            self.elapsed_s = elapsed_s

    def _epoch_done(self, event: dict[str, Any]) -> None:
        epoch = _count(event["epoch"], 1)
        point = EpochPoint(
            epoch,
            _number(event.get("train_rmse")),
            _number(event.get("validation_rmse")),
            _number(event.get("validation_mae_mps")),
            bool(event.get("best")),
        )
        self._advance(epoch, epoch * self.steps_per_epoch, event)
        # Told twice when it was done twice.
        self.epoch_points = [one for one in self.epoch_points if one.epoch < epoch]
        self.epoch_points.append(point)

    def _ended(self, event: dict[str, Any]) -> None:
        outcome = event["outcome"]
        if outcome not in get_args(Outcome):
            raise ValueError(f"outcome {outcome!r}")
        self.outcome, self.paused, self.left_s = outcome, False, None
        error = event.get("error")
        if isinstance(error, dict):
            parts = (str(error.get(key) or "") for key in ("found", "expected", "remedy"))
            self.error = str(Sd2Error(*parts))

    def _pause(self, event: dict[str, Any]) -> None:
        self.paused = True

    def _go_on(self, event: dict[str, Any]) -> None:
        self.paused = False


def _count(value: Any, least: int = 0) -> int:
    """Whole number; zero if not reported."""
    count = 0 if value is None else int(value)
    if count < least:
        raise ValueError(f"{value!r}")
    return count


def _number(value: Any) -> float:
    """Number; NaN if not reported."""
    return math.nan if value is None else float(value)


_READERS = {
    "start": TrainingHistory._start,
    "step": TrainingHistory._stepped,
    "epoch": TrainingHistory._epoch_done,
    "paused": TrainingHistory._pause,
    "resumed": TrainingHistory._go_on,
    "end": TrainingHistory._ended,
}


@dataclass(frozen=True)
class Improvement:
    """Mean error of the peak velocity per frame, against the radar's map of the recording.

    ``plain_mps`` is that of the synthetic map, ``before_mps`` of the model that was in use before,
    if there was one; ``frames`` is the number of frames with both maps.
    """

    plain_mps: float
    before_mps: float | None
    now_mps: float
    before_title: str
    frames: int
    simulated: bool
