"""Command lines of the tools: parsed, run and explained as those of ``sd2`` are."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence

from sd2core.cli.running import run
from sd2core.options.bounds import COUNT
from sd2core.options.kinds import number_reader

positive_int = number_reader(COUNT)


def add_json(parser: argparse.ArgumentParser) -> None:
    """Add ``--json``."""
    parser.add_argument("--json", action="store_true", help="print JSON, for other programs")


def run_tool(
    name: str,
    description: str,
    add_commands: Callable[[argparse._SubParsersAction], None],
    arguments: Sequence[str] | None = None,
) -> int:
    """Run one command of ``python -m tools.NAME`` and return its exit code.

    Parameters
    ----------
    name : str
        Package in ``tools``.
    description : str
        First lines of ``--help``.
    add_commands : callable
        Adds the commands, each with its handler.
    arguments : sequence of str, optional
        Those of the process by default.
    """
    parser = argparse.ArgumentParser(
        prog=f"python -m tools.{name}",
        description=description,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add_commands(parser.add_subparsers(title="commands", metavar="COMMAND", required=True))
    return run(parser, sys.argv[1:] if arguments is None else arguments)
