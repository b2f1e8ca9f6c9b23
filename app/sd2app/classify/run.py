"""One training or comparison of classifiers, whoever started it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from PySide6.QtCore import QObject

from sd2app.background.run_monitor import CommandRun
from sd2app.classify.history import ClassHistory

MODEL_NAME = "classifier.safetensors"
TABLE_NAME = "table"


class ClassRun(CommandRun):
    """A run with what it told of its steps, or of its trainings.

    Parameters
    ----------
    path : Path
    pid : int, optional
        Of the process that was just started for it.
    """

    def __init__(
        self, path: Path, parent: QObject | None = None, *, pid: int | None = None
    ) -> None:
        super().__init__(path, parent, pid=pid)
        self.history = ClassHistory()

    @property
    def compares(self) -> bool:
        """Whether it is a comparison, and not a training."""
        return self.about.get("what") == "table"

    @property
    def result(self) -> Path | None:
        """The model, or the folder with the tables; None where there is none."""
        return self.folder.path / self._result_name if self.has_result else None

    def hear(self, events: Sequence[dict[str, Any]]) -> bool:
        """Steps, looks, trainings that are done."""
        return self.history.take(events)

    @property
    def begun(self) -> bool:
        """Whether the data has been read."""
        return self.history.begun

    @property
    def keeping(self) -> bool:
        """Whether the model is being written."""
        return self.history.saving

    def has_made(self) -> bool:
        """Whether there is a model, or a whole table."""
        result = self.folder.path / self._result_name
        return (result / "table.json" if self.compares else result).is_file()

    @property
    def _result_name(self) -> str:
        return TABLE_NAME if self.compares else MODEL_NAME
