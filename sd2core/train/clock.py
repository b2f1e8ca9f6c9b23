"""Clock of training time: continues after a resume, stops in pauses."""

from __future__ import annotations

import time


class Clock:
    """Seconds of training; ``elapsed_s`` are those of earlier processes."""

    def __init__(self, elapsed_s: float = 0.0) -> None:
        self._before_s = elapsed_s
        self._begun_s = time.monotonic()

    @property
    def elapsed_s(self) -> float:
        """Seconds since the run began, without pauses."""
        return self._before_s + time.monotonic() - self._begun_s

    def leave_out(self, seconds: float) -> None:
        """Do not count a pause."""
        self._begun_s += seconds
