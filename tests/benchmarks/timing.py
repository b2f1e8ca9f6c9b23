"""How benchmarks time what they compare."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any


def best_s(work: Callable[[], Any], rounds: int) -> float:
    """Shortest of several: what the machine can do when nobody else is at it."""
    spent = []
    for _ in range(rounds):
        start = time.perf_counter()
        work()
        spent.append(time.perf_counter() - start)
    return min(spent)


def spent_s(work: Callable[[], Any], rounds: int) -> float:
    """Shortest of several, of the processor's time: others may be at work."""
    spent = []
    for _ in range(rounds):
        start = time.process_time()
        work()
        spent.append(time.process_time() - start)
    return min(spent)
