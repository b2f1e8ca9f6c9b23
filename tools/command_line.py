"""Command lines of the tools: parsed, run and explained as those of ``sd2`` are."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from typing import Any, get_type_hints

from sd2core.cli.command_parser import add_command, subcommands_of
from sd2core.cli.running import run


def tool(name: str, *handlers: Callable[[Any], None]) -> Callable[..., int]:
    """Program of ``python -m tools.NAME``: it runs a command, by default as typed, for a code.

    A command has the name of its handler, whose docstring is the help and whose argument is the
    record of its options.
    """

    def main(arguments: Sequence[str] | None = None) -> int:
        parser = argparse.ArgumentParser(prog=f"python -m tools.{name}")
        places = subcommands_of(parser)
        for handler in handlers:
            options = get_type_hints(handler)["options"]
            command = handler.__name__.strip("_")
            add_command(places, command, options=options, handler=handler)
        return run(parser, sys.argv[1:] if arguments is None else arguments)

    return main
