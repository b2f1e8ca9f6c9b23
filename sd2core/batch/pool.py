"""Dask's worker processes, on this machine or on many."""

from __future__ import annotations

import logging
import queue
import signal
import time
import uuid
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Any

from sd2core.batch.folder import BatchFolder
from sd2core.batch.plan import STEPS
from sd2core.batch.tasks import BEGUN, Outcome, Task, probe, run_tasks
from sd2core.errors import Sd2Error
from sd2core.files.keys import all_code_digest
from sd2core.processes import ONE_THREAD

_CONNECT_S = 20.0
_LOOK_EVERY_S = 1.0
_CLOSE_S = 5.0

_LOCAL_SETTINGS = {
    # A task counts the workers that died during it by itself (`sd2core.batch.tasks`); Dask also
    # counts those that it only waited for.
    "distributed.scheduler.allowed-failures": 20,
    # Results are files: nothing is kept that could be spilt to disk.
    "distributed.worker.memory.target": False,
    "distributed.worker.memory.spill": False,
    "distributed.worker.memory.pause": False,
    "distributed.scheduler.http.routes": [],
    "distributed.worker.http.routes": [],
    # Self-monitoring costs every process 3 % of a core, and is not shown anywhere.
    "distributed.worker.profile.enabled": False,
    "distributed.admin.tick.interval": "1s",
    "distributed.admin.system-monitor.interval": "5s",
}


@dataclass(frozen=True, eq=False)
class Ending:
    """End of a bundle of tasks."""

    tasks: tuple[Task, ...]
    outcomes: Sequence[Outcome] | None = None
    """One per task; None where the bundle did not return."""
    worker: str | None = None
    killed: bool = False  # True where it did not return because workers died too often


class Pool:
    """Processes of a Dask cluster that do tasks, and repeat those of a process that died.

    A task that has ended ``most_deaths`` workers is given up.
    """

    def __init__(self, client: Any, folder: BatchFolder, most_deaths: int) -> None:
        self._client, self._folder, self._most_deaths = client, folder, most_deaths
        # Two batches may share a scheduler; their tasks have different names.
        self._name = uuid.uuid4().hex[:8]
        self._submissions = count()
        self._ended: queue.SimpleQueue[tuple[tuple[Task, ...], Any]] = queue.SimpleQueue()
        self._futures: dict[str, Any] = {}
        self._workers: dict[str, int] = {}
        self._checked: set[str] = set()
        self._looked_s = float("-inf")

    def workers(self) -> Mapping[str, int]:
        """Return the addresses of the workers with their numbers of threads.

        The scheduler is asked once a second.
        """
        now_s = time.monotonic()
        if now_s - self._looked_s >= _LOOK_EVERY_S or not self._workers:
            self._looked_s = now_s
            self._look()
        return self._workers

    def submit(self, tasks: tuple[Task, ...], worker: str | None) -> None:
        """Have tasks done one after the other, by this worker if it is there and not busy."""
        future = self._client.submit(
            _run_here,
            list(tasks),
            str(self._folder.path.absolute()),
            self._most_deaths,
            key=f"{tasks[0].step}-{self._name}-{next(self._submissions)}",
            pure=False,
            workers=None if worker is None else [worker],
            allow_other_workers=worker is not None,
            # What is nearest to its end goes first.
            priority=STEPS.index(tasks[0].step),
        )
        self._futures[future.key] = future
        future.add_done_callback(lambda ended: self._ended.put((tasks, ended)))

    def ended(self, timeout_s: float) -> list[Ending]:
        """Return what has ended since the last call; waits for the first."""
        endings: list[Ending] = []
        with suppress(queue.Empty):
            endings.append(self._ending(*self._ended.get(timeout=timeout_s)))
            while True:
                endings.append(self._ending(*self._ended.get_nowait()))
        return endings

    def _ending(self, tasks: tuple[Task, ...], future: Any) -> Ending:
        from distributed import CancelledError
        from distributed.scheduler import KilledWorker

        self._futures.pop(future.key, None)
        try:
            worker, outcomes = future.result(timeout=_CONNECT_S)
            return Ending(tasks, outcomes, worker)
        except KilledWorker:
            return Ending(tasks, killed=True)
        except (OSError, CancelledError):  # the scheduler or the result is gone
            return Ending(tasks)
        except Exception as error:
            message = f"The worker cannot run it ({type(error).__name__}: {error})"
        failed = Outcome(error=Sd2Error(message).arguments)
        return Ending(tasks, [failed] * len(tasks))

    def _look(self) -> None:
        try:
            threads = dict(self._client.nthreads())
            new = [address for address in threads if address not in self._checked]
            answers = self._probed(new) if new else {}
        except OSError as error:
            raise Sd2Error(
                f"The scheduler does not answer any more ({error})",
                "a scheduler that stays",
                "Start it again, then the same command: what is done is kept",
            ) from error
        for address, about in answers.items():
            _check_worker(address, about, self._folder.path)
            self._checked.add(address)
        self._workers = {one: count for one, count in threads.items() if one in self._checked}

    def _probed(self, addresses: list[str]) -> dict[str, dict[str, Any]]:
        from distributed.comm import CommClosedError

        token = uuid.uuid4().hex
        marker = self._folder.path / BEGUN / token
        marker.touch()
        try:
            answers: dict[str, Any] = self._client.run(
                probe,
                str(self._folder.path.absolute()),
                token,
                workers=addresses,
                on_error="return",
            )
        finally:
            marker.unlink(missing_ok=True)
        # One that has gone meanwhile is none.
        gone = (CommClosedError, ConnectionError, TimeoutError)
        return {one: about for one, about in answers.items() if not isinstance(about, gone)}


def _run_here(tasks: list[Task], folder: str, most_deaths: int) -> tuple[str, list[Outcome]]:
    """Do tasks in a worker; returns its address as well."""
    from distributed import get_worker

    return get_worker().address, run_tasks(tasks, Path(folder), most_deaths)


def dask_setup(worker: Any) -> None:
    """Ignore Ctrl-C: the terminal sends it to all processes, and the parent decides.

    Dask calls it when a local worker starts (``preload``).
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _check_worker(address: str, about: Any, folder: Path) -> None:
    if isinstance(about, BaseException):
        raise Sd2Error(
            f"The worker {address} cannot use SD² Studio ({type(about).__name__}: {about})",
            "SD² Studio and its dependencies in the environment of every worker",
            "Install the same version there, and start the worker again",
        )
    if about["code"] != all_code_digest():
        raise Sd2Error(
            f"The worker {address} on {about['host']} has another version of SD² Studio",
            "the same one everywhere",
            "Install the same version there, and start the worker again",
        )
    if not about["sees"]:
        raise Sd2Error(
            f"The worker {address} on {about['host']} does not see {folder.absolute()}",
            "a file system that all machines share, under the same path",
            "Mount it there, or work on this machine only (without --scheduler)",
        )


@contextmanager
def opened_pool(folder: BatchFolder, processes: int, scheduler: str | None) -> Iterator[Pool]:
    """Open the workers of a running ``dask-scheduler``, or else so many on this machine."""
    with _dask_log(folder), _client(folder.path / BEGUN, processes, scheduler) as client:
        # Workers of a cluster may be taken away at any time.
        yield Pool(client, folder, most_deaths=4 if scheduler else 2)


@contextmanager
def study_client(
    scratch: Path, processes: int, scheduler: str | None
) -> Iterator[tuple[Any, Callable[[Iterable[Any]], Iterable[Any]]]]:
    """Return a client of this machine or of a scheduler, and what yields futures when done."""
    from distributed import as_completed

    with _client(scratch, processes, scheduler) as client:
        yield client, lambda futures: as_completed(futures, loop=client.loop)


def _client(scratch: Path, processes: int, scheduler: str | None) -> AbstractContextManager[Any]:
    return _scheduler_client(scheduler) if scheduler else local_client(scratch, processes)


@contextmanager
def local_client(scratch: Path, processes: int) -> Iterator[Any]:
    """Start processes on this machine, one thread each, that end with this one.

    Reachable on the loopback interface only, with keys of its own, without a dashboard. Dask may
    put files into ``scratch``.
    """
    import dask
    from distributed import Client, LocalCluster

    with dask.config.set(_LOCAL_SETTINGS):
        cluster = LocalCluster(
            n_workers=processes,
            threads_per_worker=1,
            processes=True,
            host="127.0.0.1",
            dashboard_address="127.0.0.1:0",
            scheduler_kwargs={"dashboard": False},
            preload=["sd2core.batch.pool"],
            silence_logs=logging.CRITICAL,
            security=_security(),
            local_directory=str(scratch),
            env=ONE_THREAD,
        )
        try:
            client = Client(cluster, set_as_default=False)
            try:
                yield client
            finally:
                client.close(timeout=_CLOSE_S)
        finally:
            cluster.close(timeout=_CLOSE_S)


def _security() -> Any:
    """Create TLS keys of one cluster in memory; None where they cannot be made."""
    from distributed import Security

    try:
        return Security.temporary()
    except ImportError:
        logging.getLogger("distributed").warning(
            "The package cryptography is missing: other users of this machine could connect to"
            " the processes of this batch"
        )
        return None


@contextmanager
def _scheduler_client(address: str) -> Iterator[Any]:
    from distributed import Client

    try:
        client = Client(address, timeout=_CONNECT_S, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise Sd2Error(
            f"No scheduler answers at {address} ({error})",
            "the address of a dask-scheduler, such as tcp://10.0.0.5:8786",
            "Start one with `dask scheduler`",
        ) from error
    try:
        yield client
    finally:
        client.close(timeout=_CLOSE_S)


@contextmanager
def _dask_log(folder: BatchFolder) -> Iterator[None]:
    """Send Dask's messages to the log of the batch, not to the terminal."""
    loggers = [logging.getLogger(name) for name in ("distributed", "bokeh", "tornado")]
    handler = logging.FileHandler(folder.log, encoding="utf-8")
    handler.setFormatter(logging.Formatter("%(asctime)s %(name)s %(levelname)s %(message)s"))
    before = [(logger.propagate, list(logger.handlers)) for logger in loggers]
    for logger in loggers:
        logger.propagate, logger.handlers = False, [handler]
    try:
        yield
    finally:
        for logger, (propagate, handlers) in zip(loggers, before, strict=True):
            logger.propagate, logger.handlers = propagate, handlers
        handler.close()
