"""Clock of training time: continues after a resume, stops in pauses."""

from __future__ import annotations

import time


class Clock:
    """Seconds of training; ``elapsed_s`` are those of earlier processes."""

    def __init__(self, elapsed_s: float = 0.0) -> None:
        self._before_s = elapsed_s
        self._begun_s = time.monotonic()
        self._first_share: float | None = None

    @property
    def elapsed_s(self) -> float:
        """Seconds since the run began, without pauses."""
        return self._before_s + time.monotonic() - self._begun_s

    def leave_out(self, seconds: float) -> None:
        """Do not count a pause."""
        self._begun_s += seconds

    def left_s(self, share: float) -> float | None:
        """Remaining time by the pace since this process began; ``share`` of the run is done."""
        if self._first_share is None:
            self._first_share = share
            return None
        done = share - self._first_share
        spent_s = time.monotonic() - self._begun_s
        return spent_s * (1.0 - share) / done if done > 0 else None
