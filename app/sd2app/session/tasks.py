"""Long tasks under way, with title, progress and cancellation."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from PySide6.QtCore import QObject, Signal

from sd2app.background.latest import LatestRunner, Task


@dataclass(eq=False)
class Job:
    """One piece of work; ``total`` is zero while its length is unknown."""

    title: str
    cancel: Callable[[], None]
    done: int = 0
    total: int = 0
    cancelling: bool = False


class TaskList(QObject):
    """All jobs, the oldest first."""

    changed = Signal()

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.jobs: tuple[Job, ...] = ()  # that run

    def start(self, job: Job) -> None:
        """Announce a job."""
        self.jobs = (*self.jobs, job)
        self.changed.emit()

    def report(self, job: Job, done: int, total: int) -> None:
        """Report the progress of a job."""
        if (done, total) != (job.done, job.total):
            job.done, job.total = done, total
            self.changed.emit()

    def finish(self, job: Job | None) -> None:
        """Remove an ended job, if there was one."""
        if job in self.jobs:
            self.jobs = tuple(one for one in self.jobs if one is not job)
            self.changed.emit()

    def cancel(self, job: Job) -> None:
        """Stop a job; it says so at once."""
        if job in self.jobs and not job.cancelling:
            job.cancelling = True
            self.changed.emit()
            job.cancel()


class ListedRunner(LatestRunner):
    """Background thread whose task stands in the list while it runs, if it has a title.

    A partial result ``(done, total)`` is the progress of the task.
    """

    cancelled = Signal()  # by the user

    def __init__(
        self,
        name: str,
        tasks: TaskList,
        parent: QObject,
        take: Callable[[Any], object] | None = None,
        refuse: Callable[[Exception], object] | None = None,
    ) -> None:
        super().__init__(name, parent, take, refuse)
        self._tasks = tasks
        self.job: Job | None = None
        self.partial.connect(self._report)
        self.idle_changed.connect(lambda idle: self._end() if idle else None)

    def submit(self, task: Task, title: str = "") -> None:
        """Ask for ``task(emit)`` in the background, in place of the one before."""
        self._end()
        if title:
            self.job = Job(title, self._cancel)
            self._tasks.start(self.job)
        super().submit(task)
        if not self.busy:
            self._end()  # closed

    def _report(self, result: object) -> None:
        if self.job is not None and isinstance(result, tuple):
            self._tasks.report(self.job, *result)

    def _cancel(self) -> None:
        self.cancel()
        self.cancelled.emit()

    def _end(self) -> None:
        job, self.job = self.job, None
        self._tasks.finish(job)
