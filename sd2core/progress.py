"""Reporting the progress of long work, and cancelling it."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[int, int], None]
"""``progress(done, total)``; it may raise :class:`Cancelled` to stop the work."""


class Cancelled(Exception):
    """Raised by a progress callback: the caller no longer wants the result."""


_STEPS = 1000
"""Steps of a whole whose parts report with totals of their own."""


def part_of(progress: Progress, start: float, stop: float, of: int = 1) -> Progress:
    """Progress of a part of the work.

    Parameters
    ----------
    progress : Progress
        Of the whole; called with thousandths of ``of``.
    start, stop : float
        Where the part begins and ends, from 0 to ``of``.
    of : int
        Size of the whole.
    """
    return lambda done, total: progress(
        round(_STEPS * (start + (stop - start) * done / max(total, 1))), _STEPS * of
    )


def silent(done: int, total: int) -> None:
    """Report nothing."""
