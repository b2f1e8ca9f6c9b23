"""The training of a denoiser: lines of progress, checkpoints, and orders from outside."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import torch

from sd2core.errors import Sd2Error
from sd2core.options.training import TrainConfig
from sd2core.runs.control import Command, Control
from sd2core.runs.folder import State
from sd2core.runs.pace import Throughput
from sd2core.runs.progress import ProgressWriter
from sd2core.train.checkpoint import Checkpoint, moments_of, set_moments, write_checkpoint
from sd2core.train.folder import TrainingFolder
from sd2core.train.learner import Learner
from sd2core.train.loop import Loop, Outcome
from sd2core.train.ranks import Ranks
from sd2core.train.steps import Batches, optimiser_of, rate_factor, set_rate
from sd2core.train.validate import Validation, Validator, validate

_LINE_S = 0.5
"""Lines of single steps are at least so far apart."""


class DenoiserLoop(Loop):
    """Training of a denoiser in its folder, from a checkpoint on.

    ``save_best(validation, that of the network for live frames if it is another, epoch)`` writes
    the model that is to be used. With ``mixed`` the network multiplies in half precision (bf16).
    """

    def __init__(
        self,
        config: TrainConfig,
        folder: TrainingFolder,
        writer: ProgressWriter,
        control: Control,
        learner: Learner,
        batches: Batches,
        validator: Validator,
        start: Checkpoint,
        save_best: Callable[[Validation, Validation | None, int], None],
        ranks: Ranks,
        *,
        mixed: bool,
    ) -> None:
        training, epoch_steps = config.training, batches.steps
        timed = training.minutes is not None
        super().__init__(
            start.position,
            epoch_steps=epoch_steps,
            steps=None if timed else epoch_steps * training.epochs,
            minutes=training.minutes,
            patience=training.early_stopping_epochs,
        )
        self._config, self._folder, self._writer, self._control = config, folder, writer, control
        self._network, self._batches, self._validator = learner.network, batches, validator
        self._about, self._save_best = start.about, save_best
        self._ranks, self._mixed = ranks, mixed
        self._device = validator.inputs.device
        self._learner = ranks.together(learner, self._device)
        self._optimiser = optimiser_of(self._network, training)
        if start.moments:
            set_moments(self._optimiser, start.moments)
        self._pace = Throughput()
        self._share, self._rate, self._reported_s = 0.0, 0.0, -math.inf
        squares = self.position.squares
        # On the device: nothing waits for it between the lines of progress.
        self._squares = torch.tensor(squares, dtype=torch.float64, device=self._device)
        self._line_squares, self._line_segments = squares, self.position.segments
        self._kept_s = self.position.elapsed_s
        self._validation: Validation | None = None

    def run(self) -> Outcome:
        """Train until the end, or until an order to stop or to cancel."""
        if not self.over:
            self._set_state("running")
        return super().run()

    def step(self) -> None:
        """Learn from one batch, with random numbers that its place in the run alone seeds."""
        training, position = self._config.training, self.position
        done = self._share if self.steps is None else (position.steps_done + 1) / self.steps
        factor = rate_factor(done, training.warm_up, training.final_rate)
        self._rate = set_rate(self._optimiser, factor)
        place = [training.seed, position.epoch, position.step, self._ranks.rank]
        seed = np.random.SeedSequence(place).generate_state(1, np.uint64)[0]
        torch.manual_seed(int(seed))
        batch = self._batches.at(position.epoch, position.step).on(self._device)
        half = torch.bfloat16
        with torch.autocast(self._device.type, half, enabled=self._mixed, cache_enabled=False):
            loss, square = self._learner(batch)
        self._squares += square.double() * len(batch.start)
        position.segments += len(batch.start)
        self._optimiser.zero_grad()
        loss.backward()
        if training.clip_norm > 0:
            torch.nn.utils.clip_grad_norm_(self._network.parameters(), training.clip_norm)
        self._optimiser.step()

    def after_step(self) -> Outcome | None:
        """Say, check, keep and obey what is due."""
        position, say = self.position, self._writer.say
        word, self._share = self._ranks.agreed(self._control.word(), self.share_done)
        over = self.steps is None and self._share >= 1.0
        ends = self.epoch_ends or over
        if ends or time.monotonic() - self._reported_s >= _LINE_S:
            self._say_step()
        if ends and word != "cancel":
            self.end_epoch()
            over = over or self.over
            (word,) = self._ranks.agreed(self._control.word())
        if word == "pause" and not over:
            word = self._pause()
        if word == "cancel":
            say("cancelling")
            return "cancelled"
        if over:
            self._keep()
            return "finished"
        if word == "stop":
            say("stopping")
            self._keep()
            if position.best is None:
                self._keep_what_there_is()
            return "stopped"
        if self.elapsed_s - self._kept_s >= self._config.training.checkpoint_s:
            self._keep()
        return None

    def check(self) -> dict[str, Any]:
        """Errors on the people who are kept out to choose by."""
        validation = validate(self._network, self._validator)
        if not math.isfinite(validation.rmse):
            raise _diverged(self.position.steps_done)
        self._validation = validation
        by_rmse = self._config.training.select_by == "rmse"
        return {
            "score": validation.rmse if by_rmse else validation.mae_mps,
            "validation_rmse": validation.rmse,
            "validation_mae_mps": validation.mae_mps,
        }

    def keep_best(self) -> None:
        """Write the model that is to be used."""
        assert self._validation is not None
        self._write_best(self._validation, self.position.epoch + 1)

    def end_epoch(self) -> bool:
        """Say the errors of the epoch as well, and count those of the next from zero."""
        position = self.position
        position.squares = self._finite_squares()
        best = super().end_epoch()
        assert self._validation is not None
        self._writer.say(
            "epoch",
            epoch=position.epoch,
            step=position.steps_done,
            train_rmse=math.sqrt(position.squares / max(1, position.segments)),
            validation_rmse=self._validation.rmse,
            validation_mae_mps=self._validation.mae_mps,
            best=best,
            processor_s=time.process_time(),
            **self._times(),
        )
        position.squares, position.segments = 0.0, 0
        self._line_squares, self._line_segments = 0.0, 0
        self._squares.zero_()
        return best

    def _say_step(self) -> None:
        position = self.position
        squares = self._finite_squares()
        segments = max(1, position.segments - self._line_segments)
        # Sums of floating-point numbers: the difference of equal ones may be a hair below 0.
        since = max(0.0, squares - self._line_squares)
        self._line_squares, self._line_segments = squares, position.segments
        self._reported_s = time.monotonic()
        self._writer.say(
            "step",
            epoch=position.epoch + 1,
            step=position.steps_done,
            steps=self.steps,
            train_rmse=math.sqrt(since / segments),
            learning_rate=self._rate,
            **self._times(),
        )

    def _pause(self) -> Command:
        self._keep()
        self._writer.say("paused")
        self._set_state("paused")
        word: Command
        word, seconds = self._ranks.agreed(*self._control.wait_while_paused())
        self.leave_out(seconds)
        self._writer.say("resumed")
        self._set_state("running")
        return word

    def _keep(self) -> None:
        """Write a checkpoint."""
        position = self.position
        position.squares = self._finite_squares()
        position.elapsed_s = self._kept_s = self.elapsed_s
        if self._ranks.leads:
            weights, moments = self._network.state_dict(), moments_of(self._optimiser)
            checkpoint = Checkpoint(weights, moments, position, self._about)
            write_checkpoint(self._folder.last, self._folder.last_record, checkpoint)
            self._pace.keep(self._config.pace_kind)

    def _keep_what_there_is(self) -> None:
        """Keep the model of a run that is stopped in its first epoch.

        It is no epoch's, so the position does not know of it: a resumed run ends as it
        would have ended without the stop.
        """
        validation = validate(self._network, self._validator)
        if math.isfinite(validation.rmse):
            self._write_best(validation, self.position.epoch)

    def _write_best(self, validation: Validation, epoch: int) -> None:
        if self._ranks.leads:
            other = self._network.live
            apart = other is not None and other is not self._network
            live = validate(other, self._validator) if apart else None
            self._save_best(validation, live, epoch)

    def _set_state(self, state: State) -> None:
        if self._ranks.leads:
            self._folder.set_state(state)

    def _finite_squares(self) -> float:
        squares = float(self._squares)
        if not math.isfinite(squares):
            raise _diverged(self.position.steps_done)
        return squares

    def _times(self) -> dict[str, float | None]:
        elapsed_s, done = self.elapsed_s, self.position.steps_done
        self._pace.take(done, elapsed_s)
        if self.steps is not None:
            left_s = self._pace.left_s(self.steps - done)
        else:
            assert self.minutes is not None
            left_s = max(60.0 * self.minutes - elapsed_s, 0.0)
        return {"elapsed_s": elapsed_s, "left_s": left_s}


def _diverged(step: int) -> Sd2Error:
    return Sd2Error(
        f"Around step {step} the error is no finite number any more",
        "a training that converges",
        "Choose a lower learning rate, or clip gradients to a smaller norm",
    )
