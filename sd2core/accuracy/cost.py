"""What plans cost: time taken in turns, and the most memory at once."""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable, Sequence

import numpy as np

from sd2core.accuracy.deviation import spread
from sd2core.accuracy.plans import AccuracyPlan
from sd2core.accuracy.results import Spread
from sd2core.progress import Progress


def in_turns(
    plans: Sequence[AccuracyPlan],
    repeats: int,
    milliseconds: Callable[[AccuracyPlan], tuple[float, float]],
    progress: Progress,
) -> list[tuple[Spread, Spread]]:
    """Time every plan, all of them before any again: a busy machine slows all alike.

    Parameters
    ----------
    milliseconds : callable
        Per frame, on one thread and on all cores.
    """
    spent = np.empty((repeats, 2, len(plans)))
    for turn in range(repeats):
        for number, plan in enumerate(plans):
            progress(turn * len(plans) + number, repeats * len(plans))
            spent[turn, :, number] = milliseconds(plan)
    return [(spread(spent[:, 0, k]), spread(spent[:, 1, k])) for k in range(len(plans))]


def peak_bytes(work: Callable[[], object]) -> int:
    """Most bytes allocated at once while working."""
    tracemalloc.start()
    try:
        work()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
