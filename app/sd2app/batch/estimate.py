"""Tasks and time of a batch, estimated by ``sd2 batch --dry-run`` in a background process."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from PySide6.QtCore import QObject, Signal

from sd2app.background.line_process import Ending, LineProcess
from sd2app.background.run_command import COMMAND
from sd2core.batch.plan import BatchPlan
from sd2core.batch.plan_file import write_plan


class BatchEstimateModel(QObject):
    """One estimate at a time; that of another plan takes its place."""

    changed = Signal()

    def __init__(self, parent: QObject | None = None, command: Sequence[str] = COMMAND) -> None:
        super().__init__(parent)
        self._command = tuple(command)
        self._process: LineProcess | None = None
        self._folder: tempfile.TemporaryDirectory[str] | None = None
        self._lines: list[str] = []
        self._asked: tuple[BatchPlan, int] | None = None
        self._facts: dict[str, Any] | None = None
        self._problem = ""

    @property
    def busy(self) -> bool:
        """True while it is being computed."""
        return self._process is not None

    @property
    def facts(self) -> dict[str, Any] | None:
        """Output of the command; None until it has ended."""
        return self._facts

    @property
    def problem(self) -> str:
        """Reason why there is no estimate."""
        return self._problem

    def of(self, plan: BatchPlan, workers: int) -> bool:
        """True if the estimate, known or being computed, is for this plan."""
        return self._asked == (plan, workers)

    def ask(self, plan: BatchPlan, workers: int) -> None:
        """Compute the estimate for this plan, unless it is known."""
        if self.of(plan, workers):
            return
        self.forget()
        self._asked = (plan, workers)
        self._folder = tempfile.TemporaryDirectory(prefix="sd2-batch-")
        file = Path(self._folder.name) / "plan.toml"
        write_plan(file, plan)
        self._process = LineProcess(self)
        self._process.line.connect(self._lines.append)
        self._process.ended.connect(self._end)
        words = ["batch", str(file), "--dry-run", "--json", "--workers", str(workers)]
        self._process.start([*self._command, *words])
        self.changed.emit()

    def forget(self) -> None:
        """Stop, and drop the estimate."""
        if self._process is not None:
            self._process.close()
        self._clear_up()
        self._asked, self._facts, self._problem = None, None, ""
        self.changed.emit()

    def close(self) -> None:
        """Stop at once."""
        if self._process is not None:
            self._process.close()
        self._clear_up()

    def _end(self, ending: Ending) -> None:
        text = "\n".join(self._lines)
        self._clear_up()
        try:
            facts = json.loads(text) if ending.code == 0 else None
        except ValueError:
            facts = None
        if isinstance(facts, dict):
            self._facts = facts
        else:
            self._problem = ending.reason("It cannot be estimated.")
        self.changed.emit()

    def _clear_up(self) -> None:
        if self._process is not None:
            self._process.deleteLater()
            self._process = None
        if self._folder is not None:
            self._folder.cleanup()
            self._folder = None
        self._lines = []
