"""``sd2 study``: whether synthetic data help a classifier on a real radar."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from sd2core.cli.command_parser import command
from sd2core.cli.output import print_event, print_json, progress_bar, tell_lost
from sd2core.options.kinds import Count
from sd2core.options.records import ARGUMENT, Place
from sd2core.options.shared import JsonAndProgress

if TYPE_CHECKING:
    from sd2core.progress import Progress
    from sd2core.study.plan import StudyPlan


class Running(JsonAndProgress):
    """Folder of a study, and the form of its output.

    Parameters
    ----------
    workers : N
        processes on this machine (default: one per core)
    scheduler : ADDRESS
        use the workers of this dask-scheduler
    """

    workers: Annotated[Count | None, Place(one_of="where")] = None
    scheduler: Annotated[str | None, Place(one_of="where")] = None


class Study(Running):
    """Options of ``sd2 study``.

    Parameters
    ----------
    plan : STUDY.toml
        plan of the study
    """

    plan: Annotated[Path, ARGUMENT]


@command("study", Study)
def _study(options: Study) -> None:
    """Find out whether synthetic data help a classifier on a real radar.

    Every ordered pair of people makes a fold: one is judged, of another there is only
    video, and of all others a share of the radar's data is there. A classifier learns
    from these alone, and with the filmed person's maps added: synthetic, denoised by a
    denoiser that learnt from the same real data, each also with the radar's texture, and,
    as a yardstick, what the radar saw of them. Movements of one person may be kept
    apart instead, and simulated movements of other bodies be added.

    The folder `out` of the plan gets study.md with tables, intervals over takes and people, a
    paired test and a conclusion, study.json with every score, curve.png and confusion.png.
    Every training is kept: the same command goes on where it was stopped.

      sd2 study mars.toml
    """
    from sd2core.study.plan import read_study

    make_study(read_study(options.plan), options)


def make_study(plan: StudyPlan, options: Running) -> None:
    """Run a study, write its page, and print what it found."""
    from sd2core.study.report import findings_of, write_report
    from sd2core.study.run import run_study

    workers = options.workers or os.cpu_count() or 1
    with _events() if options.progress_json else progress_bar("Studying", "run") as progress:
        results = run_study(plan, processes=workers, scheduler=options.scheduler, progress=progress)
    tell_lost(results.lost_frames)
    summary = write_report(results, Path(plan.out))
    if options.progress_json:
        print_event("written", folder=plan.out)
    elif options.json:
        print_json({"out": plan.out, "conclusion": summary, "findings": len(findings_of(results))})
    else:
        print(f"{summary}\n\nWrote {Path(plan.out) / 'study.md'}")


@contextmanager
def _events() -> Iterator[Progress]:
    """Print a JSON line for every denoiser and run that is done."""
    begun_s = time.monotonic()

    def report(done: int, total: int) -> None:
        print_event("run", done=done, total=total, elapsed_s=time.monotonic() - begun_s)

    yield report
