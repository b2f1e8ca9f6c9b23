"""``sd2 study``: whether synthetic data help a classifier on a real radar."""

from __future__ import annotations

import argparse
import os
from pathlib import Path

from sd2core.cli.command_parser import add_command
from sd2core.cli.options import positive_int
from sd2core.cli.output import print_json, progress_bar


def add_commands(commands: argparse._SubParsersAction) -> None:
    """Add ``study``."""
    parser = add_command(commands, "study", handler=_study)
    parser.add_value("plan", Path, "STUDY.toml", "plan of the study")
    where = parser.add_mutually_exclusive_group()
    text = "processes on this machine (default: one per core)"
    where.add_value("--workers", positive_int, "N", text)
    where.add_value("--scheduler", str, "ADDRESS", "use the workers of this dask-scheduler")
    parser.add_json()


def _study(options: argparse.Namespace) -> None:
    """Find out whether synthetic data help a classifier on a real radar.

    Of a real radar's pairs every ordered pair of people makes a fold: one is judged, of
    another there is only video, and of all others a share of the radar's data is there. A
    classifier learns from these alone, and with the filmed person's maps added:
    synthetic, denoised by a denoiser that learnt from the same real data, each
    also with the radar's texture, and, as a yardstick, what the radar saw of them.

    The folder `out` of the plan gets study.md with tables, intervals over takes and people, a
    paired test and a conclusion, study.json with every score, and curve.png. Every
    training is kept: the same command goes on where it was stopped.

      sd2 study mars.toml
    """
    from sd2core.study.plan import read_study
    from sd2core.study.report import findings_of, write_report
    from sd2core.study.run import run_study

    plan = read_study(options.plan)
    workers = options.workers or os.cpu_count() or 1
    with progress_bar("Studying", "run") as progress:
        results = run_study(plan, processes=workers, scheduler=options.scheduler, progress=progress)
    said = write_report(results, Path(plan.out))
    if options.json:
        print_json({"out": plan.out, "conclusion": said, "findings": len(findings_of(results))})
        return
    print(said)
    print(f"\nWrote {Path(plan.out) / 'study.md'}")
