"""Command lines to be copied to a terminal."""

from __future__ import annotations

import shlex
import subprocess
import sys


def quoted(arguments: list[str]) -> str:
    """Command line for a terminal."""
    words = ["sd2", *arguments]
    return subprocess.list2cmdline(words) if sys.platform == "win32" else shlex.join(words)
