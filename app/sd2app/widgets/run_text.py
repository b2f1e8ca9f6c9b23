"""Runs in the background in words, the same for all kinds."""

from __future__ import annotations

from typing import Any

from sd2app.background.run_monitor import UNDER_WAY, Phase, RunMonitor
from sd2app.background.runs import KnownRun
from sd2app.widgets.text import about, clock_text, exact_text

PHASES: dict[Phase, str] = {
    "starting": "Starting…",
    "running": "At work",
    "pausing": "Pausing…",
    "paused": "Paused",
    "resuming": "Going on…",
    "stopping": "Stopping…",
    "cancelling": "Cancelling…",
    "finished": "Finished",
    "stopped": "Stopped",
    "failed": "Failed",
    "died": "Ended unexpectedly",
    "gone": "Cancelled",
}
_STATES = {"starting": "under way", "running": "under way", "died": "ended unexpectedly"}
AT_WORK: tuple[Phase, ...] = ("running", "pausing", "paused", "resuming")
"""Phases in which a run has begun and is not about to end."""


def title_of(run: KnownRun) -> str:
    """A run in a list: when it was started, what it is, and where it stands."""
    state = _STATES.get(run.state, run.state)
    return " · ".join((clock_text(run.started_unix_s), run.name, state))


def time_text(run: RunMonitor[Any]) -> str:
    """Time left and elapsed time, as far as they are known."""
    history, parts = run.history, []
    if run.phase in AT_WORK and history.left_s is not None:
        parts.append(f"{about(history.left_s)} left")
    if history.elapsed_s is not None:
        passed = exact_text(history.elapsed_s)
        parts.append(f"{passed} so far" if run.phase in UNDER_WAY else f"took {passed}")
    return " · ".join(parts)
