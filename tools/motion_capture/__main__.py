"""``python -m tools.motion_capture``: bodies in the motion of real people."""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from sd2core.cli.command_parser import add_command
from sd2core.cli.output import progress_bar
from tools.command_line import (
    positive_int,
    run_tool,
)
from tools.motion_capture.bodies import drive_bodies, load_motions, minutes


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
    listing = add_command(
        kinds,
        "list",
        "say who moves for how long, and what it is used for",
        handler=_list,
        examples="  python -m tools.motion_capture list motions",
    )
    listing.add_argument("folder", type=Path, metavar="FOLDER", help="as `drive` made it")


def _drive(options: argparse.Namespace) -> None:
    with progress_bar("Driving bodies", unit="recording") as progress:
        notes = drive_bodies(options.source, options.out, options.processes, progress)
    print("\n".join([*notes, f"Wrote {options.out}"]))


def _list(options: argparse.Namespace) -> None:
    for role in ("learn", "calibrate", "measure"):
        motions = load_motions(options.folder, role)
        people = Counter(motion.person for motion in motions)
        print(f"{role}: {minutes(motions):.1f} minutes of {len(people)} people")
        for person, count in sorted(people.items()):
            own = [motion for motion in motions if motion.person == person]
            residual_cm = 100.0 * sum(one.residual_m * len(one) for one in own) / sum(map(len, own))
            print(f"  {person}: {count} recordings, {minutes(own):.1f} min, {residual_cm:.1f} cm")


if __name__ == "__main__":
    sys.exit(main())
