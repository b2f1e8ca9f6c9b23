"""Commands that a user runs on a file, for readers of mutants."""

from __future__ import annotations

import io
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

from sd2core.cli.command_parser import record_of
from sd2core.cli.parser import build_parser


def sd2(*command: object) -> None:
    """Run a command and print what it prints as a terminal in UTF-8 would."""
    words = list(map(str, command))
    options = build_parser(typed=words)[0].parse_args(words)
    terminal = io.TextIOWrapper(io.BytesIO(), encoding="utf-8")
    with redirect_stdout(terminal), redirect_stderr(terminal):
        options.handler(record_of(options))


def tell(path: Path) -> None:
    """Say what a file holds, to programs and to people."""
    sd2("info", path, "--json")
    sd2("info", path)
