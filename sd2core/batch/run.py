"""One run of a batch, from the plan to the report."""

from __future__ import annotations

import json
import shutil
import time
from collections.abc import Callable
from contextlib import AbstractContextManager, ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from sd2core.batch.driver import Driver, Stopped, event_of
from sd2core.batch.estimate import pace_kind
from sd2core.batch.exporting import dataset_path
from sd2core.batch.folder import PROGRESS_FORMAT, PROGRESS_VERSION, BatchFolder
from sd2core.batch.inputs import find_origins
from sd2core.batch.plan import BatchPlan
from sd2core.batch.plan_file import plan_text
from sd2core.batch.pool import Pool, opened_pool
from sd2core.batch.task_graph import TaskGraph
from sd2core.batch.tasks import BEGUN, Task
from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_write, atomic_write_json, atomic_write_text
from sd2core.files.paths import remove
from sd2core.files.tables import counted
from sd2core.runs.control import Control, signals_kept, write_control
from sd2core.runs.pace import keep_pace
from sd2core.runs.progress import Event, ProgressWriter
from sd2core.version import __version__

Outcome = Literal["finished", "stopped"]
Watch = Callable[[Event], None]

_LINE_EVERY_S = 0.5
_KINDS = ("inputs", "meshes", "plans", "synthetic", "denoised", "simulated")
_OLD_S = 3600.0
"""A write takes seconds. Older temporary files are abandoned, also where a worker of an earlier run
may still be at its last task on another machine."""


@dataclass(frozen=True)
class BatchEnd:
    """End of a run."""

    outcome: Outcome
    failed: int  # tasks that cannot be done
    facts: dict[str, Any]  # content of the line "end"


def run_batch(
    plan: BatchPlan,
    *,
    source: Path | None = None,
    scheduler: str | None = None,
    processes: int = 1,
    watch: Watch | None = None,
    pool: AbstractContextManager[Pool] | None = None,
) -> BatchEnd:
    """Make all results of a plan that do not exist yet.

    Parameters
    ----------
    plan : BatchPlan
        Its paths are absolute.
    source : Path, optional
        File of the plan, for the progress.
    scheduler : str, optional
        Address of a dask-scheduler that runs the tasks.
    processes : int
        Number of processes to start here without a scheduler.
    watch : callable, optional
        Called with every line of the progress.
    pool : context manager of Pool, optional
        Runs the tasks in place of scheduler and processes.

    Raises
    ------
    Sd2Error
        If the batch cannot begin, or cannot go on at all.
    """
    folder = BatchFolder(Path(plan.out))
    origins = find_origins(plan.recordings, folder.path)
    graph = TaskGraph(plan, folder, origins)
    folder.prepare()
    lock = folder.lock()
    try:
        with signals_kept():
            write_control(folder.control, "run")
            control = Control(folder.control)
            control.take_signals()
            folder.set_state("running", started_unix_s=time.time())
            atomic_write_text(folder.plan, plan_text(plan, folder.path))
            # Leftovers of killed processes.
            begun = folder.path / BEGUN
            shutil.rmtree(begun, ignore_errors=True)
            begun.mkdir()
            remove_old_leftovers(folder.path)
            pool = pool or opened_pool(folder, processes, scheduler)
            with ProgressWriter(folder.progress, watch) as lines:
                return _Run(graph, lines, control, scheduler, pool).through(source)
    except BaseException:
        folder.set_state("failed")
        raise
    finally:
        shutil.rmtree(folder.path / BEGUN, ignore_errors=True)
        lock.release()


class _Run:
    """Progress and report of a running batch."""

    def __init__(
        self,
        graph: TaskGraph,
        lines: ProgressWriter,
        control: Control,
        scheduler: str | None,
        pool: AbstractContextManager[Pool],
    ) -> None:
        self._graph, self._lines, self._control = graph, lines, control
        self._scheduler = scheduler
        self._folder = graph.folder
        self._begun_s = time.monotonic()
        self._reported_s = float("-inf")
        self._workers = -1
        self._failures: list[dict[str, Any]] = []
        self._opened = ExitStack()
        self._driver = Driver(
            graph,
            lambda: self._opened.enter_context(pool),
            on_failure=self._failed,
            on_note=self._note,
            tick=self._tick,
        )

    def through(self, source: Path | None) -> BatchEnd:
        """Run all tasks and report the end."""
        self._start(source)
        self._folder.report.unlink(missing_ok=True)
        try:
            with self._opened:
                outcome = self._drive()
        except Sd2Error as error:
            self._end("failed", error)
            raise
        except Exception as error:
            self._end(
                "failed", Sd2Error(f"This should not happen ({type(error).__name__}: {error})")
            )
            raise
        facts = self._end(outcome, None)
        return BatchEnd(outcome, facts["failed"], facts)

    def _drive(self) -> Outcome:
        try:
            self._driver.run(self._graph.first())
            self._write_results()
            self._driver.run(self._graph.last())
        except Stopped:
            return "stopped"
        return "finished"

    def _start(self, source: Path | None) -> None:
        self._lines.say(
            "start",
            format=PROGRESS_FORMAT,
            version=PROGRESS_VERSION,
            out=str(self._folder.path),
            plan=None if source is None else str(source),
            recordings=len(self._graph.origins),
            placements=self._graph.plan.placement_count,
            steps=list(self._graph.steps),
            scheduler=self._scheduler,
            unix_s=time.time(),
        )

    def _tick(self) -> None:
        if self._control.word() == "stop":
            raise Stopped
        workers = self._driver.workers
        if workers != self._workers:
            self._workers = workers
            self._lines.say("workers", workers=workers)
        now_s = time.monotonic()
        if now_s - self._reported_s >= _LINE_EVERY_S:
            self._reported_s = now_s
            last = self._driver.last
            self._lines.say(
                "progress",
                **self._counts(),
                running=len(self._driver.running),
                workers=workers,
                left_s=self._driver.left_s(),
                last=None if last is None else event_of(last, self._folder.path),
            )

    def _counts(self) -> dict[str, Any]:
        counts, steps = self._driver.counts, self._graph.steps
        return {
            "total": {step: self._graph.total[step] for step in steps},
            "there": {step: counts.made_before[step] for step in steps},
            "done": {step: counts.done[step] for step in steps},
            "failed": counts.failed.total(),
            "waiting": counts.waiting.total(),
            "elapsed_s": time.monotonic() - self._begun_s,
        }

    def _note(self, text: str) -> None:
        self._lines.say("note", text=text)
        self._log(text)

    def _failed(self, task: Task, error: dict[str, Any], worker_died: bool) -> None:
        about = event_of(task, self._folder.path)
        del about["out"]
        about |= {"error": error, "worker_died": worker_died}
        self._lines.say("failed", **about)
        self._log(f"{about['recording']}: {about['step']}: {Sd2Error(**error)}")
        self._failures.append(about)

    def _log(self, text: str) -> None:
        with self._folder.log.open("a", encoding="utf-8") as stream:
            stream.write(f"{time.strftime('%Y-%m-%d %H:%M:%S')} {text}\n")

    def _write_results(self) -> None:
        """Write a line for every map, by recording, in the order of the plan."""
        root, damaged = self._folder.path, dict[str, int]()
        with atomic_write(self._folder.results) as stream:
            for origin, about, mesh, planned in self._graph.all_maps():
                damaged[origin.name] = mesh.damaged
                of_all, simulation = planned.synthesis.out, planned.simulation
                for share in planned.shares:
                    who, denoising = share.who, share.denoising
                    row = {
                        "source": origin.path,
                        "mesh": mesh.path,
                        "recording": origin.name,
                        "subject": who.subject or origin.subject,
                        **({"person": who.person} if who.person else {}),
                        "placement": planned.placement,
                        "sensor": planned.sensor.as_dict(),
                        "target_m": (mesh.target_m, *mesh.others_m)[who.body or 0],
                        "about": about,
                        "start": 0,
                        "stop": mesh.frames,
                        "synthetic": _if_there(share.synthetic, root),
                        "denoised": _if_there(denoising.out if denoising else None, root),
                        "simulated": _if_there(simulation.out if simulation else None, root),
                        # Of somebody who is not in the scene: a map with the axis and the times.
                        **({} if share.synthetic else {"clock": _if_there(of_all, root)}),
                    }
                    if Path(of_all).exists():
                        stream.write((json.dumps(row, ensure_ascii=False) + "\n").encode())
        for name, frames in damaged.items():
            if frames:
                self._note(f"{name}: lost {counted(frames, 'frame')} of its mesh, which is damaged")

    def _end(self, outcome: str, error: Sd2Error | None) -> dict[str, Any]:
        if error is not None:
            self._log(str(error))
        export = self._graph.plan.export
        dataset = None if export is None else dataset_path(self._folder, export)
        facts = {
            "outcome": outcome,
            **self._counts(),
            "report": str(self._folder.report),
            "dataset": str(dataset) if dataset is not None and dataset.exists() else None,
            "error": None if error is None else error.arguments,
        }
        # The pace of other machines is of no use here.
        if self._scheduler is None:
            graph, counts = self._graph, self._driver.counts
            for step in graph.steps:
                keep_pace(pace_kind(graph.plan, step), counts.seconds[step], counts.work[step])
        self._write_report(facts)
        self._folder.set_state(outcome)  # type: ignore[arg-type]
        self._lines.say("end", **facts)
        return facts

    def _write_report(self, facts: dict[str, Any]) -> None:
        content = {
            "format": "sd2-batch-report",
            "version": 1,
            "made_by": f"SD² Studio {__version__}",
            **facts,
            "failures": self._failures,
        }
        atomic_write_json(self._folder.report, content)


def _if_there(out: str | Path | None, root: Path) -> str | None:
    """Path of a file below the root; None where none is made, or it is missing."""
    path = None if out is None else Path(out)
    return path.relative_to(root).as_posix() if path is not None and path.exists() else None


def remove_old_leftovers(folder: Path) -> None:
    """Delete temporary files and folders of a batch that are no longer written to."""
    before_s = time.time() - _OLD_S
    for kind in _KINDS:
        for path in (folder / kind).glob("*/.*.tmp"):
            with suppress(OSError):  # of another user, or gone meanwhile
                if path.lstat().st_mtime <= before_s:
                    remove(path)
