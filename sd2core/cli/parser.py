"""The parser of ``sd2`` and the pieces that its subcommands share."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from sd2core.cli.command_names import COMMANDS, WINDOW_COMMANDS
from sd2core.cli.command_parser import (
    HELP,
    CommandParser,
    HelpFormatter,
    Subcommands,
    add_declared,
    subcommands_of,
)
from sd2core.version import __version__

_DESCRIPTION = """\
SD² Studio turns a video of a person into mmWave-radar Doppler: what a radar
would have measured, at any place one puts it.
"""

_EPILOG = """\
examples:
{}\
  sd2 info walk.npz                           what is in a file
  sd2 fit walk.mp4 --out walk.zarr            a moving mesh from a video of a person
  sd2 import --video walk.mkv --mesh walk.npz --out walk.sd2
  sd2 set walk.sd2 --sensor 0.1,0,0           where its radar is, and what it is made of
  sd2 align walk.sd2 --save                   the radar's clock, from what both saw
  sd2 synth walk.npz --out map.npz --sensor 0,0,1
  sd2 radar capture/ --out real.npz
  sd2 listen --dca1000 --setup profile.cfg --out walk.sd2    a radar, while it runs
  sd2 record --camera 0 --radar 192.168.33.30 --setup profile.cfg --out take.sd2
  sd2 imu walk.zarr --at left-wrist --out wrist.csv    what an inertial sensor would feel
  sd2 denoise map.npz --out denoised.npz      what a radar would show
  sd2 labels suggest walk.sd2                 where something moves
  sd2 train pairs.zarr --out runs/s4          teach a denoiser from pairs
  sd2 classify train pairs.zarr --out g.safetensors    teach a classifier of gestures
  sd2 export walk.sd2 --out walk.zarr         a data set of segments to learn from
  sd2 study study.toml                        does synthetic data help on a real radar?
  sd2 batch plan.toml                         all of that for many recordings and places
  sd2 ladder walk.npz --quick                 what accuracy this scene requires

`sd2 COMMAND --help` explains one command; `sd2 doctor` lists those of plug-ins.
With --json what went wrong is JSON as well, {{"error": {{"found": …, "expected": …,
"remedy": …}}}}, and the exit code is 1, or 2 where the words are no command.
"""

_MODULE_OF = {
    **dict.fromkeys(("import", "set", "relink"), "importing"),
    **dict.fromkeys(("warm-up", "fetch-models"), "preparing"),
}
"""Modules of commands that are called otherwise."""


def build_parser(
    examples: str = "", typed: Sequence[str] = ()
) -> tuple[argparse.ArgumentParser, Subcommands]:
    """Parser of the library's commands, and where others are added, with their examples.

    Where the first of the ``typed`` words is a command, the others are left out, and where it asks
    for help, all are but named: they take longer to load than most commands work. Commands of
    plug-ins are there where an unknown one is typed, or all are wanted; to look for them in every
    package takes as long as the rest of the help.
    """
    parser = CommandParser(
        prog="sd2",
        description=_DESCRIPTION,
        epilog=_EPILOG.format(examples),
        formatter_class=HelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"SD² Studio {__version__}")
    commands = subcommands_of(parser, typed)
    name = typed[0] if typed else ""
    if name in HELP:
        for command, summary in COMMANDS.items():
            commands.add_parser(command, help=summary, add_help=False)
        return parser, commands
    if name in WINDOW_COMMANDS:
        return parser, commands
    modules = {command: _module_of(command) for command in COMMANDS}
    if name in COMMANDS:
        add_declared(commands, modules)
        return parser, commands
    from sd2core.cli.added_commands import add_named, add_usable

    if not add_named(commands, name):
        add_declared(commands, modules)
        if not name.startswith("-"):
            add_usable(commands)
    return parser, commands


def _module_of(command: str) -> str:
    return _MODULE_OF.get(command, command.replace("-", "_"))
