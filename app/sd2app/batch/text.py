"""Batches in words."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sd2app.batch.run import BatchMonitor, Failed
from sd2app.batch.setup import Entry
from sd2app.widgets.run_text import PHASES, time_text
from sd2app.widgets.text import about, bytes_text, counted

if TYPE_CHECKING:
    from sd2core.batch.estimate import BatchEstimate, StepEstimate

STEP_WORDS = {
    "inspect": "Look at recordings",
    "fit": "Fit bodies",
    "synthesise": "Synthesise",
    "denoise": "Denoise",
    "simulate": "Simulate radar",
    "export": "Export",
}
_PHASES = PHASES | {"stopping": "Stopping, what is done stays…"}


def entry_text(entry: Entry) -> str:
    """Content of an entry in words."""
    if entry.problem:
        return entry.problem
    if entry.count is None:
        return "…"
    return "" if entry.count == 1 and len(entry.patterns) == 1 else counted(entry.count, "file")


def headline(batch: BatchMonitor) -> str:
    """Current phase of the run in words."""
    history, words = batch.history, _PHASES[batch.phase]
    if batch.phase == "finished" and history.failed:
        return f"{words}, but {counted(history.failed, 'task')} could not be done"
    if batch.phase == "running" and not history.workers:
        return f"{words}: waiting for workers"
    return words


def batch_time_text(batch: BatchMonitor) -> str:
    """Time left, elapsed time, and the processes that share the work."""
    workers = batch.history.workers if batch.under_way else 0
    return " · ".join(filter(None, (time_text(batch), counted(workers, "worker") * bool(workers))))


def step_facts(batch: BatchMonitor) -> list[tuple[str, int, int, str]]:
    """Per step: its name, how many tasks are settled, how many there are, and both in words."""
    facts = []
    for step in batch.history.steps:
        total, done, there = (
            batch.history.tasks[name].get(step, 0) for name in ("total", "done", "there")
        )
        if not total:
            continue
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


def estimate_headline(made: BatchEstimate) -> str:
    """Summary of an estimate in one line."""
    recordings = counted(made.recordings, "recording")
    if not any(step.to_do for step in made.steps.values()):
        return f"{recordings}: all of it is there already"
    time = "the first tasks tell how long it takes"
    if made.seconds is not None:
        time = f"{about(made.seconds)} on {counted(made.workers, 'worker')}"
    return f"{recordings}: {time}, at most {bytes_text(made.bytes)}"


def estimate_facts(made: BatchEstimate) -> list[tuple[str, str]]:
    """Estimate step by step."""
    rows = [
        (STEP_WORDS.get(name, name), _step_text(step))
        for name, step in made.steps.items()
        if step.to_do or step.there
    ]
    if made.looked_at < made.recordings:
        rows.append(("Looked at", f"{made.looked_at:,}; the others are taken to be like them"))
    return rows


def unusable_text(made: BatchEstimate) -> str:
    """Recordings that cannot be used, with the first reason; empty where all can."""
    unusable = made.unusable
    if not unusable:
        return ""
    more = f" ({len(unusable) - 1:,} more cannot, either.)" if len(unusable) > 1 else ""
    return f"Cannot be used: {unusable[0]}{more}"


def _step_text(step: StepEstimate) -> str:
    parts = [f"{step.to_do:,} to do"]
    if step.there:
        parts.append(f"{step.there:,} there already")
    if step.to_do and step.seconds is not None:
        parts.append(about(step.seconds))
    if step.bytes:
        parts.append(f"at most {bytes_text(step.bytes)}")
    return " · ".join(parts)
