"""What a command writes: its name, the folders above, and what is there already."""

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

    Raises Sd2Error if one cannot be made, an output exists and is not to be overwritten, or a
    file cannot be written or has another ending than the command says.
    """
    outputs: list[Path] = [path for name in OUTPUTS if (path := getattr(options, name, None))]
    # Commands without the option go on with what is there.
    overwrite: bool | None = getattr(options, "overwrite", None)
    for output in outputs:
        refuse_existing(output, overwrite is None or overwrite)
    made: list[Path] = []
    try:
        for output in outputs:
            made += make_folder(output.absolute().parent)
        for name in OUTPUTS:
            path, endings = getattr(options, name, None), getattr(options, f"{name}_endings", ())
            if path is not None and endings:
                check_output(path, *endings)
        if getattr(options, "writes_map", False) and options.out is not None:
            _check_map(options.out)
        yield
    finally:
        # Deepest first. What holds something by now cannot be removed.
        for folder in sorted(made, key=lambda one: len(one.parts), reverse=True):
            with suppress(OSError):
                folder.rmdir()


def refuse_existing(path: Path, overwrite: bool) -> None:
    """Refuse an output that holds something, unless it is to be overwritten."""
    if not overwrite and _holds_something(path):
        remedy = "Choose another name, or say --overwrite"
        raise Sd2Error(f"{path} exists", "a new name", remedy)


def check_output(path: Path, *endings: str) -> None:
    """Refuse an output file that cannot be written, before the work is done."""
    from sd2core.files.atomic import check_writable

    listed = ", ".join(endings)
    if path.suffix.lower() not in endings:
        raise Sd2Error(f"The output file is {path}", f"a name that ends in {listed}")
    if path.is_dir():
        raise Sd2Error(f"The output file {path} is a folder", f"a file's name, ending in {listed}")
    try:
        check_writable(path)
    except OSError as error:
        raise Sd2Error(
            f"The output file {path} cannot be written ({error.strerror})",
            "a folder in which files may be made",
            "Choose another place",
        ) from error


def _check_map(path: Path) -> None:
    """Refuse to replace anything but a Doppler map."""
    # `mktemp` leaves an empty file to be filled.
    if path.exists() and path.stat().st_size:
        from sd2core.io.kinds import kind_of

        kind = kind_of(path)
        if kind != "map":
            raise Sd2Error(
                f"The output file {path} exists and is a {kind}",
                "a new name, or a Doppler map to replace",
                "Choose another name, or delete that file first",
            )


def _holds_something(path: Path) -> bool:
    """True for a file or folder that is not empty; `mktemp` leaves empty ones to be filled.

    A recording refuses for itself: what was labelled is never overwritten.
    """
    if path.is_dir():
        return next(path.iterdir(), None) is not None and path.suffix != ".sd2"
    return path.is_file() and path.stat().st_size > 0
