"""Pools for tests: tasks done in the test's own process, one after the other."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from sd2core.batch.pool import Ending
from sd2core.batch.tasks import BEGUN, SomeFailed, Task, TaskFailed, run_tasks


class SerialPool:
    """Does a task when somebody waits for one.

    Parameters
    ----------
    folder : Path
    workers : int
        That it says it has.
    dies : callable, optional
        Told a task that is about to be done; True: its process "dies" in it.

    Attributes
    ----------
    submitted : Counter
        Tasks per step.
    most_waiting, largest : int
        Bundles that were ever given out at once, and tasks in one.
    """

    most_deaths = 2

    def __init__(
        self, folder: Path, workers: int = 1, dies: Callable[[Task], bool] | None = None
    ) -> None:
        self._folder = folder
        self._names = {f"worker-{number}": 1 for number in range(workers)}
        self._dies = dies or (lambda task: False)
        self._waiting: deque[tuple[Task, ...]] = deque()
        self.submitted: Counter[str] = Counter()
        self.by_worker: dict[str, list[Task]] = {name: [] for name in self._names}
        self.most_waiting = self.largest = 0

    def workers(self) -> Mapping[str, int]:
        return self._names

    def submit(self, tasks: tuple[Task, ...], worker: str) -> None:
        self._waiting.append(tasks)
        self.submitted[tasks[0].step] += len(tasks)
        self.by_worker[worker] += tasks
        self.largest = max(self.largest, len(tasks))
        self.most_waiting = max(self.most_waiting, len(self._waiting))

    def ended(self, timeout_s: float) -> list[Ending]:
        if not self._waiting:
            return []
        tasks = self._waiting.popleft()
        failures: list[TaskFailed | None] = []
        for task in tasks:
            if self._dies(task):
                (self._folder / BEGUN / "task-here-1").write_text(task.key)
                # Whatever else it was given goes with it.
                lost = [tasks, *self._waiting]
                self._waiting.clear()
                return [Ending(one, killed=True) for one in lost]
            try:
                run_tasks([task.record(self._folder)])
                failures.append(None)
            except SomeFailed as error:
                failures += error.failures
        return [Ending(tasks, tuple(failures))]


@contextmanager
def in_this_process(folder: Path) -> Iterator[SerialPool]:
    """One that is entered as ``run_batch`` does."""
    yield SerialPool(folder)
