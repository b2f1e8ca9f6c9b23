"""Files that were cut, changed or lost, and folders as a kill leaves them."""

from __future__ import annotations

import shutil
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import pytest


def cut(file: Path) -> None:
    """Leave the first third, as a copy that was broken off."""
    content = file.read_bytes()
    file.write_bytes(content[: len(content) // 3])


def change(file: Path) -> None:
    """Change one bit in the middle."""
    content = bytearray(file.read_bytes())
    content[len(content) // 2] ^= 16
    file.write_bytes(content)


lose = Path.unlink


def _copy_if_there(source: str, target: str) -> None:
    """Copy a file that another thread of Zarr may take away before, its temporary ones."""
    with suppress(FileNotFoundError):
        shutil.copy2(source, target)


@contextmanager
def states_of(folder: Path, keep: Path) -> Iterator[list[Path]]:
    """Copies of a folder before each file takes its name, as a kill there would leave it."""
    kept: list[Path] = []
    replace_file = Path.replace
    one_at_a_time = threading.Lock()  # Zarr writes in several threads.

    def copy_and_replace(self: Path, target: Any) -> Path:
        with one_at_a_time:
            kept.append(keep / f"state-{len(kept)}")
            shutil.copytree(folder, kept[-1], copy_function=_copy_if_there)
            return replace_file(self, target)

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(Path, "replace", copy_and_replace)
        yield kept
