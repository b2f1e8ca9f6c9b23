"""Phases and kinds of model in words."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from sd2app.training.run import EpochPoint, TrainingHistory, TrainingMonitor
from sd2app.widgets.run_text import AT_WORK, PHASES
from sd2app.widgets.text import counted, error_text

if TYPE_CHECKING:
    from sd2core.train.data import Split

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
    if run.phase == "failed" and run.facts.has_model:
        return "The best model up to then is kept."
    if run.phase == "stopped" and run.facts.has_model:
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
    history, config = run.history, run.facts.config
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
