"""Imports as Python makes them, while Qt is loaded."""

from __future__ import annotations

import builtins
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import ModuleType

_kept: list[Callable[..., ModuleType]] = []
"""PySide's ``import``, once it was replaced."""


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
        _kept.append(builtins.__import__)
        builtins.__import__ = plain


@contextmanager
def imports_of_qt() -> Iterator[None]:
    """Import as PySide does: Python's own ``from PySide6.QtCore import *`` finds next to nothing.

    PySide makes its classes when they are first asked for, by name or by its own ``import *``.
    """
    plain = builtins.__import__
    builtins.__import__ = _kept[0] if _kept else plain
    try:
        yield
    finally:
        builtins.__import__ = plain
