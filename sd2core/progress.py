"""Reporting the progress of long work, and cancelling it."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[int, int], None]
"""``progress(done, total)``; it may raise :class:`Cancelled` to stop the work."""


class Cancelled(Exception):
    """Raised by a progress callback: the caller no longer wants the result."""


def silent(done: int, total: int) -> None:
    """Report nothing."""
