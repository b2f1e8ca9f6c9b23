"""``python -m tools.motion_capture``: bodies in the motion of real people."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from sd2core.cli.command_parser import add_command
from sd2core.cli.output import progress_bar
from tools.command_line import positive_int, run_tool
from tools.motion_capture.bodies import drive_bodies
from tools.motion_capture.refining import measure_refining


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one of the commands; return the exit code."""
    about = "Bodies in the motion of real people."
    return run_tool("motion_capture", about, _add_commands, arguments)


def _add_commands(kinds: argparse._SubParsersAction) -> None:
    drive = add_command(
        kinds,
        "drive",
        "drive a body by every recording of a folder",
        handler=_drive,
        description=(
            "All recordings of one person drive one body of that person's measures. Stopped and\n"
            "started again it goes on where it was."
        ),
        examples="  python -m tools.motion_capture drive ../shared/data/motion motions",
    )
    drive.add_argument("source", type=Path, metavar="SOURCE", help="folder of motion capture")
    drive.add_argument("out", type=Path, metavar="OUT", help="folder of the bodies' motions")
    drive.add_argument(
        "--processes", type=positive_int, default=2, metavar="P", help="(default: 2)"
    )
    measure = add_command(
        kinds,
        "refining",
        "measure `sd2 refine` on recorded motion with jitter",
        handler=_refining,
        examples="  python -m tools.motion_capture refining motions",
    )
    measure.add_argument("motions", type=Path, metavar="MOTIONS", help="what `drive` made")


def _drive(options: argparse.Namespace) -> None:
    with progress_bar("Driving bodies", unit="recording") as progress:
        notes = drive_bodies(options.source, options.out, options.processes, progress)
    print("\n".join([*notes, f"Wrote {options.out}"]))


def _refining(options: argparse.Namespace) -> None:
    with progress_bar("Smoothing", unit="recording") as progress:
        errors = measure_refining(options.motions, progress)
    for trial, (before, after) in errors.items():
        print(f"{trial:12} {before:.3f} -> {after:.3f} m/s ({after / before:.2f})")
    before, after = np.array(list(errors.values())).T
    print(
        f"{len(errors)} recordings: {before.mean():.2f} -> {after.mean():.3f} m/s, ratio"
        f" {np.mean(after / before):.2f} (mean), {np.max(after / before):.2f} (greatest),"
        f" below half in {np.sum(after < 0.5 * before)}"
    )


if __name__ == "__main__":
    sys.exit(main())
