"""Monitor of one batch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from PySide6.QtCore import QObject

from sd2app.background.run_monitor import RunMonitor
from sd2core.batch.folder import BatchFolder, BatchStatus, status_of
from sd2core.errors import Sd2Error
from sd2core.processes import ProcessId
from sd2core.runs.command_folder import last_output
from sd2core.runs.folder import State
from sd2core.runs.progress import Event

_KEPT_FAILURES = 500
"""Limit of kept failures; the report has all."""


@dataclass(frozen=True)
class Failed:
    """A task that cannot be done."""

    recording: str
    step: str
    placement: int | None
    reason: str


class _Facts(NamedTuple):
    about: dict[str, Any]
    log: str
    has_plan: bool


def plan_of(folder: Path) -> Path:
    """Plan that a batch is started with; it keeps a copy in its folder."""
    return folder.with_name(f".{folder.name}.plan.toml")


class BatchMonitor(RunMonitor[BatchFolder]):
    """A batch with its counts, its failures and its log; only its last start counts."""

    facts = _Facts({}, "", False)

    def __init__(
        self, path: Path, parent: QObject | None = None, *, process: ProcessId | None = None
    ) -> None:
        self._start_and_last: list[Event] = []
        self.failures: list[Failed] = []
        super().__init__(BatchFolder(path), parent, process=process)

    def on_events(self, events: Sequence[dict[str, Any]]) -> bool:
        """Read counts and failures."""
        for event in events:
            kind = event["event"]
            if kind == "start":
                self._start_and_last, self.failures = [event], []
            elif kind in ("progress", "end"):
                self._start_and_last = [*self._start_and_last[:1], event]
            elif kind == "failed" and len(self.failures) < _KEPT_FAILURES:
                self.failures.append(_failed(event))
        return bool(events)

    def inspect(self) -> _Facts:
        """Read the description and the end of the log."""
        folder = self.folder
        try:
            about = folder.about()
        except Sd2Error:
            about = {}
        return _Facts(about, last_output(folder.log), folder.plan.exists())

    @property
    def status(self) -> BatchStatus | None:
        """Counts and times of the last start; None before there is a folder."""
        about = self.facts.about
        if not about:
            return None
        if self.under_way:
            state: State = "running"
        else:
            state = "died" if about["state"] == "running" else about["state"]
        return status_of(state, about, self._start_and_last)

    @property
    def error(self) -> str:
        """Reason why the whole batch failed."""
        return (self.status and self.status.error) or ""

    @property
    def steps(self) -> tuple[str, ...]:
        """Steps of the plan, in order."""
        start = self._start_and_last[:1]
        return tuple(map(str, start[0].get("steps", ()))) if start else ()

    @property
    def log(self) -> str:
        """End of the log."""
        return self.facts.log

    @property
    def resumable(self) -> bool:
        """True if the same command would go on with it."""
        return not self.under_way and self._phase != "gone" and self.facts.has_plan

    def _settle(self) -> None:
        super()._settle()
        if not self.under_way:
            plan_of(self.path).unlink(missing_ok=True)


def _failed(event: dict[str, Any]) -> Failed:
    error = event.get("error") or {}
    words = (str(error.get(part, "")) for part in ("found", "expected", "remedy"))
    placement = event.get("placement")
    return Failed(
        str(event.get("recording", "")),
        str(event.get("step", "")),
        placement if isinstance(placement, int) else None,
        str(Sd2Error(*words)),
    )
