"""Submission of tasks, a few at a time, and the count of their outcomes."""

from __future__ import annotations

from collections import Counter, defaultdict, deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from sd2core.batch.pool import Ending, Pool
from sd2core.batch.task_graph import TaskGraph
from sd2core.batch.tasks import Outcome, Task, deaths_during, too_many_deaths
from sd2core.errors import Sd2Error

AHEAD = 4
"""Bundles in flight per worker thread: no worker waits for its next one, and a million tasks
do not fill the scheduler's memory."""

_BUNDLE_S = 1.0
_LARGEST_BUNDLE = 32
"""Short tasks of one recording are submitted together, for about a second's work: every
submission costs some milliseconds."""

_POLL_S = 0.2
_MAX_RESUBMISSIONS = 20


@dataclass
class Counts:
    """Counts per step: tasks made before, done, failed, or waiting for failed ones."""

    made_before: Counter[str] = field(default_factory=Counter)
    done: Counter[str] = field(default_factory=Counter)
    failed: Counter[str] = field(default_factory=Counter)
    waiting: Counter[str] = field(default_factory=Counter)
    # Seconds and work of the tasks done.
    seconds: defaultdict[str, float] = field(default_factory=lambda: defaultdict(float))
    work: Counter[str] = field(default_factory=Counter)

    def settled(self, step: str) -> int:
        """Number of tasks of a step that need no more work."""
        return self.made_before[step] + self.done[step] + self.failed[step] + self.waiting[step]


class Stopped(Exception):
    """Raised by ``tick`` when the user asked for the end."""


class Driver:
    """One run over all tasks of a graph.

    The pool (Dask) queues, distributes, and repeats what a lost worker had; here it is
    decided what is submitted next, and outcomes are counted. The pool is opened for the
    first task that is to be done. ``on_failure`` receives every task that failed, its error
    (``found``, ``expected``, ``remedy``) and whether its worker died; ``on_note`` every sentence
    for the user; ``tick`` is called several times a second and may raise :class:`Stopped`.
    """

    def __init__(
        self,
        graph: TaskGraph,
        open_pool: Callable[[], Pool],
        *,
        on_failure: Callable[[Task, dict[str, Any], bool], None],
        on_note: Callable[[str], None],
        tick: Callable[[], None],
    ) -> None:
        self._graph, self._open_pool = graph, open_pool
        self._pool: Pool | None = None
        self._on_failure, self._on_note, self._tick = on_failure, on_note, tick
        self.counts = Counts()
        self.last: Task | None = None
        # Tasks in flight by key, each with others that have the same content.
        self.running: dict[str, list[Task]] = {}
        self._bundles = 0
        self._ready: deque[Task] = deque()
        # Newest first: one recording is finished before another is begun, so the list does
        # not grow with the number of recordings.
        self._sources: list[Iterator[Task]] = []
        self._resubmissions: Counter[str] = Counter()
        # The worker that has a recording's mesh open.
        self._homes: dict[str, str] = {}
        self._freed: str | None = None

    @property
    def workers(self) -> int:
        """Number of worker processes."""
        return 0 if self._pool is None else len(self._pool.workers())

    def run(self, tasks: Iterator[Task]) -> None:
        """Do these tasks and all that follow from them."""
        self._sources.append(tasks)
        while True:
            self._tick()
            self._fill()
            if not self.running and not self._ready:
                return
            assert self._pool is not None
            for ending in self._pool.ended(_POLL_S):
                self._take(ending)
                self._fill()

    def _fill(self) -> None:
        """Submit tasks while there are any and the pool has room."""
        while (task := self._next()) is not None:
            if self._pool is None:
                self._pool = self._open_pool()
            if self._bundles >= AHEAD * sum(self._pool.workers().values()):
                self._ready.appendleft(task)
                return
            self._submit(self._bundle(task))

    def _bundle(self, first: Task) -> tuple[Task, ...]:
        """Return a task and the next ones of the same step and recording."""
        bundle, most = [first], self._most_in_bundle(first)
        self.running[first.key] = []
        while len(bundle) < most and (task := self._next()) is not None:
            if (task.step, task.group) != (first.step, first.group):
                self._ready.appendleft(task)
                break
            bundle.append(task)
            self.running[task.key] = []
        return tuple(bundle)

    def _most_in_bundle(self, task: Task) -> int:
        done = self.counts.done[task.step]
        if not done or self._resubmissions[task.key]:
            return 1
        each_s = max(self.counts.seconds[task.step] / done, 1e-3)
        return min(max(int(_BUNDLE_S / each_s), 1), _LARGEST_BUNDLE)

    def _next(self) -> Task | None:
        """Return the next task to do; tasks whose result is there are counted and skipped."""
        while True:
            task = self._ready.popleft() if self._ready else self._from_sources()
            if task is None:
                return None
            if task.key in self.running:
                # The same content in another recording: it follows when that is done.
                self.running[task.key].append(task)
            elif self._graph.is_done(task):
                self._count_made_before(task)
                if self.counts.made_before[task.step] % 256 == 0:
                    self._tick()
            else:
                return task

    def _from_sources(self) -> Task | None:
        while self._sources:
            task = next(self._sources[-1], None)
            if task is not None:
                return task
            self._sources.pop()
        return None

    def _submit(self, bundle: tuple[Task, ...]) -> None:
        """Submit to the worker that has the recording open, else to the one just freed."""
        home = self._homes.get(bundle[0].group, self._freed)
        if home is not None:
            self._homes[bundle[0].group] = home
        assert self._pool is not None
        self._pool.submit(bundle, home)
        self._bundles += 1

    def _take(self, ending: Ending) -> None:
        self._bundles -= 1
        if ending.worker is not None:
            self._freed = ending.worker
            self._homes[ending.tasks[0].group] = ending.worker
        outcomes: Sequence[Outcome | None] = ending.outcomes or [
            self._lost(task, ending) for task in ending.tasks
        ]
        for task, outcome in zip(ending.tasks, outcomes, strict=True):
            alike = self.running.pop(task.key)
            for _ in range(outcome.deaths if outcome else 0):
                place = f" from place {task.placement}" if task.placement else ""
                words = f"{task.step} of {task.origin.name}{place}"
                self._on_note(f"A worker died during {words}")
            if outcome is None:
                self._resubmissions[task.key] += 1
                self._ready.extend((task, *alike))
            elif outcome.error is None:
                self._done(task, outcome.seconds)
                for other in alike:
                    self._count_made_before(other)
            elif outcome.fatal:
                raise Sd2Error(**outcome.error)
            else:
                for one in (task, *alike):
                    self._fail(one, outcome.error, outcome.worker_died)

    def _lost(self, task: Task, ending: Ending) -> Outcome | None:
        """Outcome of a task whose bundle did not return; None where it is submitted again."""
        if self._graph.is_done(task):
            return Outcome()
        deaths = deaths_during(self._graph.folder.path, task.key) if ending.killed else 0
        if deaths or self._resubmissions[task.key] >= _MAX_RESUBMISSIONS:
            return too_many_deaths(max(deaths, 1))
        return None

    def _done(self, task: Task, seconds: float) -> None:
        if self._follow(task):
            self.counts.done[task.step] += 1
            self.counts.seconds[task.step] += seconds
            self.counts.work[task.step] += task.work
            self.last = task

    def _count_made_before(self, task: Task) -> None:
        if self._follow(task):
            self.counts.made_before[task.step] += 1

    def _follow(self, task: Task) -> bool:
        """Queue the tasks after this one; False where its result is unusable (a failure)."""
        try:
            self._sources.append(self._graph.after(task))
        except Sd2Error as error:
            self._fail(task, error.arguments)
            return False
        return True

    def _fail(self, task: Task, error: dict[str, Any], worker_died: bool = False) -> None:
        self.counts.failed[task.step] += 1
        self.counts.waiting += Counter(self._graph.lost_with(task))
        self._on_failure(task, error, worker_died)

    def left_s(self) -> float | None:
        """Estimated seconds to the end; None while a step has not been timed."""
        seconds, workers = 0.0, self.workers
        for step, total in self._graph.total.items():
            left = total - self.counts.settled(step)
            if left <= 0 or step == "export":
                continue
            if not self.counts.done[step]:
                return None
            seconds += left * self.counts.seconds[step] / self.counts.done[step]
        return seconds / workers if workers else None


def event_of(task: Task, folder: Path) -> dict[str, Any]:
    """Return the fields of a task in a line of the progress."""
    out = Path(task.out).relative_to(folder).as_posix() if task.out else None
    return {
        "step": task.step,
        "recording": task.origin.name,
        "placement": task.placement,
        "out": out,
    }
