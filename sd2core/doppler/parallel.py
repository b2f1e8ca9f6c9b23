"""Running pieces of work on the kernel threads, with progress and cancellation."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait

from sd2core.compiled import workers
from sd2core.progress import Cancelled, Progress

_POLL_S = 0.03


class Ticket:
    """What a running piece of work reports to, and asks whether to go on."""

    def __init__(self) -> None:
        self.finished = 0
        self._stopped = threading.Event()
        self._lock = threading.Lock()

    def advance(self, amount: int) -> None:
        """So much more is done.

        Raises
        ------
        Cancelled
            When the result is no longer wanted.
        """
        if self._stopped.is_set():
            raise Cancelled
        with self._lock:
            self.finished += amount

    def stop(self) -> None:
        """Make every piece of work stop at its next report."""
        self._stopped.set()


def run_jobs(jobs: Sequence[Callable[[Ticket], None]], total: int, progress: Progress) -> None:
    """Run all jobs; return when they are done.

    ``progress`` is called in the calling thread, at least every 30 ms. When it
    raises, or a job does, the others stop at their next report before the
    exception goes on.
    """
    ticket = Ticket()
    progress(0, total)
    pending: set[Future[None]] = {workers().submit(job, ticket) for job in jobs}
    running = set(pending)
    try:
        while running:
            ended, running = wait(running, _POLL_S, FIRST_COMPLETED)
            for future in ended:
                future.result()
            progress(ticket.finished, total)
    except BaseException:
        ticket.stop()
        for future in pending:
            future.cancel()
        wait(pending)
        raise
