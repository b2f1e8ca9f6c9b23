"""Training run of a denoiser: its monitor, what it told, and that in words."""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from sd2app.background.run_monitor import History, RunMonitor, reason_in
from sd2app.widgets.run_text import AT_WORK, PHASES
from sd2app.widgets.text import counted, error_text
from sd2core.errors import Sd2Error
from sd2core.options.training import TrainConfig
from sd2core.runs.pace import Throughput
from sd2core.train.config import read_config
from sd2core.train.folder import TrainingFolder

if TYPE_CHECKING:
    from sd2core.train.data import Split


class StepHistory(History):
    """Steps of which the number may be known, and the pace at which they are done."""

    def __init__(self) -> None:
        self.begun = False
        self._pace = Throughput()

    @property
    def left_s(self) -> float | None:
        """Time left at the pace so far; None until that can be told."""
        return None if self.saving else self._pace.left_s(self.total - self.done)

    def _advance(self, steps: int, elapsed_s: float) -> None:
        self.done = steps
        if 0 <= elapsed_s < math.inf:
            self.elapsed_s = elapsed_s
            self._pace.take(steps, elapsed_s)


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
        # Place in epochs, 1.5 in the middle of the second, and error on the batches up to there.
        self.step_points: list[tuple[float, float]] = []
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

    def _take_start(self, event: dict[str, Any]) -> None:
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
        self.step_points = [point for point in self.step_points if point[0] <= at]
        self.epoch_points = [point for point in self.epoch_points if point.epoch <= at]
        self.epoch = math.ceil(at)
        self.left_s = None
        self.begun, self.paused = True, False
        self.error = ""

    def _take_step(self, event: dict[str, Any]) -> None:
        # Counted from the start of the run.
        step, rmse = _count(event["step"]), _number(event.get("train_rmse"))
        self._go_to(_count(event["epoch"], 1), step, event)
        if math.isfinite(rmse) and rmse > 0:
            self.step_points.append((step / max(self.steps_per_epoch, 1), rmse))

    def _go_to(self, epoch: int, steps: int, event: dict[str, Any]) -> None:
        elapsed_s, left_s = _number(event.get("elapsed_s")), _number(event.get("left_s"))
        self.epoch = epoch
        self.left_s = left_s if 0 <= left_s < math.inf else None
        self._advance(steps, elapsed_s)

    def _take_epoch(self, event: dict[str, Any]) -> None:
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

    def _take_end(self, event: dict[str, Any]) -> None:
        # Lines before the next start do not say that it works.
        self.begun, self.paused, self.left_s = False, False, None
        self.error = reason_in(event)

    def _take_paused(self, event: dict[str, Any]) -> None:
        self.paused = True

    def _take_resumed(self, event: dict[str, Any]) -> None:
        self.paused = False


class TrainingMonitor(RunMonitor[TrainingFolder]):
    """A training run with its settings and its history of epochs."""

    folders, histories = TrainingFolder, TrainingHistory
    history: TrainingHistory
    config: TrainConfig | None = None  # its settings; None until they can be read

    def inspect(self) -> None:
        """Read the settings."""
        if self.config is None and self.folder.exists:
            with suppress(Sd2Error):  # not written yet
                self.config = read_config(self.folder.config)

    @property
    def has_model(self) -> bool:
        """True if there is one to use."""
        return self.folder.best.exists()

    @property
    def resumable(self) -> bool:
        """True if it can be resumed."""
        return self.phase in ("stopped", "failed", "died") and self.folder.last.exists()


def _count(value: Any, least: int = 0) -> int:
    """Whole number; zero if not reported."""
    count = 0 if value is None else int(value)
    if count < least:
        raise ValueError(f"{value!r}")
    return count


def _number(value: Any) -> float:
    """Number; NaN if not reported."""
    return math.nan if value is None else float(value)


MODEL_WORDS = {
    "s4": ("S4", "The paper's: a structured state space. It also runs frame by frame."),
    "s4d": ("S4, diagonal", "S4 with a diagonal state matrix: faster, often as good."),
    "gru": ("GRU", "A recurrent network of the same size. It also runs frame by frame."),
    "unet": ("U-Net", "Convolutions over windows of 72 frames."),
    "swin": ("Swin transformer", "Attention over windows of 72 frames."),
    "s4-serial": ("S4, serialised", "All cells as one long channel; slow, kept for comparison."),
}

INPUT_WORDS = {
    "map": "The map",
    "limbs": "The map of each part of the body",
    "kinematics": "How the joints move",
}

_PHASES = PHASES | {"running": "Training", "stopping": "Stopping, the best model is kept…"}


def model_name(model: str) -> str:
    """Name of a kind of model."""
    return MODEL_WORDS.get(model, (model, ""))[0]


def point_text(point: EpochPoint) -> str:
    """Errors of an epoch, one row each."""
    lines = [f"Epoch {point.epoch}" + (", better than all before" if point.best else "")]
    for name, value, unit in (
        ("Training RMSE", point.train_rmse, ""),
        ("Validation RMSE", point.validation_rmse, ""),
        ("Peak velocity off by", point.validation_mae_mps, " m/s on average"),
    ):
        if math.isfinite(value):
            lines.append(f"{name} {error_text(value)}{unit}")
    return "\n".join(lines)


def division_text(
    division: Split, judged_by: str = "sd2 eval", kept_takes: str = "the last takes"
) -> str:
    """Division of people in words; ``kept_takes`` are for validation where there is one person."""
    if division.by_take:
        return (
            f"All of it is of one person: {kept_takes} choose the best model, and how good it is"
            " with other people stays unknown."
        )
    text = f"Learns from {counted(len(division.training), 'person', 'people')}"
    text += f"; the best model is chosen by {_listed(division.validation)}"
    if division.test:
        text += f"; {_listed(division.test)} kept for {judged_by}"
    return text + "."


def _listed(names: tuple[str, ...]) -> str:
    if len(names) > 3:
        return f"{len(names)} others"
    return " and ".join(filter(None, [", ".join(names[:-1]), names[-1]]))


def headline(run: TrainingMonitor) -> str:
    """Phase and progress of a run."""
    phase, history = run.phase, run.history
    if not run.loaded:
        return "Looking…"
    text = _PHASES[phase]
    if phase in AT_WORK and history.epoch:
        of = f" of {history.epochs:,}" if history.epochs else ""
        return f"{text} · epoch {history.epoch:,}{of}"
    if phase in ("finished", "stopped", "failed", "died") and history.epoch_points:
        return f"{text} after {counted(history.epoch_points[-1].epoch, 'epoch')}"
    return text


def remedy_text(run: TrainingMonitor) -> str:
    """Advice for a run that did not reach its end."""
    if run.phase == "died":
        text = "Its process is gone: it was killed, or the machine was switched off."
        if run.resumable:
            return f"{text} Resume goes on from the last checkpoint, with the same result."
        return f"{text} It had not come to its first checkpoint: start it again."
    if run.phase == "failed" and run.has_model:
        return "The best model up to then is kept."
    if run.phase == "stopped" and run.has_model:
        return "The best model is kept. Resume goes on where it ended."
    return ""


def metric_rows(history: TrainingHistory) -> list[tuple[str, str]]:
    """The best epoch in figures."""
    best = history.best
    if best is None:
        return []
    rows = [("Best epoch", f"{best.epoch:,}")]
    if math.isfinite(best.validation_rmse):
        rows.append(("Validation RMSE", error_text(best.validation_rmse)))
    if math.isfinite(best.validation_mae_mps):
        rows.append(("Peak velocity, MAE", f"{error_text(best.validation_mae_mps)} m/s"))
    return rows


def about_text(run: TrainingMonitor) -> str:
    """Model and data of a run."""
    history, config = run.history, run.config
    parts = [model_name(history.model)] if history.model else []
    if history.parameters:
        parts.append(f"{history.parameters:,} parameters")
    if config is not None:
        parts.append(", ".join(path.name for path in config.data.pairs))
        parts.append(f"batch {config.training.batch_size}, seed {config.training.seed}")
    if history.segments:
        of = " of a simulated radar" if history.simulated else ""
        parts.append(f"{history.segments:,} segments{of}")
    if history.device:
        parts.append("GPU" if history.device.startswith("cuda") else history.device.upper())
    return " · ".join(parts)
