"""A kind of file that mutants are made of."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Target:
    """File or folder with a reader; its errors must contain ``name`` up to the first dot."""

    name: str
    write: Callable[[Path], object]  # Makes the undamaged original at a path.
    read: Callable[[Path], object]  # Reads all of it.
