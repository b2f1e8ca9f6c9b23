"""Command lines of the tools: parsed, run and explained as those of ``sd2`` are."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from sd2core.cli.command_parser import add_command, subcommands_of
from sd2core.cli.running import run
from sd2core.options.records import OptionRecord

Commands = Mapping[str, tuple[type[OptionRecord], Callable[[Any], None]]]
"""Names of commands, their options, and what does them; its docstring is the help."""


def tool(name: str, commands: Commands) -> Callable[..., int]:
    """Program of ``python -m tools.NAME``: it runs a command, by default as typed, for a code."""

    def main(arguments: Sequence[str] | None = None) -> int:
        parser = argparse.ArgumentParser(prog=f"python -m tools.{name}")
        places = subcommands_of(parser)
        for command, (options, handler) in commands.items():
            add_command(places, command, options=options, handler=handler)
        return run(parser, sys.argv[1:] if arguments is None else arguments)

    return main
