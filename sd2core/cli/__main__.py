"""``python -m sd2core.cli``, and ``sd2`` where the library is installed without the window."""

from __future__ import annotations

import argparse
import sys

from sd2core.cli import build_parser, run
from sd2core.cli.options import add_command
from sd2core.errors import Sd2Error

_WINDOW_COMMANDS = ("open", "demo", "doctor")


def main() -> int:
    """Run one of the library's commands and return its exit code."""
    parser, commands = build_parser()
    for name in _WINDOW_COMMANDS:
        absent = add_command(commands, name, "(with the window, sd2-studio)", handler=_absent)
        absent.set_defaults(name=name)
    words = sys.argv[1:]
    # Whatever else is asked of a command that is not there.
    return run(parser, words[:1] if words and words[0] in _WINDOW_COMMANDS else words)


def _absent(options: argparse.Namespace) -> int:
    raise Sd2Error(
        f"`sd2 {options.name}` needs the window, which is not in the library alone (sd2-core):"
        " type `pip uninstall sd2-core`, then `pip install sd2_studio-….whl`"
    )


if __name__ == "__main__":
    sys.exit(main())
