"""Folders of what a command writes."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from sd2core.files.paths import make_folder

OUTPUTS = ("out", "figure", "markdown", "probabilities", "landmarks", "export", "screenshot")
"""Options, as the parser names them, whose value is a file or folder to write."""


@contextmanager
def output_folders(options: argparse.Namespace) -> Iterator[None]:
    """Make the folders above all outputs that are missing; those that stay empty go at the end.

    Raises Sd2Error if one cannot be made.
    """
    made: list[Path] = []
    try:
        for name in OUTPUTS:
            output: Path | None = getattr(options, name, None)
            if output is not None:
                made += make_folder(output.absolute().parent)
        yield
    finally:
        # Deepest first. What holds something by now cannot be removed.
        for folder in sorted(made, key=lambda one: len(one.parts), reverse=True):
            with suppress(OSError):
                folder.rmdir()
