"""Runs of classifiers in words."""

from __future__ import annotations

from sd2app.classify.run import ClassRun
from sd2app.widgets.text import about, exact_text

_PHASES = {
    "starting": "Starting…",
    "stopping": "Stopping…",
    "cancelling": "Cancelling…",
    "finished": "Finished",
    "stopped": "Stopped",
    "failed": "It failed",
    "died": "Its process is gone",
    "gone": "",
}


def headline(run: ClassRun) -> str:
    """Current phase of the run in words."""
    history = run.history
    if run.phase != "running":
        return _PHASES[run.phase]
    if run.compares:
        return f"Comparing: training {min(history.done + 1, history.total)} of {history.total}"
    return f"Training: step {history.done} of {history.total}"


def time_text(run: ClassRun) -> str:
    """Elapsed time and time left."""
    history, parts = run.history, []
    if run.phase == "running" and history.left_s is not None:
        parts.append(f"{about(history.left_s)} left")
    if history.elapsed_s is not None:
        passed = exact_text(history.elapsed_s)
        parts.append(f"{passed} so far" if run.under_way else f"took {passed}")
    return " · ".join(parts)


def note(run: ClassRun) -> str:
    """Advice for a run that was stopped or did not reach its end."""
    if run.phase == "died":
        return "It was killed, or the machine was switched off."
    if run.phase == "stopped" and run.compares:
        return "What it has trained is kept: Resume trains what is missing."
    if run.phase == "stopped":
        return "The best so far is kept." if run.result else "There was nothing to keep yet."
    return ""


def facts(run: ClassRun) -> list[tuple[str, str]]:
    """Best recall of a training so far."""
    best = run.history.best
    if best is None:
        return []
    return [("Best recall", f"{100 * best.recall:.1f} %, at step {best.step}")]
