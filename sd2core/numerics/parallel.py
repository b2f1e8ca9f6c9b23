"""Jobs on the kernel threads, with progress and cancellation."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from itertools import islice
from typing import Any, TypeVar

from sd2core.numerics.compiled import on_worker, worker_count, workers
from sd2core.progress import Cancelled, Progress

Result = TypeVar("Result")
_POLL_S = 0.03
_QUEUED = 8
"""Jobs that wait for every thread: those of an hour of frames would be a lot of futures."""


class Ticket:
    """Progress and cancellation of running jobs.

    ``heard`` is called in the worker's own thread with the amount finished so far.
    """

    def __init__(self, heard: Callable[[int], None] | None = None) -> None:
        self.finished = 0
        self.processor_s = 0.0
        self._heard = heard
        self._stopped = threading.Event()
        self._lock = threading.Lock()

    def advance(self, amount: int) -> None:
        """Report an amount of work as done. Raises Cancelled if the result is no longer wanted."""
        if self._stopped.is_set():
            raise Cancelled
        with self._lock:
            self.finished += amount
        if self._heard is not None:
            self._heard(self.finished)

    def run(self, job: Callable[[Ticket], None]) -> None:
        """Run a job in this thread and add its processor time."""
        start_s = time.thread_time()
        try:
            job(self)
        finally:
            with self._lock:
                self.processor_s += time.thread_time() - start_s

    def stop(self) -> None:
        """Make every job stop at its next report."""
        self._stopped.set()


def spread(work: Callable[..., Result], *arguments: Iterable[Any]) -> Iterator[Result]:
    """Results of a function over the kernel threads, in order, as ``map`` gives them.

    On one of these threads they are computed there: were all of them to wait for each other's
    results, none would come.
    """
    return map(work, *arguments) if on_worker() else workers().map(work, *arguments)


def run_light_jobs(
    jobs: Sequence[Callable[[Ticket], None]], total: int, progress: Progress
) -> float:
    """Run jobs of some tenths of a millisecond, as :func:`run_jobs` does, in this thread too.

    Other threads do what they can get at: waiting for all of them to wake would take as long as
    the work itself.
    """
    progress(0, total)
    ticket, waiting = Ticket(), deque(jobs)

    def work() -> None:
        while waiting:
            try:
                job = waiting.popleft()
            except IndexError:  # another thread was quicker
                return
            ticket.run(job)

    others = [workers().submit(work) for _ in range(min(worker_count(), len(jobs)) - 1)]
    try:
        work()
        progress(total, total)
    except BaseException:
        ticket.stop()
        raise
    finally:
        running = [other for other in others if not other.cancel()]
        wait(running)
    for other in running:
        other.result()
    return ticket.processor_s


def run_jobs(
    jobs: Sequence[Callable[[Ticket], None]],
    total: int,
    progress: Progress,
    threads: int | None = None,
) -> float:
    """Run all jobs, wait until they are done, and return their processor time in seconds.

    The time is that of all threads together, which other programs on this machine do not
    change. When ``progress`` raises, or a job does, the others stop at their next report
    before the exception goes on.

    Parameters
    ----------
    jobs : sequence of callables
        Each is called with the :class:`Ticket` by which it reports.
    total : int
        Amount of work in all jobs.
    progress : Progress
        Called in the calling thread, at least every 30 ms.
    threads : int, optional
        Jobs at a time, by default one per core; 1 runs them one after the other in the calling
        thread, with progress at every report, as on a kernel thread (:func:`spread`).
    """
    progress(0, total)
    if threads == 1 or on_worker():
        # Each report is passed on, and may stop the job by raising.
        own = Ticket(lambda finished: progress(finished, total))
        for job in jobs:
            own.run(job)
        return own.processor_s
    ticket, waiting = Ticket(), iter(jobs)
    running: set[Future[None]] = set()
    most = _QUEUED * worker_count() if threads is None else threads

    def start() -> None:
        free = most - len(running)
        running.update(workers().submit(ticket.run, job) for job in islice(waiting, free))

    try:
        start()
        while running:
            ended, running = wait(running, _POLL_S, FIRST_COMPLETED)
            for future in ended:
                future.result()
            progress(ticket.finished, total)
            start()
    except BaseException:
        ticket.stop()
        for future in running:
            future.cancel()
        wait(running)
        raise
    return ticket.processor_s
