"""A Dask scheduler and workers as processes of their own, on the loopback interface."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

import sd2core

_PATIENCE_S = 60.0


@dataclass
class Cluster:
    """Processes of a cluster.

    Parameters
    ----------
    address : str
    workers : list of subprocess.Popen
    """

    address: str
    workers: list[subprocess.Popen[bytes]]


@contextmanager
def cluster(folder: Path, workers: int) -> Iterator[Cluster]:
    """A scheduler and workers with one thread each."""
    folder.mkdir()
    about = folder / "scheduler.json"
    local = ["--host", "127.0.0.1", "--no-dashboard"]
    with ExitStack() as stack:
        begin = ("--port", "0", "--scheduler-file", str(about))
        stack.enter_context(_process(folder, "scheduler", *local, *begin))
        until_s = time.monotonic() + _PATIENCE_S
        while not about.exists() or not about.read_text().strip():
            assert time.monotonic() < until_s, "the scheduler does not begin"
            time.sleep(0.05)
        address = json.loads(about.read_text())["address"]
        own = ("--nthreads", "1", "--no-nanny", "--local-directory", str(folder))
        started = [
            stack.enter_context(_process(folder, "worker", address, *local, *own))
            for _ in range(workers)
        ]
        yield Cluster(address, started)


@contextmanager
def _process(folder: Path, what: str, *arguments: str) -> Iterator[subprocess.Popen[bytes]]:
    environment = {
        **os.environ,
        "PYTHONPATH": str(Path(sd2core.__file__).parent.parent),
        "OMP_NUM_THREADS": "1",
    }
    with (folder / f"{what}.log").open("ab") as log:
        process = subprocess.Popen(
            [sys.executable, "-m", "dask", what, *arguments],
            stdout=log,
            stderr=log,
            env=environment,
            cwd=folder,
        )
    try:
        yield process
    finally:
        process.kill()
        process.wait()
