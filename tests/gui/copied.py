"""Command lines that the window has copied."""

from __future__ import annotations

import shlex
from typing import Any

from PySide6.QtWidgets import QApplication

from sd2app.command_line import full_parser
from sd2core.cli.command_parser import record_of


def copied_record() -> Any:
    """Record of the command on the clipboard, read as it would be where it is typed."""
    program, *words = shlex.split(QApplication.clipboard().text())
    assert program == "sd2"
    return record_of(full_parser(words).parse_args(words))
