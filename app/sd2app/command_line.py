"""The ``sd2`` script: the library's commands, and those that open the window."""

from __future__ import annotations

import argparse
import os
import signal
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from sd2app.plain_imports import plain_imports
from sd2app.system_libraries import explain_missing, missing_libraries
from sd2core.cli import build_parser, run
from sd2core.cli.command_parser import add_command
from sd2core.cli.options import (
    add_json,
)
from sd2core.errors import Sd2Error

_EXAMPLES = """\
  sd2 demo                                    look at the bundled sample recording
  sd2 open walk.sd2                           look at a recording, a video or a mesh
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one ``sd2`` command and return its exit code."""
    typed = sys.argv[1:] if arguments is None else arguments
    return run(full_parser(typed), typed)


def full_parser(typed: Sequence[str] = ()) -> argparse.ArgumentParser:
    """The library's commands, or the one that is typed, and those that open the window."""
    parser, commands = build_parser(_EXAMPLES, typed)
    _add_window_commands(commands)
    return parser


def _add_window_commands(commands: argparse._SubParsersAction) -> None:
    opening = add_command(
        commands,
        "open",
        "open a recording, or a video, a mesh or a radar capture, in the window",
        handler=_open,
        examples=(
            "  sd2 open walk.sd2\n"
            "  sd2 open walk.mkv walk.npz capture/    (what belongs together)\n"
            "  sd2 open walk.sd2 --screenshot window.png    (needs no display)"
        ),
    )
    opening.add_argument(
        "paths",
        nargs="*",
        type=Path,
        metavar="PATH",
        help="a recording; or a video, a mesh and a radar capture, each or together"
        " (default: an empty window)",
    )
    demo = add_command(
        commands,
        "demo",
        "open the bundled sample recording in the window",
        handler=_demo,
        description=(
            "A simulated body makes eight swipes in front of a simulated radar. The bundled files\n"
            "stay as they are; --out writes a copy to edit, export or train with."
        ),
        examples=(
            "  sd2 demo\n"
            "  sd2 demo --out sample.sd2            (a copy; opens no window)\n"
            "  sd2 demo --screenshot window.png    (needs no display)"
        ),
    )
    instead = demo.add_mutually_exclusive_group()
    instead.add_argument(
        "--out",
        type=Path,
        metavar="NAME.sd2",
        help="write a copy of the sample with its files, and open no window",
    )
    for parser in (opening, instead):
        parser.add_argument(
            "--screenshot",
            type=Path,
            metavar="FILE.png",
            help="draw the window into a picture instead of on the screen",
        )
    for parser in (opening, demo):
        parser.add_overwrite()

    examining = add_command(
        commands,
        "doctor",
        "check the installation, and say how to mend it",
        handler=_doctor,
        description=(
            "Looks at system libraries, display, OpenGL, fonts, compiled kernels, models, GPU and\n"
            "room on the disk. The exit code is 1 where something must be mended.\n\n"
            "--clean lists what the program keeps outside of recordings and can make again, such\n"
            "as compiled kernels and landmark models, and removes it. Settings, trained models,\n"
            "runs, and edits that were not saved stay."
        ),
        examples="  sd2 doctor\n  sd2 doctor --clean    (before pip uninstall sd2-studio)",
    )
    instead = examining.add_mutually_exclusive_group()
    add_json(instead)
    instead.add_argument("--clean", action="store_true", help="remove caches, after asking")
    examining.add_argument("--yes", action="store_true", help="with --clean, do not ask")


def _doctor(options: argparse.Namespace) -> int:
    if options.clean:
        from sd2core.cli.caches import remove_caches

        remove_caches(ask=not options.yes)
        return 0
    if options.yes:
        raise Sd2Error("--yes is given without --clean", remedy="Add --clean, or leave it out")
    from sd2app.doctor import report

    return report(options.json)


def _open(options: argparse.Namespace) -> int:
    from sd2app.fit.request import read_request
    from sd2core.io.kinds import kind_of
    from sd2core.io.radar import without_companions

    # Says what is wrong before the window is there. A folder in which a fit was stopped
    # is no recording yet, and can be opened.
    for path in without_companions(options.paths):
        if read_request(path) is None:
            kind_of(path)
    return _show(options.paths, options.screenshot)


def _demo(options: argparse.Namespace) -> int:
    from sd2core.cli.importing import copy_sample
    from sd2core.files.resources import resource_path

    if options.out is None:
        return _show([resource_path("swipes.sd2")], options.screenshot)
    copy_sample(options.out)
    return 0


def _show(paths: Sequence[Path], screenshot: Path | None) -> int:
    if screenshot is not None:
        if screenshot.suffix.lower() != ".png":
            raise Sd2Error(f"The screenshot is to be {screenshot}", "a name that ends in .png")
        os.environ["QT_QPA_PLATFORM"] = "offscreen"
    elif not has_display(sys.platform, os.environ):
        raise Sd2Error(
            "There is no display to open a window on",
            remedy="Draw the same window into a picture with --screenshot FILE.png",
        )
    if missing := missing_libraries():
        raise explain_missing(missing)
    with plain_imports():
        from sd2app.shell.app import run as run_window

    # Qt's event loop gives Python no turn to raise KeyboardInterrupt.
    previous = signal.signal(signal.SIGINT, signal.SIG_DFL)
    try:
        return run_window(paths, screenshot=screenshot, parser=full_parser)
    finally:
        signal.signal(signal.SIGINT, previous)


def has_display(platform: str, environment: Mapping[str, str]) -> bool:
    """True if Qt finds a screen, or its platform is set explicitly."""
    if not platform.startswith("linux"):
        return True
    names = ("DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM")
    return any(environment.get(name) for name in names)


if __name__ == "__main__":
    sys.exit(main())
