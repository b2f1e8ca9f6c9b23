"""Durations, phases and kinds of model in words."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from sd2app.background.run_monitor import Phase
from sd2app.training.history import EpochPoint
from sd2app.widgets.text import about, duration_text, error_text, exact_text

if TYPE_CHECKING:
    from sd2app.training.history import Improvement, TrainingHistory
    from sd2app.training.run import TrainingMonitor
    from sd2core.pairs.summary import PairFacts
    from sd2core.runs.folder import State
    from sd2core.train.data import Split

MODEL_WORDS = {
    "s4": ("S4", "The paper's: a structured state space. It also runs frame by frame."),
    "s4d": ("S4, diagonal", "S4 with a diagonal state matrix: faster, often as good."),
    "s4-serial": ("S4, serialised", "All cells as one long channel; slow, kept for comparison."),
    "gru": ("GRU", "A recurrent network of the same size. It also runs frame by frame."),
    "unet": ("U-Net", "Convolutions over windows of 72 frames."),
    "swin": ("Swin transformer", "Attention over windows of 72 frames."),
}

_PHASES: dict[Phase, str] = {
    "starting": "Starting…",
    "running": "Training",
    "pausing": "Pausing…",
    "paused": "Paused",
    "resuming": "Going on…",
    "stopping": "Stopping, the best model is kept…",
    "cancelling": "Cancelling…",
    "finished": "Finished",
    "stopped": "Stopped",
    "failed": "Failed",
    "died": "Ended unexpectedly",
    "gone": "Cancelled",
}


def model_name(model: str) -> str:
    """Name of a kind of model."""
    return MODEL_WORDS.get(model, (model, ""))[0]


def phase_text(phase: Phase) -> str:
    """Current state of a run."""
    return _PHASES[phase]


def state_text(state: State) -> str:
    """State of a run, for a list."""
    return {"died": "ended unexpectedly", "running": "training"}.get(state, state)


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


def store_text(facts: PairFacts | None) -> str:
    """Content of a store of pairs in words."""
    if facts is None:
        return "…"
    people = len(facts.subjects)
    parts = [
        facts.kind,
        f"{people} {'person' if people == 1 else 'people'}",
        duration_text(facts.duration_s),
    ]
    if facts.placements > 1:
        parts.append(f"{facts.placements} placements")
    return " · ".join(parts)


def division_text(
    division: Split, judged_by: str = "sd2 eval", kept_takes: str = "the last takes"
) -> str:
    """Division of people in words; ``kept_takes`` are for validation where there is one person."""
    if division.by_take:
        return (
            f"All of it is of one person: {kept_takes} choose the best model, and how good it is"
            " with other people stays unknown."
        )
    count = len(division.training)
    text = f"Learns from {count} {'person' if count == 1 else 'people'}"
    text += f"; the best model is chosen by {_listed(division.validation)}"
    if division.test:
        text += f"; {_listed(division.test)} kept for {judged_by}"
    return text + "."


def _listed(names: tuple[str, ...]) -> str:
    if len(names) > 3:
        return f"{len(names)} others"
    return " and ".join(filter(None, [", ".join(names[:-1]), names[-1]]))


def steps_text(steps: int) -> str:
    """Number of steps, such as ``160 steps``."""
    return f"{steps:,} {'step' if steps == 1 else 'steps'}"


def headline(run: TrainingMonitor) -> str:
    """Phase and progress of a run."""
    phase, history = run.phase, run.history
    if not run.loaded:
        return "Looking…"
    text = phase_text(phase)
    if phase in ("running", "pausing", "paused", "resuming") and history.epoch:
        of = f" of {history.epochs:,}" if history.epochs else ""
        return f"{text} · epoch {history.epoch:,}{of}"
    if phase in ("finished", "stopped", "failed", "died") and history.epoch_points:
        done = history.epoch_points[-1].epoch
        return f"{text} after {done:,} {'epoch' if done == 1 else 'epochs'}"
    return text


def time_text(run: TrainingMonitor) -> str:
    """Elapsed time and time left."""
    history, parts = run.history, []
    if run.phase in ("running", "pausing", "paused", "resuming") and history.left_s is not None:
        parts.append(f"{about(history.left_s)} left")
    if history.elapsed_s is not None:
        parts.append(f"{exact_text(history.elapsed_s)} so far" if parts else "")
        parts[-1] = parts[-1] or f"trained for {exact_text(history.elapsed_s)}"
    return " · ".join(parts)


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
        parts.append(f"{history.segments:,} segments")
    if history.device:
        parts.append("GPU" if history.device.startswith("cuda") else history.device.upper())
    return " · ".join(parts)


def gain_summary(gain: Improvement | None, has_radar: bool) -> str:
    """Caption of the figures below, or the reason why there are none."""
    if gain is not None:
        radar = "the simulated radar's" if gain.simulated else "the radar's"
        worse = " Here it is worse than no denoising." if gain.now_mps > gain.plain_mps else ""
        return (
            f"Peak velocity off {radar}, on average over {gain.frames:,} frames of this"
            f" recording.{worse}"
        )
    if not has_radar:
        return "Open a recording with a radar capture to see how much nearer it comes to that."
    return "Denoising this recording…"


def gain_rows(gain: Improvement) -> list[tuple[str, str]]:
    """Errors before and after."""

    def row(name: str, value_mps: float) -> tuple[str, str]:
        text = f"{value_mps:.3f} m/s"
        if name != "not denoised" and gain.plain_mps > 0:
            change = round(100 * (value_mps / gain.plain_mps - 1))
            text += f" ({change:+d} %)".replace("-", "−")
        return name, text

    rows = [row("not denoised", gain.plain_mps)]
    if gain.before_mps is not None:
        rows.append(row(f"before, {gain.before_title}", gain.before_mps))
    return [*rows, row("this model", gain.now_mps)]
