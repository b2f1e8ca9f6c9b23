"""Imports as Python makes them, while Qt is loaded."""

from __future__ import annotations

import builtins
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def plain_imports() -> Iterator[None]:
    """Keep Python's own ``import`` where Qt is imported within.

    PySide puts another in its place, which reads the source of every module that is imported
    later, to see whether it selects one of PySide's features. None here does, and it takes a
    tenth of the start.
    """
    plain = builtins.__import__
    try:
        yield
    finally:
        builtins.__import__ = plain
