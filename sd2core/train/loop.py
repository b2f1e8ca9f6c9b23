"""The loop of a training: steps, and a check of the model after every epoch.

Denoisers and classifiers both learn by it; a subclass says what a step is and how the model
is checked.
"""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from typing import Any, Literal

from sd2core.train.checkpoint import Position

Outcome = Literal["finished", "stopped", "cancelled", "failed"]


class Loop(ABC):
    """Training from a position on until all steps are done, or its time or patience is over.

    Parameters
    ----------
    position : Position
        Where it begins, and from then on where it is.
    epoch_steps : int
        Steps between two checks of the model.
    steps : int or None
        In all, a last epoch may be shorter; None where ``minutes`` limit the training.
    minutes : float or None
        Time of training, without pauses, where there is no number of steps.
    patience : int
        Epochs in a row without a better one after which it ends; 0: never.
    """

    def __init__(
        self,
        position: Position,
        *,
        epoch_steps: int,
        steps: int | None = None,
        minutes: float | None = None,
        patience: int = 0,
    ) -> None:
        self.position = position
        self.epoch_steps, self.steps, self.minutes = epoch_steps, steps, minutes
        self.patience = patience
        self._begun_s = time.monotonic() - position.elapsed_s

    @abstractmethod
    def step(self) -> None:
        """Take one step of the optimiser."""

    @abstractmethod
    def check(self) -> dict[str, Any]:
        """Check the model: its ``score``, of which less is better, and what else is to be kept."""

    @abstractmethod
    def keep_best(self) -> None:
        """Keep the model that has just been checked."""

    def run(self) -> Outcome:
        """Train until the end; return how it came."""
        outcome: Outcome | None = "finished" if self.over else None
        while outcome is None:
            self.step()
            self.position.step += 1
            self.position.steps_done += 1
            outcome = self.after_step()
        return outcome

    @property
    def elapsed_s(self) -> float:
        """Seconds of training, those of earlier processes included."""
        return time.monotonic() - self._begun_s

    @property
    def share_done(self) -> float:
        """Share of the steps, or of the time, that is done: 0 to 1."""
        if self.steps is not None:
            return self.position.steps_done / self.steps
        assert self.minutes is not None
        return self.elapsed_s / (60.0 * self.minutes)

    @property
    def over(self) -> bool:
        """True if nothing is left to do at this position."""
        position = self.position
        if self.patience and position.epochs_since_best >= self.patience:
            return True
        if self.steps is not None:
            return position.epoch >= -(-self.steps // self.epoch_steps)
        assert self.minutes is not None
        return position.elapsed_s >= 60.0 * self.minutes

    @property
    def epoch_ends(self) -> bool:
        """True after the last step of an epoch."""
        return self.epoch_steps == self.position.step or self.position.steps_done == self.steps

    def after_step(self) -> Outcome | None:
        """Do what is due between two steps; return how the training ended, if it did."""
        if self.epoch_ends:
            self.end_epoch()
        return "finished" if self.over else None

    def end_epoch(self) -> bool:
        """Check the model, keep it if it is the best so far, which is True, and begin the next."""
        position = self.position
        scores = self.check()
        best = position.best is None or bool(scores["score"] < position.best["score"])
        if best:
            position.best = {"epoch": position.epoch + 1, **scores}
            self.keep_best()
        position.epochs_since_best = 0 if best else position.epochs_since_best + 1
        position.epoch, position.step = position.epoch + 1, 0
        position.elapsed_s = self.elapsed_s
        return best

    def leave_out(self, seconds: float) -> None:
        """Do not count a pause as time of training."""
        self._begun_s += seconds
