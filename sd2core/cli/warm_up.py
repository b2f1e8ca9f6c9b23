"""``sd2 warm-up``: compile the kernels once, so that nothing pauses later."""

from __future__ import annotations

import argparse

from sd2core.cli.options import add_command
from sd2core.cli.output import progress_bar


def add_commands(commands: argparse._SubParsersAction) -> None:
    """Add ``warm-up``."""
    add_command(
        commands,
        "warm-up",
        "compile the numerical kernels once, after installing",
        handler=_warm_up,
        description=(
            "Takes about half a minute the first time and keeps the result on disk. Without\n"
            "it everything works as well: the kernels are compiled in the background while\n"
            "a slower form serves."
        ),
    )


def _warm_up(options: argparse.Namespace) -> None:
    from sd2core.numerics.compiled import warm_up

    with progress_bar("Compiling", unit="module") as progress:
        warm_up(progress)
