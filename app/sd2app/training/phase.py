"""How a training run stands, by its folder, its process and its lines."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal

from sd2app.training.history import TrainingHistory
from sd2core.errors import Sd2Error
from sd2core.runs.control import Word, read_control
from sd2core.runs.folder import LIVE
from sd2core.runs.progress import ProgressTail
from sd2core.train.folder import TrainingFolder

Phase = Literal[
    "starting", "running", "pausing", "paused", "resuming", "stopping", "cancelling",
    "finished", "stopped", "failed", "died", "gone",
]  # fmt: skip
"""``gone`` is a run that was cancelled, or deleted by somebody else."""

UNDER_WAY: tuple[Phase, ...] = (
    "starting", "running", "pausing", "paused", "resuming", "stopping", "cancelling",
)  # fmt: skip
"""A process is at it."""


@dataclass(frozen=True)
class Look:
    """What was found at one look at the folder of a run.

    Parameters
    ----------
    exists : bool
        Whether there is a run.
    live : bool
        Whether a process is at it.
    state : str
        As the run describes itself; empty while a process is at it.
    word : str
        What it was told.
    events : list of dict
        New lines.
    """

    exists: bool
    live: bool
    state: str = ""
    word: Word = "run"
    events: list[dict[str, Any]] = field(default_factory=list)


def look_at(folder: TrainingFolder, tail: ProgressTail) -> Look:
    """Look once; may wait for the disk."""
    # The process first: when it is gone, all that it wrote is there to be read.
    live, exists = folder.live, folder.exists
    events = tail.new()
    state = ""
    if exists and not live:
        try:
            state = folder.state()
        except Sd2Error:
            # Deleted meanwhile, or it cannot be read.
            exists = folder.exists
    return Look(exists, live, state, read_control(folder.control), events)


def phase_of(look: Look, history: TrainingHistory, launching: bool) -> Phase:
    """In one word.

    Parameters
    ----------
    look : Look
    history : TrainingHistory
        With the lines of ``look``.
    launching : bool
        Whether a process was started that may not have got as far as its folder.
    """
    if look.live:
        return _under_way(look.word, history)
    if launching:
        return "starting"
    if not look.exists:
        return "gone"
    if history.outcome is not None:
        return "gone" if history.outcome == "cancelled" else history.outcome
    if look.state in ("finished", "stopped", "failed"):
        return look.state  # type: ignore[return-value]
    if look.state == "cancelled":
        return "gone"
    assert look.state in (*LIVE, "died", "")
    return "died"


def _under_way(word: Word, history: TrainingHistory) -> Phase:
    if word == "cancel":
        return "cancelling"
    if word == "stop":
        return "stopping"
    if not history.begun or history.outcome is not None:
        return "starting"
    if history.paused:
        return "paused" if word == "pause" else "resuming"
    return "pausing" if word == "pause" else "running"
