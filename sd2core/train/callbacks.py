"""Callbacks between the steps of a run: progress lines, validation, checkpoints, control."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Any, Literal, Protocol

import torch

from sd2core.denoise.model import Denoiser
from sd2core.errors import Sd2Error
from sd2core.runs.control import Control, Word
from sd2core.runs.folder import State
from sd2core.runs.pace import Pace
from sd2core.runs.progress import ProgressWriter, StepLines
from sd2core.train.checkpoint import Checkpoint, Position, write_checkpoint
from sd2core.train.config import TrainConfig
from sd2core.train.data import Order
from sd2core.train.folder import TrainingFolder
from sd2core.train.validate import Exam, Validation, validate


class Clock:
    """Seconds of training; ``elapsed_s`` are those of earlier processes."""

    def __init__(self, elapsed_s: float = 0.0) -> None:
        self._before_s = elapsed_s
        self._begun_s = time.monotonic()

    @property
    def elapsed_s(self) -> float:
        """Seconds since the run began, without pauses."""
        return self._before_s + time.monotonic() - self._begun_s

    def leave_out(self, seconds: float) -> None:
        """Do not count a pause."""
        self._begun_s += seconds


Outcome = Literal["finished", "stopped", "cancelled", "failed"]


class Module(Protocol):
    """The part of :class:`~sd2core.train.denoiser_module.DenoiserModule` that callbacks use."""

    network: Denoiser
    device: torch.device
    trainer: Any

    def checkpoint_tensors(self) -> tuple[dict[str, torch.Tensor], dict[int, Any]]:
        """Weights, and moments of the optimiser."""


class TrainingCallbacks:
    """Callbacks of a run between its steps.

    ``position`` is the start, ``about`` goes into checkpoints, and ``save_best(validation, that of
    the network for live frames if it is another, epoch)`` writes the model that is to be used.
    """

    def __init__(
        self,
        config: TrainConfig,
        folder: TrainingFolder,
        writer: ProgressWriter,
        control: Control,
        order: Order,
        exam: Exam,
        position: Position,
        about: dict[str, Any],
        save_best: Callable[[Validation, Validation | None, int], None],
    ) -> None:
        self.config, self.order, self.exam, self.position = config, order, exam, position
        self.outcome: Outcome = "stopped"
        self.rate = 0.0
        self._folder, self._writer, self._control = folder, writer, control
        self._about, self._save_best = about, save_best
        self._lines = StepLines(writer)
        self._counted: torch.Tensor | None = None
        self._squares: torch.Tensor | None = None
        self._line_squares, self._line_segments = position.squares, position.segments
        self._clock, self._pace = Clock(position.elapsed_s), Pace()
        self._kept_s = self._clock.elapsed_s
        self._share = 0.0

    @property
    def total_steps(self) -> int | None:
        """Steps of the whole run; None where time limits it."""
        if self.config.training.minutes is not None:
            return None
        return self.order.steps * self.config.training.epochs

    @property
    def over(self) -> bool:
        """True if nothing is left to do at this position."""
        training, position = self.config.training, self.position
        patience = training.early_stopping_epochs
        if patience and position.epochs_since_best >= patience:
            return True
        if training.minutes is not None:
            return position.elapsed_s >= 60.0 * training.minutes
        return position.epoch >= training.epochs

    def begin(self, module: Module) -> None:
        """Move data to the device, install signal handlers and start the clock."""
        self._control.take_signals()
        self._module = module
        self.exam = self.exam.on(module.device)
        self._squares = torch.tensor(
            self.position.squares, dtype=torch.float64, device=module.device
        )
        self._clock = Clock(self.position.elapsed_s)
        self._kept_s = self._clock.elapsed_s
        self._set_state("running")

    def counted_on(self, device: torch.device) -> torch.Tensor:
        """Bins that are not nulled, as an index on a device."""
        if self._counted is None or self._counted.device != device:
            self._counted = torch.tensor(self.exam.counted, device=device)
        return self._counted

    def agreed_rate_factor(self) -> float:
        """Share of the highest learning rate for the step to come."""
        training = self.config.training
        total = self.total_steps
        done = self._share if total is None else (self.position.steps_done + 1) / total
        return rate_factor(done, training.warm_up, training.final_rate)

    def note(self, square: torch.Tensor, segments: int) -> None:
        """Add the mean square error of a batch; nothing waits for the device here."""
        assert self._squares is not None
        self._squares += square.double() * segments
        self.position.segments += segments

    def after_step(self) -> bool:
        """Count a step and do what is due; False when the run is over."""
        position = self.position
        position.step += 1
        position.steps_done += 1
        word, self._share = self._agreed(self._control.word(), self._share_done())
        over = self.total_steps is None and self._share >= 1.0
        whole = position.step == self.order.steps
        if self._lines.due or whole or over:
            self._say_step()
        if (whole or over) and word != "cancel":
            over = self._end_epoch() or over
            if over:
                self.outcome = "finished"
            word, _ = self._agreed(self._control.word(), 0.0)
        if word == "pause" and not over:
            word = self._pause()
        if word == "cancel":
            self._writer.say("cancelling")
            self.outcome = "cancelled"
            return False
        if over:
            self._keep()
            return False
        if word == "stop":
            self._writer.say("stopping")
            self._keep()
            if position.best is None:
                self._keep_what_there_is()
            self.outcome = "stopped"
            return False
        if self._clock.elapsed_s - self._kept_s >= self.config.training.checkpoint_s:
            self._keep()
        return True

    def _share_done(self) -> float:
        """Share of the run that is done, 0 to 1."""
        minutes, total = self.config.training.minutes, self.total_steps
        if total is None:
            assert minutes is not None
            return self._clock.elapsed_s / (60.0 * minutes)
        return self.position.steps_done / total

    def _say_step(self) -> None:
        position = self.position
        squares = self._finite_squares()
        segments = max(1, position.segments - self._line_segments)
        # Sums of floating-point numbers: the difference of equal ones may be a hair below 0.
        since = max(0.0, squares - self._line_squares)
        self._line_squares, self._line_segments = squares, position.segments
        self._lines.say(
            epoch=position.epoch + 1,
            step=position.steps_done,
            steps=self.total_steps,
            train_rmse=math.sqrt(since / segments),
            learning_rate=self.rate,
            **self._times(),
        )

    def _end_epoch(self) -> bool:
        """Validate and keep the best model; True when the run is over."""
        position = self.position
        position.squares = self._finite_squares()
        found = validate(self._module.network, self.exam, lambda: self._control.word() != "cancel")
        if found is None:
            return False
        training = self.config.training
        score = found.rmse if training.select_by == "rmse" else found.mae_mps
        if not math.isfinite(found.rmse):
            raise _diverged(position.steps_done)
        best = position.best is None or score < position.best["score"]
        if best:
            position.best = {
                "epoch": position.epoch + 1,
                "score": score,
                "validation_rmse": found.rmse,
                "validation_mae_mps": found.mae_mps,
            }
            self._write_best(found, position.epoch + 1)
        position.epochs_since_best = 0 if best else position.epochs_since_best + 1
        self._writer.say(
            "epoch",
            epoch=position.epoch + 1,
            step=position.steps_done,
            train_rmse=math.sqrt(position.squares / max(1, position.segments)),
            validation_rmse=found.rmse,
            validation_mae_mps=found.mae_mps,
            best=best,
            processor_s=time.process_time(),
            **self._times(),
        )
        position.epoch, position.step = position.epoch + 1, 0
        position.squares, position.segments = 0.0, 0
        self._line_squares, self._line_segments = 0.0, 0
        assert self._squares is not None
        self._squares.zero_()
        position.elapsed_s = self._clock.elapsed_s
        return self.over

    def _pause(self) -> Word:
        self._keep()
        self._writer.say("paused")
        self._set_state("paused")
        word, seconds = self._control.wait_while_paused()
        word, seconds = self._agreed(word, seconds)
        self._clock.leave_out(seconds)
        self._writer.say("resumed")
        self._set_state("running")
        return word

    def _keep(self) -> None:
        """Write a checkpoint."""
        position = self.position
        position.squares = self._finite_squares()
        position.elapsed_s = self._clock.elapsed_s
        self._kept_s = position.elapsed_s
        if self._leads:
            weights, moments = self._module.checkpoint_tensors()
            checkpoint = Checkpoint(weights, moments, position, self._about)
            write_checkpoint(self._folder.last, self._folder.last_record, checkpoint)
            self._pace.keep(self.config.pace_kind)

    def _keep_what_there_is(self) -> None:
        """Keep the model of a run that is stopped in its first epoch.

        It is no epoch's, so the position does not know of it: a resumed run ends as it
        would have ended without the stop.
        """
        found = validate(self._module.network, self.exam)
        if found is not None and math.isfinite(found.rmse):
            self._write_best(found, self.position.epoch)

    def _write_best(self, found: Validation, epoch: int) -> None:
        if self._leads:
            network = self._module.network
            other = network.live if network.live is not network else None
            live = None if other is None else validate(other, self.exam)
            self._save_best(found, live, epoch)

    def _set_state(self, state: State) -> None:
        if self._leads:
            self._folder.set_state(state)

    def _finite_squares(self) -> float:
        assert self._squares is not None
        squares = float(self._squares)
        if not math.isfinite(squares):
            raise _diverged(self.position.steps_done)
        return squares

    def _times(self) -> dict[str, float | None]:
        elapsed_s, done, total = self._clock.elapsed_s, self.position.steps_done, self.total_steps
        minutes = self.config.training.minutes
        self._pace.take(done, elapsed_s)
        left_s = None if total is None else self._pace.left_s(total - done)
        if minutes is not None:
            left_s = max(60.0 * minutes - elapsed_s, 0.0)
        return {"elapsed_s": elapsed_s, "left_s": left_s}

    @property
    def _leads(self) -> bool:
        """True in the one of several processes that writes files."""
        return bool(self._module.trainer.is_global_zero)

    def _agreed(self, word: Word, number: float) -> tuple[Word, float]:
        """Answer of the first process in all processes; else they would wait for each other."""
        trainer = self._module.trainer
        if trainer.world_size == 1:
            return word, number
        agreed: tuple[Word, float] = trainer.strategy.broadcast((word, number))
        return agreed


def _diverged(step: int) -> Sd2Error:
    return Sd2Error(
        f"Around step {step} the error is no finite number any more",
        "a training that converges",
        "Choose a lower learning rate, or clip gradients to a smaller norm",
    )


def rate_factor(done: float, warm_up: float, final: float) -> float:
    """Share of the highest learning rate when the share ``done`` (0 to 1) of the run is done.

    It rises linearly from zero during the share ``warm_up`` and falls to ``final`` at the
    end, with half a cosine.
    """
    if done < warm_up:
        return done / warm_up
    angle = math.pi * min(1.0, (done - warm_up) / max(1.0 - warm_up, 1e-9))
    return final + (1.0 - final) * 0.5 * (1.0 + math.cos(angle))
