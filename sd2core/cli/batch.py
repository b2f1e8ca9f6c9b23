"""``sd2 batch``: fit, synthesise, denoise and export many recordings from many places."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from sd2core.cli.command_parser import command
from sd2core.cli.output import (
    Report,
    counted,
    duration,
    print_event,
    print_facts,
    print_json,
    print_rows,
    progress_bar,
)
from sd2core.errors import Sd2Error
from sd2core.files.tables import bytes_text
from sd2core.options.kinds import Count
from sd2core.options.records import ARGUMENT, OptionError, Place
from sd2core.options.shared import JsonAndProgress

if TYPE_CHECKING:
    from sd2core.batch.estimate import BatchEstimate
    from sd2core.batch.folder import BatchStatus
    from sd2core.batch.plan import BatchPlan
    from sd2core.batch.run import BatchEnd, Watch

_LISTED_FAILURES = 10
_LISTED_UNUSABLE = 5


class Batch(JsonAndProgress):
    """Options of ``sd2 batch``.

    Parameters
    ----------
    plan : PLAN.toml
        plan of the batch
    workers : N
        processes on this machine (default: one per core)
    scheduler : ADDRESS
        use the workers of this dask-scheduler
    dry_run
        print tasks, time and bytes, and do nothing
    status : FOLDER
        print the state of the batch in this folder
    stop : FOLDER
        stop the batch in this folder; the same command resumes it
    """

    plan: Annotated[Path | None, ARGUMENT] = None
    workers: Annotated[Count | None, Place(one_of="where")] = None
    scheduler: Annotated[str | None, Place(one_of="where")] = None
    dry_run: Annotated[bool, Place(one_of="what")] = False
    status: Annotated[Path | None, Place(one_of="what")] = None
    stop: Annotated[Path | None, Place(one_of="what")] = None

    def __post_init__(self) -> None:
        super().__post_init__()
        elsewhere = self.status is not None or self.stop is not None
        if self.plan is not None and elsewhere:
            raise OptionError("A plan is given with --status or --stop", "only one of them")
        if self.plan is None and not elsewhere:
            raise OptionError("No plan is given", "PLAN.toml, or --status FOLDER")


@command("batch", Batch)
def _batch(options: Batch) -> int | Report:
    """Fit, synthesise, denoise and export many recordings from many places.

    Runs a plan (TOML, see docs/formats.md) on all cores of this machine, or on the
    workers of a dask-scheduler, which must see the same files under the same paths.
    Every result is kept under the hash of all that it depends on: the same command
    again makes only missing results, after a change those that depend on it, and after
    Ctrl-C or a crash the rest. A recording that cannot be used is reported
    at the end and does not stop the others; the exit code is then 1.

      sd2 batch plan.toml --dry-run       (how many tasks, what time and bytes)
      sd2 batch plan.toml
      sd2 batch plan.toml --scheduler tcp://10.0.0.5:8786
      sd2 batch --status made
    """
    from sd2core.batch.folder import BatchFolder

    if options.status is not None:
        return _status(options.status)
    if options.stop is not None:
        BatchFolder(options.stop).tell("stop")
        return Report(f"Stopping {options.stop}", {"out": str(options.stop), "told": "stop"})
    assert options.plan is not None
    from sd2core.batch.plan_file import read_plan

    plan = read_plan(options.plan)
    if options.dry_run:
        return _dry_run(plan, options)
    return _run(plan, options)


def _run(plan: BatchPlan, options: Batch) -> int:
    from sd2core.batch.run import run_batch
    from sd2core.numerics.compiled import worker_count

    with _watching(options) as watch:
        end = run_batch(
            plan,
            source=options.plan,
            scheduler=options.scheduler,
            processes=options.workers or worker_count(),
            watch=watch,
        )
    if options.json:
        print_json({"out": plan.out, **end.facts})
    elif not options.progress_json:
        _print_end(plan, end)
    if end.outcome == "stopped":
        from sd2core.processes import INTERRUPTED

        return INTERRUPTED
    return 1 if end.failed else 0


@contextmanager
def _watching(options: Batch) -> Iterator[Watch]:
    """Show progress as JSON on standard output, or for people on standard error."""
    if options.progress_json:
        yield lambda event: print_event(**event)
        return
    from sd2core.cli.bars import bar as bar_of

    with bar_of("Batch", "task") as bar:

        def watch(event: dict[str, Any]) -> None:
            if event["event"] == "progress":
                settled = sum(event["there"].values()) + sum(event["done"].values())
                bar.total = sum(event["total"].values())
                bar.update(settled + event["failed"] + event["waiting"] - bar.n)
                left_s = event["left_s"]
                bar.set_postfix_str(
                    f"{counted(event['workers'], 'worker')}"
                    + (f", {duration(left_s)} left" if left_s is not None else "")
                    + (f", {event['failed']} failed" if event["failed"] else "")
                )
            elif event["event"] == "workers" and not event["workers"]:
                bar.set_postfix_str("waiting for workers")
            elif event["event"] == "failed":
                bar.write(_failure_text(event), file=sys.stderr)
            elif event["event"] == "note":
                bar.write(f"  {event['text']}", file=sys.stderr)

        yield watch


def _failure_text(event: dict[str, Any]) -> str:
    place = f" from place {event['placement']}" if event["placement"] else ""
    return f"  {event['recording']}: {event['step']}{place}: {Sd2Error(**event['error'])}"


def _print_end(plan: BatchPlan, end: BatchEnd) -> None:
    facts = end.facts
    stopped = "" if end.outcome == "finished" else "; the same command resumes it"
    print_facts(
        f"{plan.out}: {end.outcome} after {duration(facts['elapsed_s'])}{stopped}",
        _count_facts(facts) | {"data set": facts["dataset"] or ""},
    )
    if not end.failed:
        return
    from sd2core.files.texts import read_json

    print(f"  {counted(end.failed, 'task')} cannot be done:")
    report = read_json(Path(facts["report"]))
    for failure in report["failures"][:_LISTED_FAILURES]:
        print("  " + _failure_text(failure))
    if end.failed > _LISTED_FAILURES:
        print(f"    and {end.failed - _LISTED_FAILURES:,} more, in {facts['report']}")


def _count_facts(facts: dict[str, Any]) -> dict[str, str]:
    words = {
        step: f"{facts['done'][step]:,} done, {facts['there'][step]:,} there already, of {total:,}"
        for step, total in facts["total"].items()
        if total
    }
    return words | {
        "failed": f"{facts['failed']:,}" if facts["failed"] else "",
        "waiting": f"{facts['waiting']:,}, for what failed" if facts["waiting"] else "",
    }


def _status(path: Path) -> Report:
    from dataclasses import asdict

    from sd2core.batch.folder import BatchFolder

    status = BatchFolder(path).status()
    data = asdict(status)
    facts = _count_facts(data) | _times(status)
    return Report(f"{path}: {status.state}", {"out": str(path), **data}, facts)


def _times(status: BatchStatus) -> dict[str, str]:
    elapsed = "" if status.elapsed_s is None else duration(status.elapsed_s)
    left = "" if status.left_s is None else f", {duration(status.left_s)} left"
    return {
        "workers": str(status.workers) if status.state == "running" else "",
        "time": elapsed + left,
        "error": status.error or "",
    }


def _dry_run(plan: BatchPlan, options: Batch) -> Report:
    from sd2core.batch.estimate import estimate
    from sd2core.numerics.compiled import worker_count

    workers = options.workers or worker_count()
    with progress_bar("Looking", "recording") as progress:
        made = estimate(plan, workers, progress)
    return Report("", made.to_json(), say=partial(print_estimate, made, plan))


def print_estimate(made: BatchEstimate, plan: BatchPlan) -> None:
    """Print tasks, time and bytes of a batch."""
    print(
        f"{plan.out}: {counted(made.recordings, 'recording')},"
        f" {counted(plan.placement_count, 'placement')} each"
    )
    size = f"At most {bytes_text(made.bytes)}."
    rows = [("step", "to do", "there", "one process", "written")]
    for step, one in made.steps.items():
        time = "not known" if one.seconds is None else duration(one.seconds)
        rows.append((step, f"{one.to_do:,}", f"{one.there:,}", time, bytes_text(one.bytes)))
    print_rows(rows, right=(1, 2, 3, 4))
    workers = "1 process" if made.workers == 1 else f"{made.workers} processes"
    if made.seconds is None:
        print(f"Time: this machine has not done all of it before; the first tasks tell. {size}")
    else:
        print(f"Estimated: {duration(made.seconds)} on {workers}, as such tasks took here. {size}")
    if made.looked_at < made.recordings:
        print(f"Estimated from {made.looked_at:,} recordings; the others are assumed to be alike.")
    if made.unusable:
        print(f"{counted(len(made.unusable), 'recording')} of the inspected ones cannot be used:")
        for words in made.unusable[:_LISTED_UNUSABLE]:
            print(f"  {words}")
