"""Monitor of one batch."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, NamedTuple

from sd2app.background.run_monitor import History, RunMonitor, reason_in
from sd2core.batch.folder import BatchFolder
from sd2core.runs.command_folder import last_output
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
    log: str  # its end
    has_plan: bool


def plan_of(folder: Path) -> Path:
    """Plan that a batch is started with; it keeps a copy in its folder."""
    return folder.with_name(f".{folder.name}.plan.toml")


class BatchHistory(History):
    """Counts and failures of a batch's last start."""

    steps: tuple[str, ...] = ()  # of the plan, in order
    workers = failed = 0  # processes that share the work; tasks that cannot be done

    def __init__(self) -> None:
        self.tasks: dict[str, dict[str, int]] = {}  # per step: "total", "done", "there" already
        self.failures: list[Failed] = []

    @property
    def share(self) -> float | None:
        """Share of the time that has passed; None while what is left is not known."""
        elapsed_s, left_s = self.elapsed_s, self.left_s
        if elapsed_s is None or left_s is None:
            return None
        return elapsed_s / max(elapsed_s + left_s, 1e-9)

    def _start(self, event: Event) -> None:
        self.steps, self.failures = tuple(map(str, event.get("steps", ()))), []
        self._count({})

    def _count(self, event: Event) -> None:
        elapsed_s, left_s = event.get("elapsed_s"), event.get("left_s")
        self.elapsed_s = None if elapsed_s is None else float(elapsed_s)
        self.told_left_s = None if left_s is None else float(left_s)
        self.tasks = {name: dict(event.get(name, {})) for name in ("total", "done", "there")}
        self.workers, self.failed = int(event.get("workers", 0)), int(event.get("failed", 0))
        self.error = reason_in(event)

    def _fail(self, event: Event) -> None:
        if len(self.failures) < _KEPT_FAILURES:
            placement = event.get("placement")
            self.failures.append(
                Failed(
                    str(event.get("recording", "")),
                    str(event.get("step", "")),
                    placement if isinstance(placement, int) else None,
                    reason_in(event),
                )
            )

    readers: ClassVar = {"start": _start, "progress": _count, "end": _count, "failed": _fail}


class BatchMonitor(RunMonitor[BatchFolder]):
    """A batch with its counts, its failures and its log; only its last start counts."""

    folders, histories = BatchFolder, BatchHistory
    history: BatchHistory
    facts = _Facts("", False)

    def inspect(self) -> _Facts:
        """Read the end of the log, and look for a plan to go on with."""
        return _Facts(last_output(self.folder.log), self.folder.plan.exists())

    @property
    def resumable(self) -> bool:
        """True if the same command would go on with it."""
        return not self.under_way and self.phase != "gone" and self.facts.has_plan

    def _settle(self) -> None:
        super()._settle()
        if not self.under_way:
            plan_of(self.path).unlink(missing_ok=True)
