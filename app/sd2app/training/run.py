"""Monitor of one training run."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

from PySide6.QtCore import QObject

from sd2app.background.run_monitor import RunMonitor
from sd2app.training.history import TrainingHistory
from sd2core.errors import Sd2Error
from sd2core.processes import ProcessId
from sd2core.train.config import TrainConfig, read_config
from sd2core.train.folder import TrainingFolder


class _Facts(NamedTuple):
    config: TrainConfig | None
    has_model: bool
    has_checkpoint: bool


class TrainingMonitor(RunMonitor[TrainingFolder]):
    """A training run with its settings and its history of epochs."""

    def __init__(
        self, path: Path, parent: QObject | None = None, *, process: ProcessId | None = None
    ) -> None:
        self.history = TrainingHistory()
        self._facts = _Facts(None, False, False)
        super().__init__(TrainingFolder(path), parent, process=process)

    def on_events(self, events: Sequence[dict[str, Any]]) -> bool:
        """Read steps, epochs and the end."""
        return self.history.take(events)

    def inspect(self) -> _Facts:
        """Read the settings, and look which models are there."""
        folder, config = self.folder, self._facts.config
        if config is None and folder.exists:
            with suppress(Sd2Error):  # not written yet
                config = read_config(folder.config)
        return _Facts(config, folder.best.exists(), folder.last.exists())

    def on_facts(self, facts: _Facts) -> None:
        """Store the facts."""
        self._facts = facts

    @property
    def has_started(self) -> bool:
        """True once it trains; lines before the last resume do not count."""
        return self.history.begun and self.history.outcome is None

    @property
    def is_paused(self) -> bool:
        """True while it pauses."""
        return self.history.paused

    @property
    def share(self) -> float | None:
        """Share of the whole that is done; None while that is not known."""
        return self.history.share

    @property
    def error(self) -> str:
        """Reason of a failure, from its last line."""
        return self.history.error

    @property
    def config(self) -> TrainConfig | None:
        """Its settings; None until they can be read."""
        return self._facts.config

    @property
    def has_model(self) -> bool:
        """True if there is a model to use."""
        return self._facts.has_model

    @property
    def resumable(self) -> bool:
        """True if it can be resumed."""
        return self._facts.has_checkpoint and self.phase in ("stopped", "failed", "died")
