"""Batches in words."""

from __future__ import annotations

from typing import Any

from sd2app.background.run_monitor import Phase
from sd2app.batch.run import BatchMonitor, Failed
from sd2app.batch.setup import Entry
from sd2app.widgets.text import about, bytes_text, counted, duration_text, exact_text

STEP_WORDS = {
    "inspect": "Look at recordings",
    "fit": "Fit bodies",
    "synthesise": "Synthesise",
    "denoise": "Denoise",
    "simulate": "Simulate radar",
    "export": "Export",
}
_PHASES: dict[Phase, str] = {
    "starting": "Starting…",
    "running": "At work",
    "stopping": "Stopping, what is done stays…",
    "finished": "Finished",
    "stopped": "Stopped",
    "failed": "Failed",
    "died": "Ended unexpectedly",
    "gone": "Nothing is there",
}


def entry_text(entry: Entry) -> str:
    """Content of an entry in words."""
    if entry.problem:
        return entry.problem
    if entry.count is None:
        return "…"
    return "" if entry.count == 1 and len(entry.patterns) == 1 else counted(entry.count, "file")


def headline(batch: BatchMonitor) -> str:
    """Current phase of the run in words."""
    status, words = batch.status, _PHASES[batch.phase]
    if batch.phase == "finished" and status is not None and status.failed:
        return f"{words}, but {counted(status.failed, 'task')} could not be done"
    if batch.phase == "running" and status is not None and not status.workers:
        return f"{words}: waiting for workers"
    return words


def time_text(batch: BatchMonitor) -> str:
    """Elapsed time and time left."""
    status = batch.status
    if status is None or status.elapsed_s is None:
        return ""
    passed = exact_text(status.elapsed_s)
    parts = [f"{passed} so far" if batch.under_way else f"Took {passed}"]
    if batch.under_way and status.left_s is not None:
        parts.append(f"about {duration_text(status.left_s)} left")
    if batch.under_way and status.workers:
        parts.append(counted(status.workers, "worker"))
    return " · ".join(parts)


def step_facts(batch: BatchMonitor) -> list[tuple[str, int, int, str]]:
    """Per step: its name, how many tasks are settled, how many there are, and both in words."""
    status = batch.status
    if status is None:
        return []
    facts = []
    for step in batch.steps:
        if not (total := status.total.get(step, 0)):
            continue
        done, there = status.done.get(step, 0), status.there.get(step, 0)
        words = f"{done + there:,} of {total:,}"
        if there:
            words += f", {there:,} there already"
        facts.append((STEP_WORDS.get(step, step), done + there, total, words))
    return facts


def failure_text(failed: Failed) -> str:
    """One failure, on a line."""
    place = f" from place {failed.placement}" if failed.placement else ""
    step = STEP_WORDS.get(failed.step, failed.step).lower()
    return f"{failed.recording}, {step}{place}: {failed.reason}"


def estimate_headline(facts: dict[str, Any]) -> str:
    """Summary of a dry run in one line."""
    recordings = counted(facts["recordings"], "recording")
    if not any(step["to_do"] for step in facts["steps"].values()):
        return f"{recordings}: all of it is there already"
    time = about(3600 * facts["hours"])
    return f"{recordings}: {time} on {counted(facts['workers'], 'worker')}, {_size(facts['bytes'])}"


def estimate_facts(facts: dict[str, Any]) -> list[tuple[str, str]]:
    """The same step by step."""
    rows = [
        (STEP_WORDS.get(name, name), _step_text(step))
        for name, step in facts["steps"].items()
        if step["to_do"] or step["there"]
    ]
    if facts["looked_at"] < facts["recordings"]:
        rows.append(("Looked at", f"{facts['looked_at']:,}; the others are taken to be like them"))
    return rows


def unusable_text(facts: dict[str, Any]) -> str:
    """Recordings that cannot be used, with the first reason; empty where all can."""
    unusable = facts["unusable"]
    if not unusable:
        return ""
    more = f" ({len(unusable) - 1:,} more cannot, either.)" if len(unusable) > 1 else ""
    return f"Cannot be used: {unusable[0]}{more}"


def _step_text(step: dict[str, Any]) -> str:
    parts = [f"{step['to_do']:,} to do"]
    if step["there"]:
        parts.append(f"{step['there']:,} there already")
    if step["to_do"]:
        parts.append(about(step["seconds"]))
    if step["bytes"]:
        parts.append(_size(step["bytes"]))
    return " · ".join(parts)


def _size(count: float) -> str:
    return f"some {bytes_text(round(count))}"
