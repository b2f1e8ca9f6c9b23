"""``python -m tools.motion_capture``: bodies in the motion of real people."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import numpy as np

from sd2core.cli.output import progress_bar
from sd2core.options.kinds import Count
from sd2core.options.records import ARGUMENT, OptionRecord
from tools.command_line import tool
from tools.motion_capture.bodies import drive_bodies
from tools.motion_capture.refining import measure_refining


class Drive(OptionRecord):
    """Options of ``drive``.

    Parameters
    ----------
    source : SOURCE
        folder of motion capture
    out : OUT
        folder of the bodies' motions
    processes : P
        at work at once
    """

    source: Annotated[Path, ARGUMENT]
    out: Annotated[Path, ARGUMENT]
    processes: Count = 2


class Refining(OptionRecord):
    """Options of ``refining``.

    Parameters
    ----------
    motions : MOTIONS
        what `drive` made
    """

    motions: Annotated[Path, ARGUMENT]


def _drive(options: Drive) -> None:
    """Drive a body by every recording of a folder.

    All recordings of one person drive one body of that person's measures. Stopped and
    started again it goes on where it was.
    """
    with progress_bar("Driving bodies", unit="recording") as progress:
        notes = drive_bodies(options.source, options.out, options.processes, progress)
    print("\n".join([*notes, f"Wrote {options.out}"]))


def _refining(options: Refining) -> None:
    """Measure `sd2 refine` on recorded motion with jitter."""
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


main = tool("motion_capture", _drive, _refining)


if __name__ == "__main__":
    sys.exit(main())
