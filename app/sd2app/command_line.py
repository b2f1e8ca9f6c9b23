"""The ``sd2`` script: the library's commands, and those that open the window."""

from __future__ import annotations

import argparse
import gc
import os
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING

from sd2core.cli import build_parser, run
from sd2core.cli.command_names import COMMANDS
from sd2core.cli.command_parser import Subcommands, add_command, in_a_list
from sd2core.errors import Sd2Error

if TYPE_CHECKING:
    from pathlib import Path

    from sd2app.window_options import Demo, Open
    from sd2core.cli.preparing import Doctor

_EXAMPLES = """\
  sd2 demo                                    look at the bundled sample recording
  sd2 open walk.sd2                           look at a recording, a video or a mesh
"""
_WITHOUT_DISPLAY = "Draw the same window into a picture with --screenshot FILE.png"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one ``sd2`` command and return its exit code."""
    typed = sys.argv[1:] if arguments is None else arguments
    parser = full_parser(typed)
    if arguments is None:  # a process of its own
        gc.freeze()  # what is there by now stays: looking through it takes a tenth of a help
    return run(parser, typed)


def full_parser(typed: Sequence[str] = ()) -> argparse.ArgumentParser:
    """The library's commands, or the one that is typed, and those that open the window."""
    parser, commands = build_parser(_EXAMPLES, typed)
    if typed[:1] in (["-h"], ["--help"]):
        for name, handler in (("open", _open), ("demo", _demo), ("doctor", _doctor)):
            summary = str(handler.__doc__).partition("\n")[0]
            commands.add_parser(name, help=in_a_list(summary), add_help=False)
    elif not typed or typed[0] not in COMMANDS:
        _add_window_commands(commands)
    return parser


def _add_window_commands(commands: Subcommands) -> None:
    from sd2app.window_options import Demo, Open
    from sd2core.cli.preparing import JOBS, Doctor

    add_command(commands, "open", options=Open, handler=_open)
    add_command(commands, "demo", options=Demo, handler=_demo)
    add_command(commands, "doctor", options=Doctor, handler=_doctor, description=JOBS)


def _doctor(options: Doctor) -> int:
    """Check the installation, and say how to mend it.

    Without one of these it looks at system libraries, display, OpenGL, fonts, compiled
    kernels, models, GPU, plug-ins and room on the disk. The exit code is 1 where
    something must be mended.

      sd2 doctor
      sd2 doctor --warm-up
      sd2 doctor --fetch-models
      sd2 doctor --fetch-models --from mediapipe-0.10.21-….whl
      sd2 doctor --clean    (before pip uninstall sd2-studio)
    """
    from sd2core.cli.preparing import do_job

    if do_job(options):
        return 0
    from sd2app.doctor import report

    return report(options.json)


def _open(options: Open) -> int:
    """Open a recording, or a video, a mesh or a radar capture, in the window.

    sd2 open walk.sd2
    sd2 open walk.mkv walk.npz capture/    (what belongs together)
    sd2 open walk.sd2 --screenshot window.png    (needs no display)
    """
    from sd2app.fit.request import read_request
    from sd2core.io.kinds import kind_of
    from sd2core.io.radar import without_companions

    # Says what is wrong before the window is there. A folder in which a fit was stopped
    # is no recording yet, and can be opened.
    for path in without_companions(options.paths):
        if read_request(path) is None:
            kind_of(path)
    return _show([*options.paths], options.screenshot)


def _demo(options: Demo) -> int:
    """Open the bundled sample recording in the window.

    A simulated body makes eight swipes in front of a simulated radar. The bundled files
    stay as they are; --out writes a copy to edit, export or train with.

      sd2 demo
      sd2 demo --out sample.sd2            (a copy; opens no window)
      sd2 demo --scene two                 (two people and a table)
      sd2 demo --screenshot window.png    (needs no display)
    """
    from sd2core.cli.importing import copy_sample
    from sd2core.files.paths import user_cache
    from sd2core.files.resources import resource_path
    from sd2core.version import __version__

    if options.out is not None:
        copy_sample(options.out, options.scene)
        return 0
    shown = resource_path("swipes.sd2")
    if options.scene == "two":
        shown = user_cache("samples") / f"two-{__version__}.sd2"
        if not (shown / "recording.json").exists():
            shown.parent.mkdir(parents=True, exist_ok=True)
            copy_sample(shown, "two")
    return _show([shown], options.screenshot)


def _show(paths: Sequence[Path], screenshot: Path | None) -> int:
    from sd2app.displays import explain_missing, has_display, missing_libraries, silent_displays
    from sd2app.plain_imports import plain_imports

    if screenshot is not None:
        os.environ["QT_QPA_PLATFORM"] = "offscreen"
    elif not has_display(sys.platform, os.environ):
        raise Sd2Error("There is no display to open a window on", remedy=_WITHOUT_DISPLAY)
    elif silent := silent_displays(sys.platform, os.environ):
        raise Sd2Error(
            f"The display cannot be reached: {', '.join(silent)}",
            "a display that answers",
            "Begin the session again that it belonged to (such as ssh -X), or unset the variable."
            f" {_WITHOUT_DISPLAY}",
        )
    if missing := missing_libraries():
        raise explain_missing(missing)
    with plain_imports():
        from sd2app.shell.app import run as run_window

    import signal

    # Qt's event loop gives Python no turn to raise KeyboardInterrupt.
    previous = signal.signal(signal.SIGINT, signal.SIG_DFL)
    try:
        return run_window(paths, screenshot=screenshot, parser=full_parser)
    finally:
        signal.signal(signal.SIGINT, previous)


if __name__ == "__main__":
    sys.exit(main())
