"""``python -m tools.build_sample make OUT``: the bundled sample recording."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from sd2core.cli.command_parser import add_command
from sd2core.cli.output import progress_bar
from tools.build_sample.sample import make_sample
from tools.command_line import run_tool


def main(arguments: Sequence[str] | None = None) -> int:
    """Make the sample; return the exit code."""
    return run_tool("build_sample", "The bundled sample recording.", _add_commands, arguments)


def _add_commands(commands: argparse._SubParsersAction) -> None:
    sample = add_command(
        commands,
        "make",
        "make the bundled sample recording",
        handler=_make,
        description=(
            "A body makes two swipes to the right, left, down and up, 2.2 m in front of the\n"
            "camera and a 60 GHz radar: a rendered video, what `sd2 fit` makes of it, the true\n"
            "mesh, and the raw samples of the radar with noise and static clutter. Takes some\n"
            "minutes, and the landmark models."
        ),
        examples="  python -m tools.build_sample make resources/swipes.sd2",
    )
    sample.add_argument("out", type=Path, metavar="OUT", help="the recording to make (NAME.sd2)")


def _make(options: argparse.Namespace) -> None:
    with progress_bar("Simulating", unit="frame") as progress:
        made = make_sample(options.out, progress)
    print(f"Made {made}")


if __name__ == "__main__":
    sys.exit(main())
