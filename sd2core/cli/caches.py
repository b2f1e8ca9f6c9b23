"""What the program keeps outside of recordings and can make again: listed, and removed."""

from __future__ import annotations

import sys
from contextlib import suppress
from pathlib import Path

from sd2core.cli.batch import bytes_words
from sd2core.cli.output import print_rows
from sd2core.errors import Sd2Error
from sd2core.files.limits import size_bytes
from sd2core.files.paths import remove, user_cache, user_data
from sd2core.numerics.compiled import kernel_folders


def caches() -> list[Path]:
    """Everything in the user's cache folder, and machine code elsewhere."""
    folder = user_cache("")
    # Someone may have given caches and data, such as edits to recover, one place.
    its_own = folder.is_dir() and not user_data("").is_relative_to(folder)
    return sorted({*(folder.iterdir() if its_own else ()), *kernel_folders()})


def remove_caches(*, ask: bool) -> None:
    """List the caches and remove them.

    Raises Sd2Error where there is nobody to ask, or one of them stays.
    """
    found = caches()
    if not found:
        print("There are no caches")
        return
    print_rows([("size", "cache"), *((bytes_words(size_bytes(one)), str(one)) for one in found)])
    if ask and not sys.stdin.isatty():
        raise Sd2Error("Nothing was removed: there is no terminal to ask on", remedy="Add --yes")
    if ask and input("Remove them? They are made again when needed. [y/N] ").lower() != "y":
        print("Nothing was removed")
        return
    for path in found:
        remove(path)
    if left := [str(path) for path in found if path.exists()]:
        raise Sd2Error(
            f"{', '.join(left)} could not be removed",
            remedy="Close the program, and do it with the rights of who installed it",
        )
    with suppress(OSError):
        user_cache("").rmdir()
    print("Removed")
