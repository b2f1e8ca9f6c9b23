"""Processes that carry out tasks: Dask's, on this machine or on many."""

from __future__ import annotations

import hashlib
import logging
import queue
import time
import uuid
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from sd2core.batch.folder import BatchFolder
from sd2core.batch.keys import all_code_digest
from sd2core.batch.tasks import BEGUN, SomeFailed, Task, TaskFailed, probe, run_tasks
from sd2core.errors import Sd2Error
from sd2core.processes import ONE_THREAD

_CONNECT_S = 20.0
_LOOK_EVERY_S = 1.0
_CLOSE_S = 5.0

_LOCAL_SETTINGS = {
    # Which of the tasks of a lost worker ended it is found out here.
    "distributed.scheduler.allowed-failures": 0,
    # Results are files: nothing is kept that could be spilt to disk.
    "distributed.worker.memory.target": False,
    "distributed.worker.memory.spill": False,
    "distributed.worker.memory.pause": False,
    "distributed.scheduler.http.routes": [],
    "distributed.worker.http.routes": [],
    # Looking at themselves costs every process 3 % of a core, and nobody sees it.
    "distributed.worker.profile.enabled": False,
    "distributed.admin.tick.interval": "1s",
    "distributed.admin.system-monitor.interval": "5s",
}


@dataclass(frozen=True, eq=False)
class Ending:
    """How tasks that were given out together came to their end.

    Parameters
    ----------
    tasks : tuple of Task
    failures : tuple
        One per task; None for those that were done.
    killed : bool
        The process that they were given to is gone; some of them may have been done.
    """

    tasks: tuple[Task, ...]
    failures: tuple[TaskFailed | None, ...] = ()
    killed: bool = False


class Pool(Protocol):
    """What carries out tasks.

    Attributes
    ----------
    most_deaths : int
        How often a task may end its process before it is given up.
    """

    most_deaths: int

    def workers(self) -> Mapping[str, int]:
        """Names of the processes that are there now, and how many tasks each does at once."""

    def submit(self, tasks: tuple[Task, ...], worker: str) -> None:
        """Have tasks done one after the other, by this process if it stays."""

    def ended(self, timeout_s: float) -> list[Ending]:
        """What came to its end since the last call; waits for the first."""


class DaskPool:
    """Tasks on a Dask cluster.

    Parameters
    ----------
    client : distributed.Client
    folder : BatchFolder
    most_deaths : int
    """

    def __init__(self, client: Any, folder: BatchFolder, most_deaths: int) -> None:
        self.most_deaths = most_deaths
        self._client = client
        self._folder = folder
        # Two batches may share a scheduler; what they do has different names.
        place = str(folder.path.absolute())
        self._name = hashlib.sha256(f"{place}{uuid.uuid4()}".encode()).hexdigest()[:8]
        self._tries = 0
        self._endings: queue.SimpleQueue[tuple[tuple[Task, ...], Any]] = queue.SimpleQueue()
        self._futures: dict[str, Any] = {}
        self._workers: dict[str, int] = {}
        self._checked: set[str] = set()
        self._looked_s = float("-inf")

    def workers(self) -> Mapping[str, int]:
        """See :class:`Pool`; looked up once a second.

        Raises
        ------
        Sd2Error
            When one of them is of another version or does not see the folder, or the
            scheduler is gone.
        """
        now_s = time.monotonic()
        if now_s - self._looked_s >= _LOOK_EVERY_S or not self._workers:
            self._looked_s = now_s
            self._look()
        return self._workers

    def submit(self, tasks: tuple[Task, ...], worker: str) -> None:
        """See :class:`Pool`."""
        self._tries += 1
        name = f"{tasks[0].step}-{self._name}-{self._tries}"
        folder = self._folder.path.absolute()
        future = self._client.submit(
            run_tasks,
            [task.record(folder) for task in tasks],
            key=name,
            pure=False,
            workers=[worker],
            allow_other_workers=True,
        )
        self._futures[name] = future
        future.add_done_callback(lambda ended: self._endings.put((tasks, ended)))

    def ended(self, timeout_s: float) -> list[Ending]:
        """See :class:`Pool`."""
        endings: list[Ending] = []
        try:
            endings.append(self._ending(*self._endings.get(timeout=timeout_s)))
            while True:
                endings.append(self._ending(*self._endings.get_nowait()))
        except queue.Empty:
            return endings

    def _ending(self, tasks: tuple[Task, ...], future: Any) -> Ending:
        from distributed.scheduler import KilledWorker

        self._futures.pop(future.key, None)
        if future.status == "finished":
            return Ending(tasks, (None,) * len(tasks))
        error = future.exception() if future.status == "error" else None
        if isinstance(error, SomeFailed):
            return Ending(tasks, error.failures)
        if error is None or isinstance(error, KilledWorker):
            return Ending(tasks, killed=True)
        words = f"The worker cannot carry it out ({type(error).__name__}: {error})"
        return Ending(tasks, (TaskFailed(words, "", ""),) * len(tasks))

    def _look(self) -> None:
        try:
            threads = dict(self._client.nthreads())
            new = [address for address in threads if address not in self._checked]
            told = self._probed(new) if new else {}
        except OSError as error:
            raise Sd2Error(
                f"The scheduler does not answer any more ({error})",
                "a scheduler that stays",
                "Start it again, then the same command: what is done is kept",
            ) from error
        for address, about in told.items():
            _check_worker(address, about, self._folder.path)
            self._checked.add(address)
        self._workers = {one: count for one, count in threads.items() if one in self._checked}

    def _probed(self, addresses: list[str]) -> dict[str, dict[str, Any]]:
        from distributed.comm import CommClosedError

        token = uuid.uuid4().hex
        marker = self._folder.path / BEGUN / token
        marker.touch()
        try:
            told: dict[str, Any] = self._client.run(
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
        return {one: about for one, about in told.items() if not isinstance(about, gone)}


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
def local_pool(folder: BatchFolder, processes: int) -> Iterator[DaskPool]:
    """Processes on this machine, one thread each, that end with this one.

    Reachable on the loopback interface only, with keys that nobody else has, without a
    dashboard.
    """
    with _dask_log(folder), local_client(folder.path / BEGUN, processes) as client:
        yield DaskPool(client, folder, most_deaths=2)


@contextmanager
def local_client(scratch: Path, processes: int) -> Iterator[Any]:
    """Client of a cluster on this machine, as :func:`local_pool` has it.

    Parameters
    ----------
    scratch : Path
        Where Dask may put files.
    processes : int
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
            preload=["sd2core.batch.interrupts"],
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
    """Keys of one cluster, made now and kept in memory; None where they cannot be made."""
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
def scheduler_pool(folder: BatchFolder, address: str) -> Iterator[DaskPool]:
    """Workers of a ``dask-scheduler`` that runs already.

    Raises
    ------
    Sd2Error
        When it does not answer.
    """
    from distributed import Client

    with _dask_log(folder):
        try:
            client = Client(address, timeout=_CONNECT_S, set_as_default=False)
        except (OSError, ValueError, TimeoutError) as error:
            raise Sd2Error(
                f"No scheduler answers at {address} ({error})",
                "the address of a dask-scheduler, such as tcp://10.0.0.5:8786",
                "Start one with `dask scheduler`",
            ) from error
        try:
            # The scheduler has tried it on several workers by then.
            yield DaskPool(client, folder, most_deaths=1)
        finally:
            client.close(timeout=_CLOSE_S)


@contextmanager
def _dask_log(folder: BatchFolder) -> Iterator[None]:
    """What Dask says goes to the log of the batch, not to the terminal."""
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
