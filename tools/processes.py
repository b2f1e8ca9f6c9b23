"""Jobs that several processes share."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from typing import Any, TypeVar

from sd2core.processes import end_with_parent

Job = TypeVar("Job")
Result = TypeVar("Result")


def finished(
    work: Callable[[Job], Result],
    jobs: Sequence[Job],
    processes: int,
    start: Callable[..., None] = end_with_parent,
    given: tuple[Any, ...] = (),
) -> Iterator[tuple[Job, Result]]:
    """Jobs with their results, as they are done; whoever stops does not wait for the rest.

    Parameters
    ----------
    work : callable
        Does a job; of a module, as its arguments and results are sent to and from processes.
    jobs : sequence
    processes : int
        At work at once.
    start : callable
        Begins each process, with what is ``given``.
    """
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(processes, context, start, given) as pool:
        try:
            running = {pool.submit(work, job): job for job in jobs}
            for future in as_completed(running):
                yield running[future], future.result()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
