"""Pools for tests: tasks done in the test's own process, one after the other."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from itertools import cycle
from pathlib import Path

from sd2core.batch.pool import Ending
from sd2core.batch.tasks import BEGUN, Task, run_tasks


class SerialPool:
    """Does a task when a result is waited for.

    Parameters
    ----------
    folder : Path
    workers : int
        Number that it says it has.
    dies : callable, optional
        Receives a task that is about to be done; True: its process "dies" in it, and as Dask
        does, the pool has all repeated that was given to it.

    Attributes
    ----------
    submitted : Counter
        Tasks per step.
    most_waiting, largest : int
        Bundles that were ever given out at once, and tasks in one.
    """

    def __init__(
        self, folder: Path, workers: int = 1, dies: Callable[[Task], bool] | None = None
    ) -> None:
        self._folder = folder
        self._names = {f"worker-{number}": 1 for number in range(workers)}
        self._dies = dies or (lambda task: False)
        self._waiting: deque[tuple[str, tuple[Task, ...]]] = deque()
        self._next = cycle(self._names)
        self.submitted: Counter[str] = Counter()
        self.by_worker: dict[str, list[Task]] = {name: [] for name in self._names}
        self.most_waiting = self.largest = 0

    def workers(self) -> Mapping[str, int]:
        return self._names

    def submit(self, tasks: tuple[Task, ...], worker: str | None) -> None:
        worker = worker or next(self._next)
        self._waiting.append((worker, tasks))
        self.submitted[tasks[0].step] += len(tasks)
        self.by_worker[worker] += tasks
        self.largest = max(self.largest, len(tasks))
        self.most_waiting = max(self.most_waiting, len(self._waiting))

    def ended(self, timeout_s: float) -> list[Ending]:
        if not self._waiting:
            return []
        worker, tasks = self._waiting.popleft()
        for task in tasks:
            marker = self._folder / BEGUN / f"task-{task.key}"
            deaths = len(marker.read_text().splitlines()) if marker.exists() else 0
            if deaths < 2 and self._dies(task):
                with marker.open("a") as stream:
                    stream.write("here 1\n")
                self._waiting.append((worker, tasks))
                return []
        return [Ending(tasks, run_tasks(tasks, self._folder), worker)]


@contextmanager
def in_this_process(folder: Path) -> Iterator[SerialPool]:
    """Pool that is entered as ``run_batch`` does."""
    yield SerialPool(folder)
