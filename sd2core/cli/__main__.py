"""``python -m sd2core.cli``, and ``sd2`` where the library is installed without the window."""

from __future__ import annotations

import argparse
import gc
import sys
from pathlib import Path
from typing import NoReturn

from sd2core.cli import build_parser, run
from sd2core.cli.command_parser import add_command, add_options
from sd2core.cli.preparing import JOBS, Doctor, do_job
from sd2core.errors import Sd2Error
from sd2core.options.kinds import DemoScene
from sd2core.options.records import OptionRecord
from sd2core.options.shared import Json

_EXAMPLES = "  sd2 demo --out sample.sd2                   a copy of the bundled sample recording\n"


class Demo(OptionRecord):
    """Options of ``sd2 demo``.

    Parameters
    ----------
    out : NAME.sd2
        the copy to write; new
    scene : NUMBER
        of people: one who swipes, or two who walk past each other
    """

    out: Path | None = None
    scene: DemoScene = "one"


def main() -> int:
    """Run one of the library's commands and return its exit code."""
    parser, commands = build_parser(_EXAMPLES, sys.argv[1:])
    demo = add_command(commands, "demo", options=Demo, handler=_demo)
    demo.add_argument("--screenshot", type=Path, help=argparse.SUPPRESS)
    add_command(commands, "doctor", options=Doctor, handler=_doctor, description=JOBS)
    absent = commands.add_parser("open")  # not listed
    absent.set_defaults(handler=_absent, name="open")
    add_options(absent, Json)
    words = sys.argv[1:]
    if words[:1] == ["open"]:
        # Whatever else is asked of a command that is not there.
        words = ["open", *{"--json"}.intersection(words)]
    gc.freeze()  # what is there by now stays: looking through it takes a tenth of a help
    return run(parser, words)


def _demo(options: Demo) -> None:
    """Write a copy of the bundled sample recording.

    A simulated body makes eight swipes in front of a simulated radar; or two people walk past
    each other behind a table.
    """
    if options.out is None:
        _absent(argparse.Namespace(name="demo"))
    from sd2core.cli.importing import copy_sample

    copy_sample(options.out, options.scene)


def _doctor(options: Doctor) -> None:
    """Prepare the installation, or clean up after it.

    sd2 doctor --warm-up
    sd2 doctor --fetch-models
    sd2 doctor --fetch-models --from mediapipe-0.10.21-….whl
    sd2 doctor --clean    (before pip uninstall sd2-core)
    """
    if not do_job(options):
        _absent(argparse.Namespace(name="doctor"))


def _absent(options: argparse.Namespace) -> NoReturn:
    raise Sd2Error(
        f"`sd2 {options.name}` needs the window, which is not in the library alone (sd2-core)",
        remedy="Type `pip uninstall sd2-core`, then `pip install sd2_studio-….whl`",
    )


if __name__ == "__main__":
    sys.exit(main())
