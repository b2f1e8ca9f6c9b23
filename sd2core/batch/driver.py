"""Gives tasks to processes, few at a time, and follows what becomes of them."""

from __future__ import annotations

import time
from collections import Counter, OrderedDict, defaultdict, deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from sd2core.batch.pool import Ending, Pool
from sd2core.batch.task_graph import Flow
from sd2core.batch.tasks import Task, TaskFailed, killed_in
from sd2core.errors import Sd2Error

AHEAD = 4
"""Bundles that each process is given before it has done the first: it never waits for the
next, and a million tasks do not wait in the scheduler."""

_BUNDLE_S = 1.0
_LARGEST_BUNDLE = 32
"""Tasks of one recording that take little are given out together, for about a second: to give
out anything takes some milliseconds."""

_POLL_S = 0.2
_MOST_RETURNS = 20
_HOMES = 1000


@dataclass
class Tally:
    """What has become of the tasks, per step.

    Parameters
    ----------
    there : Counter
        Made already, by an earlier run.
    done : Counter
        Made by this one.
    failed : Counter
    waiting : Counter
        Not done because of those.
    seconds : mapping
    frames : Counter
        That those done took and held.
    """

    there: Counter[str] = field(default_factory=Counter)
    done: Counter[str] = field(default_factory=Counter)
    failed: Counter[str] = field(default_factory=Counter)
    waiting: Counter[str] = field(default_factory=Counter)
    seconds: defaultdict[str, float] = field(default_factory=lambda: defaultdict(float))
    frames: Counter[str] = field(default_factory=Counter)

    def settled(self, step: str) -> int:
        """Tasks of a step that nothing is to be done for any more."""
        return self.there[step] + self.done[step] + self.failed[step] + self.waiting[step]


@dataclass(frozen=True)
class Failure:
    """A task that cannot be done.

    Parameters
    ----------
    task : Task
    error : dict
        ``found``, ``expected``, ``remedy``.
    worker_died : bool
    """

    task: Task
    error: dict[str, str]
    worker_died: bool = False


class Stopped(Exception):
    """Somebody asked for the end."""


class Driver:
    """One run over all tasks of a flow.

    Parameters
    ----------
    flow : Flow
    open_pool : callable
        Gives what carries out tasks; called when the first one is to be done.
    on_failure : callable
        Told every failure.
    on_note : callable
        Told what the user should know.
    tick : callable
        Called several times a second; may raise :class:`Stopped`.
    """

    def __init__(
        self,
        flow: Flow,
        open_pool: Callable[[], Pool],
        *,
        on_failure: Callable[[Failure], None],
        on_note: Callable[[str], None],
        tick: Callable[[], None],
    ) -> None:
        self._flow, self._open_pool = flow, open_pool
        self._pool: Pool | None = None
        self._on_failure, self._on_note, self._tick = on_failure, on_note, tick
        self.tally = Tally()
        self.last: Task | None = None
        self.running: dict[str, _Running] = {}
        self._load: Counter[str] = Counter()
        self._again: deque[Task] = deque()
        # Newest first: a recording is brought to its end before another is begun, so what
        # waits here does not grow with their number.
        self._sources: list[Iterator[Task]] = []
        self._deaths: Counter[str] = Counter()
        self._returns: Counter[str] = Counter()
        self._homes: OrderedDict[str, set[str]] = OrderedDict()
        self._ended_s: dict[str, float] = {}

    @property
    def workers(self) -> int:
        """Processes that are there."""
        return 0 if self._pool is None else len(self._pool.workers())

    def run(self, tasks: Iterator[Task]) -> None:
        """Do these tasks and all that follows from them.

        Raises
        ------
        Sd2Error
            When nothing more can be done at all.
        Stopped
        """
        self._sources.append(tasks)
        while True:
            self._tick()
            self._fill()
            if not self.running and not self._again:
                return
            assert self._pool is not None
            for ending in self._pool.ended(_POLL_S):
                self._take(ending)

    def _fill(self) -> None:
        """Give out tasks as long as there are any and somebody has room."""
        while (task := self._next()) is not None:
            free = self._free()
            if not free:
                self._again.appendleft(task)
                return
            self._submit(self._bundle(task), free)

    def _bundle(self, first: Task) -> tuple[Task, ...]:
        """A task and those after it that are like it."""
        bundle, most = [first], self._most_in_bundle(first)
        # Until they are given out others may turn out to be the same.
        self.running[first.key] = _Running("", 0.0)
        while len(bundle) < most and (task := self._next()) is not None:
            alike = (task.step, task.group) == (first.step, first.group)
            if not alike or self._returns[task.key]:
                self._again.appendleft(task)
                break
            bundle.append(task)
            self.running[task.key] = _Running("", 0.0)
        return tuple(bundle)

    def _most_in_bundle(self, task: Task) -> int:
        done = self.tally.done[task.step]
        # One that was lost goes alone.
        if not done or self._returns[task.key]:
            return 1
        each_s = max(self.tally.seconds[task.step] / done, 1e-3)
        return min(max(int(_BUNDLE_S / each_s), 1), _LARGEST_BUNDLE)

    def _next(self) -> Task | None:
        """The next task that is to be done; what is there already is passed over."""
        while True:
            task = self._again.popleft() if self._again else self._of_sources()
            if task is None:
                return None
            if task.key in self.running:
                # Of two recordings with the same content: it goes on when that is there.
                self.running[task.key].others.append(task)
            elif self._flow.is_done(task):
                if self._go_on(task):
                    self.tally.there[task.step] += 1
                if self.tally.there[task.step] % 256 == 0:
                    self._tick()
            else:
                return task

    def _of_sources(self) -> Task | None:
        """The next one of the newest source that has one."""
        while self._sources:
            task = next(self._sources[-1], None)
            if task is not None:
                return task
            self._sources.pop()
        return None

    def _free(self) -> dict[str, int]:
        """Processes that have room, and for how many tasks."""
        if self._pool is None:
            self._pool = self._open_pool()
        workers = self._pool.workers()
        free = {one: AHEAD * threads - self._load[one] for one, threads in workers.items()}
        return {one: room for one, room in free.items() if room > 0}

    def _submit(self, bundle: tuple[Task, ...], free: dict[str, int]) -> None:
        """To who has worked on the same recording, else to who has most room."""
        group = bundle[0].group
        homes = self._homes.setdefault(group, set())
        self._homes.move_to_end(group)
        if len(self._homes) > _HOMES:
            self._homes.popitem(last=False)
        known = [one for one in homes if one in free]
        worker = max(known or free, key=lambda one: free[one])
        homes.add(worker)
        self._load[worker] += 1
        for task in bundle:
            running = self.running[task.key]
            running.worker, running.since_s = worker, time.monotonic()
        assert self._pool is not None
        self._pool.submit(bundle, worker)

    def _take(self, ending: Ending) -> None:
        tasks = ending.tasks
        running = [self.running.pop(task.key) for task in tasks]
        worker = running[0].worker
        self._load[worker] -= 1
        now_s = time.monotonic()
        begun_s = max(self._ended_s.get(worker, 0.0), running[0].since_s)
        each_s = (now_s - begun_s) / len(tasks)
        self._ended_s[worker] = now_s
        failures = ending.failures or (None,) * len(tasks)
        for task, own, failure in zip(tasks, running, failures, strict=True):
            if ending.killed and not self._flow.is_done(task):
                self._return(task)
                self._again.extend(own.others)
            elif failure is None:
                self._done(task, each_s)
                for other in own.others:
                    if self._go_on(other):
                        self.tally.there[task.step] += 1
            elif failure.fatal:
                raise Sd2Error(**failure.error)
            else:
                for one in (task, *own.others):
                    self._fail(one, failure)

    def _done(self, task: Task, seconds: float) -> None:
        if self._go_on(task):
            self.tally.done[task.step] += 1
            self.tally.seconds[task.step] += seconds
            self.tally.frames[task.step] += task.frames
            self.last = task

    def _return(self, task: Task) -> None:
        """A process is gone: its task is done again, unless it is what ends them."""
        self._returns[task.key] += 1
        if killed_in(self._flow.folder.path, task.key):
            self._deaths[task.key] += 1
            self._on_note(f"A worker died during {words_of(task)}")
        assert self._pool is not None
        dead = self._deaths[task.key] >= self._pool.most_deaths
        if dead or self._returns[task.key] > _MOST_RETURNS:
            failure = TaskFailed(
                f"Its worker died {max(self._deaths[task.key], 1)} times",
                "a task that its process survives",
                "It may have needed more memory than there is: see log.txt",
            )
            self._fail(task, failure, worker_died=True)
        else:
            self._again.append(task)

    def _go_on(self, task: Task) -> bool:
        """Queue what follows a task; False where its result is of no use, which is a failure."""
        try:
            self._sources.append(self._flow.after(task))
        except Sd2Error as error:
            self._fail(task, TaskFailed(error.found, error.expected, error.remedy))
            return False
        return True

    def _fail(self, task: Task, failure: TaskFailed, worker_died: bool = False) -> None:
        self.tally.failed[task.step] += 1
        self.tally.waiting += Counter(self._flow.lost_with(task))
        self._on_failure(Failure(task, failure.error, worker_died))

    def left_s(self) -> float | None:
        """Seconds of work that are left, as far as steps have been timed by now."""
        seconds, workers = 0.0, self.workers
        for step, total in self._flow.total.items():
            left = total - self.tally.settled(step)
            if left <= 0 or step == "export":
                continue
            if not self.tally.done[step]:
                return None
            seconds += left * self.tally.seconds[step] / self.tally.done[step]
        return seconds / workers if workers else None


@dataclass
class _Running:
    worker: str
    since_s: float
    others: list[Task] = field(default_factory=list)


def words_of(task: Task) -> str:
    """A task in words, such as ``synthesise of walk.sd2 from place 3``."""
    place = f" from place {task.placement}" if task.placement else ""
    return f"{task.step} of {task.origin.name}{place}"


def event_of(task: Task, folder: Path) -> dict[str, Any]:
    """A task as the lines of the progress have it."""
    out = Path(task.out).relative_to(folder).as_posix() if task.out else None
    return {
        "step": task.step,
        "recording": task.origin.name,
        "placement": task.placement,
        "out": out,
    }
