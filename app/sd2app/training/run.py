"""Training run of a denoiser: its monitor, and what it told."""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple, TypeVar

from sd2app.background.run_monitor import History, RunMonitor, reason_in
from sd2core.errors import Sd2Error
from sd2core.options.training import TrainConfig
from sd2core.runs.pace import Throughput
from sd2core.train.config import read_config
from sd2core.train.folder import TrainingFolder

T = TypeVar("T")

_MAX_POINTS = 2000
"""Limit of kept steps; beyond it, every second one is dropped."""


class StepHistory(History):
    """Steps of which the number may be known, and the pace at which they are done."""

    def __init__(self) -> None:
        self.begun = False
        self._pace = Throughput()
        self._stride, self._skipped = 1, 0

    @property
    def left_s(self) -> float | None:
        """Time left at the pace so far; None until that can be told."""
        return None if self.saving else self._pace.left_s(self.total - self.done)

    def _advance(self, steps: int, elapsed_s: float) -> None:
        self.done = steps
        if 0 <= elapsed_s < math.inf:
            self.elapsed_s = elapsed_s
            self._pace.take(steps, elapsed_s)

    def _note(self, points: list[T], point: T) -> None:
        """Keep a point of every step, or of every so many where there are too many."""
        self._skipped += 1
        if self._skipped >= self._stride:
            self._skipped = 0
            points.append(point)
            if len(points) > _MAX_POINTS:
                del points[1::2]
                self._stride *= 2


class StepPoint(NamedTuple):
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


class TrainingHistory(StepHistory):
    """Steps and epochs of the training of a denoiser."""

    left_s: float | None = None  # as its process says
    model = device = ""
    parameters = segments = epochs = steps_per_epoch = 0
    epoch = 0  # under way, from 1; zero before the first
    minutes = 0.0
    simulated = False  # the radar that is learnt from

    def __init__(self) -> None:
        super().__init__()
        self.step_points: list[StepPoint] = []
        self.epoch_points: list[EpochPoint] = []

    @property
    def best(self) -> EpochPoint | None:
        """The best epoch so far."""
        return next((point for point in reversed(self.epoch_points) if point.best), None)

    @property
    def share(self) -> float | None:
        """Share of the whole that is done; None while that is not known."""
        if not self.total and self.minutes and self.elapsed_s is not None:
            return min(self.elapsed_s / (60.0 * self.minutes), 1.0)
        return super().share

    def _start(self, event: dict[str, Any]) -> None:
        steps_per_epoch, epochs = _count(event["steps_per_epoch"], 1), _count(event.get("epochs"))
        minutes, done = _number(event.get("minutes")), _count(event.get("steps_done"))
        parameters = _count(event.get("parameters"))
        segments = _count(event.get("train_segments"))
        self.model, self.device = str(event["model"]), str(event.get("device", ""))
        self.epochs, self.steps_per_epoch = epochs, steps_per_epoch
        self.total, self.minutes = epochs * steps_per_epoch, minutes if minutes > 0 else 0.0
        self.parameters, self.segments = parameters, segments
        self.simulated = event.get("kind") == "simulated"
        # What was done after the checkpoint is done again.
        self.done = done if event.get("resumed") else 0
        at = self.done / self.steps_per_epoch if self.steps_per_epoch else 0.0
        self.step_points = [point for point in self.step_points if point.at <= at]
        self.epoch_points = [point for point in self.epoch_points if point.epoch <= at]
        self.epoch = math.ceil(at)
        self.left_s = None
        self.begun, self.paused = True, False
        self.error = ""

    def _stepped(self, event: dict[str, Any]) -> None:
        # Counted from the start of the run.
        step, rmse = _count(event["step"]), _number(event.get("train_rmse"))
        self._go_to(_count(event["epoch"], 1), step, event)
        if math.isfinite(rmse) and rmse > 0:
            self._note(self.step_points, StepPoint(step / max(self.steps_per_epoch, 1), rmse))

    def _go_to(self, epoch: int, steps: int, event: dict[str, Any]) -> None:
        elapsed_s, left_s = _number(event.get("elapsed_s")), _number(event.get("left_s"))
        self.epoch = epoch
        self.left_s = left_s if 0 <= left_s < math.inf else None
        self._advance(steps, elapsed_s)

    def _epoch_done(self, event: dict[str, Any]) -> None:
        epoch = _count(event["epoch"], 1)
        point = EpochPoint(
            epoch,
            _number(event.get("train_rmse")),
            _number(event.get("validation_rmse")),
            _number(event.get("validation_mae_mps")),
            bool(event.get("best")),
        )
        self._go_to(epoch, epoch * self.steps_per_epoch, event)
        # Told twice when it was done twice.
        self.epoch_points = [one for one in self.epoch_points if one.epoch < epoch]
        self.epoch_points.append(point)

    def _ended(self, event: dict[str, Any]) -> None:
        # Lines before the next start do not say that it works.
        self.begun, self.paused, self.left_s = False, False, None
        self.error = reason_in(event)

    def _pause(self, event: dict[str, Any]) -> None:
        self.paused = True

    def _go_on(self, event: dict[str, Any]) -> None:
        self.paused = False

    readers: ClassVar = {
        "start": _start,
        "step": _stepped,
        "epoch": _epoch_done,
        "paused": _pause,
        "resumed": _go_on,
        "end": _ended,
    }


class TrainingFacts(NamedTuple):
    """Facts about the files of a run."""

    config: TrainConfig | None = None  # its settings; None until they can be read
    has_model: bool = False  # there is one to use
    has_checkpoint: bool = False


class TrainingMonitor(RunMonitor[TrainingFolder]):
    """A training run with its settings and its history of epochs."""

    folders, histories = TrainingFolder, TrainingHistory
    history: TrainingHistory
    facts = TrainingFacts()

    def inspect(self) -> TrainingFacts:
        """Read the settings, and look which models are there."""
        folder, config = self.folder, self.facts.config
        if config is None and folder.exists:
            with suppress(Sd2Error):  # not written yet
                config = read_config(folder.config)
        return TrainingFacts(config, folder.best.exists(), folder.last.exists())

    @property
    def resumable(self) -> bool:
        """True if it can be resumed."""
        return self.facts.has_checkpoint and self.phase in ("stopped", "failed", "died")


def _count(value: Any, least: int = 0) -> int:
    """Whole number; zero if not reported."""
    count = 0 if value is None else int(value)
    if count < least:
        raise ValueError(f"{value!r}")
    return count


def _number(value: Any) -> float:
    """Number; NaN if not reported."""
    return math.nan if value is None else float(value)
