"""The parser of ``sd2`` and the pieces that its subcommands share."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from importlib import import_module

from sd2core.cli.command_parser import CommandParser
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
  sd2 imu walk.zarr --at left-wrist --out wrist.csv    what an inertial sensor would feel
  sd2 denoise map.npz --out denoised.npz      what a radar would show
  sd2 labels suggest walk.sd2                 where something moves
  sd2 train pairs.zarr --out runs/s4          teach a denoiser from pairs
  sd2 classify train pairs.zarr --out g.safetensors    teach a classifier of gestures
  sd2 export walk.sd2 --out walk.zarr         a data set of segments to learn from
  sd2 study study.toml                        does synthetic data help on a real radar?
  sd2 batch plan.toml                         all of that for many recordings and places
  sd2 ladder walk.npz --quick                 what accuracy this scene requires

`sd2 COMMAND --help` explains one command. With --json what went wrong is JSON as
well, {{"error": {{"found": …, "expected": …, "remedy": …}}}}, and the exit code is
1, or 2 for what was typed wrong.
"""


_MODULES = (
    *("info", "importing", "align", "fit", "synth", "radar", "listen", "imu", "denoise"),
    *("classify", "labels", "pairs", "export", "ladder", "placements", "compare_meshes"),
    *("strip", "simulate", "train", "runs", "eval", "study", "batch", "preparing"),
)
"""Modules with commands, in the order of the help."""

_MODULE_OF = {
    **dict.fromkeys(("import", "set", "relink"), "importing"),
    **dict.fromkeys(("warm-up", "fetch-models"), "preparing"),
}
"""Modules of commands that are called otherwise."""


def build_parser(
    examples: str = "", typed: Sequence[str] = ()
) -> tuple[argparse.ArgumentParser, argparse._SubParsersAction]:
    """Parser of the library's commands, and where others are added, with their examples.

    Where the first of the ``typed`` words is a command, the others are left out: they take longer
    to load than most commands work.
    """
    parser = CommandParser(
        prog="sd2",
        description=_DESCRIPTION,
        epilog=_EPILOG.format(examples),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"SD² Studio {__version__}")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    name = typed[0] if typed else ""
    named = _MODULE_OF.get(name, name.replace("-", "_"))
    for module in (named,) if named in _MODULES else _MODULES:
        import_module(f"sd2core.cli.{module}").add_commands(commands)
    return parser, commands
