"""What a command writes: the folders above, and what is there already."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from sd2core.errors import Sd2Error
from sd2core.files.paths import make_folder

OUTPUTS = ("out", "figure", "markdown", "probabilities", "landmarks", "export", "screenshot")
"""Options, as the parser names them, whose value is a file or folder to write."""


@contextmanager
def output_folders(options: argparse.Namespace) -> Iterator[None]:
    """Make the folders above all outputs that are missing; those that stay empty go at the end.

    Raises Sd2Error if one cannot be made, or an output exists and is not to be overwritten.
    """
    outputs: list[Path] = [path for name in OUTPUTS if (path := getattr(options, name, None))]
    # Commands without the option go on with what is there.
    overwrite: bool | None = getattr(options, "overwrite", None)
    there = [path for path in outputs if overwrite is not None and _holds_something(path)]
    if there and not overwrite:
        remedy = "Choose another name, or say --overwrite"
        raise Sd2Error(f"{there[0]} exists", "a new name", remedy)
    made: list[Path] = []
    try:
        for output in outputs:
            made += make_folder(output.absolute().parent)
        yield
    finally:
        # Deepest first. What holds something by now cannot be removed.
        for folder in sorted(made, key=lambda one: len(one.parts), reverse=True):
            with suppress(OSError):
                folder.rmdir()


def _holds_something(path: Path) -> bool:
    """True for a file or folder that is not empty; `mktemp` leaves empty ones to be filled.

    A recording refuses for itself: what was labelled is never overwritten.
    """
    if path.is_dir():
        return next(path.iterdir(), None) is not None and path.suffix != ".sd2"
    return path.is_file() and path.stat().st_size > 0
