"""Tasks: small records that a worker applies to paths, and that may be done again."""

from __future__ import annotations

import os
import platform
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

from sd2core.batch.folder import BatchFolder
from sd2core.batch.inputs import MeshInput, Origin, inspect
from sd2core.batch.plan import Step
from sd2core.errors import Sd2Error
from sd2core.files.atomic import DISK_FULL
from sd2core.files.keys import all_code_digest

BEGUN = "begun"
"""Folder of the tasks under way; it exists only while a batch runs."""

_ONE_FILE = ("synthesise", "denoise", "simulate")
"""Steps that are done when their last file is there."""


@dataclass(frozen=True, eq=False)
class Task:
    """Function of paths and small values whose result is a file."""

    step: Step
    key: str  # name of the result: tasks of one key have the same result
    origin: Origin
    arguments: Mapping[str, Any]  # small values and paths, which a worker can be sent
    placement: int | None = None
    frames: int = 0  # to work on
    group: str = ""  # best done by one process
    out: str = ""  # file that is written last; empty where that is not a file of its own

    @property
    def work(self) -> int:
        """Amount that the time grows with: frames, times vertices where it is made of a mesh."""
        mesh: MeshInput | None = self.arguments.get("mesh")
        return max(self.frames, 1) * (1 if mesh is None else mesh.vertices)


@dataclass(frozen=True)
class Outcome:
    """Result of one task, as the worker sends it back."""

    seconds: float = 0.0
    error: dict[str, Any] | None = None  # "found", "expected" and "remedy" of a failed task
    fatal: bool = False  # True if no other task can be done either
    deaths: int = 0  # workers that died during earlier attempts
    worker_died: bool = False  # True if the task is given up because of that


def _failed(message: str, expected: str = "", remedy: str = "", **more: Any) -> Outcome:
    return Outcome(error=Sd2Error(message, expected, remedy).arguments, **more)


def too_many_deaths(deaths: int) -> Outcome:
    """Return the failure of a task that ended its worker so many times."""
    return _failed(
        f"Its worker died {deaths} times",
        "a task that its process survives",
        "It may have needed more memory than there is: see log.txt",
        deaths=deaths,
        worker_died=True,
    )


def run_tasks(tasks: Sequence[Task], folder: Path, most_deaths: int = 2) -> list[Outcome]:
    """Do tasks in this process, one after the other; after a fatal failure none."""
    outcomes: list[Outcome] = []
    for task in tasks:
        if outcomes and outcomes[-1].fatal:
            outcomes.append(outcomes[-1])
        else:
            outcomes.append(run_task(task, BatchFolder(folder), most_deaths))
    return outcomes


def run_task(task: Task, folder: BatchFolder, most_deaths: int) -> Outcome:
    """Do a task in this process.

    A marker file holds one line per attempt; it stays where an attempt ends the process, so
    the next one knows of it.
    """
    marker = _marker(folder.path, task.key)
    begun_s = time.perf_counter()
    try:
        deaths = deaths_during(folder.path, task.key)
        if deaths >= most_deaths:
            marker.unlink(missing_ok=True)
            return too_many_deaths(deaths)
        with marker.open("a", encoding="utf-8") as stream:
            stream.write(f"{platform.node()} {os.getpid()}\n")
        outcome = _attempt(folder, task)
        marker.unlink(missing_ok=True)
    except OSError as error:
        return _os_failure(error)
    return replace(outcome, seconds=time.perf_counter() - begun_s, deaths=deaths)


def _attempt(folder: BatchFolder, task: Task) -> Outcome:
    try:
        if task.out and os.path.exists(task.out) and task.step in _ONE_FILE:
            return Outcome()  # a worker that was lost had just written it
        _compile_once()
        _do(task.step, folder, task.origin, task.arguments)
    except Sd2Error as error:
        return Outcome(error=error.arguments)
    except MemoryError as error:
        return _failed(f"There is not enough memory for this ({error})")
    except OSError as error:
        return _os_failure(error)
    except Exception as error:
        about = f"This should not happen ({type(error).__name__}: {error})"
        return _failed(about, remedy="Please report it")
    return Outcome()


def _os_failure(error: OSError) -> Outcome:
    about = f"{error.filename}: {error.strerror}" if error.filename else str(error)
    return _failed(about, fatal=error.errno in DISK_FULL)


def deaths_during(folder: Path, key: str) -> int:
    """Count the processes that began this task and did not end it."""
    try:
        return len(_marker(folder, key).read_text(encoding="utf-8").splitlines())
    except FileNotFoundError:
        return 0


def _marker(folder: Path, key: str) -> Path:
    return folder / BEGUN / f"task-{key}"


def probe(folder: str, token: str) -> dict[str, Any]:
    """Return the code digest of a worker, its host, and whether it sees the folder."""
    path = Path(folder) / BEGUN / token
    return {"code": all_code_digest(), "sees": path.exists(), "host": platform.node()}


@lru_cache(maxsize=1)
def _compile_once() -> None:
    from sd2core.numerics.compiled import kernels_ready, warm_up

    if not kernels_ready():
        warm_up()


def _do(step: Step, folder: BatchFolder, origin: Origin, arguments: Mapping[str, Any]) -> None:
    """Do the work of a step, whose modules only those load that do it."""
    if step == "inspect":
        inspect(folder, origin)
    elif step == "fit":
        from sd2core.batch.fitting import fit_to_video

        fit_to_video(**arguments)
    elif step == "synthesise":
        from sd2core.batch.synthesis import synthesise

        synthesise(**arguments)
    elif step == "denoise":
        from sd2core.batch.denoising import denoise

        denoise(**arguments)
    elif step == "simulate":
        from sd2core.batch.synthesis import simulate

        simulate(**arguments)
    else:
        from sd2core.batch.exporting import export_dataset

        export_dataset(folder, **arguments)
