"""Folder of a batch: its files and its status.

Needs neither Dask nor torch: the window and ``sd2 batch --status`` look at batches with it.
``docs/formats.md`` says what the files hold.
"""

from __future__ import annotations

from dataclasses import field
from pathlib import Path
from typing import Any

from pydantic.dataclasses import dataclass

from sd2core.errors import Sd2Error
from sd2core.files.paths import make_folder
from sd2core.runs.folder import RunFolder, State
from sd2core.runs.progress import Event, last_of, read_events

PROGRESS_FORMAT = "sd2-batch-progress"
PROGRESS_VERSION = 1


@dataclass(frozen=True)
class BatchStatus:
    """State and counts of a batch."""

    state: State
    pid: int | None  # of the process that works or worked on it
    started_unix_s: float  # of the last run
    total: dict[str, int] = field(default_factory=dict)  # per step: tasks that are known of so far
    done: dict[str, int] = field(default_factory=dict)  # per step: made by the last run
    there: dict[str, int] = field(default_factory=dict)  # per step: found made already
    failed: int = 0  # tasks that cannot be done
    waiting: int = 0  # not done because of those
    running: int = 0
    workers: int = 0
    elapsed_s: float | None = None
    left_s: float | None = None
    error: str | None = None  # reason if the whole batch failed


class BatchFolder(RunFolder):
    """Folder with the results of one batch."""

    format = "sd2-batch"
    file_name = "batch.json"
    noun = "folder of a batch"
    maker = "sd2 batch"
    look = "sd2 batch --status"

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self.plan = self.path / "plan.toml"  # copy of the plan
        self.report = self.path / "report.json"  # end of the last run, and its failures
        self.results = self.path / "results.jsonl"  # maps that are there, one JSON line each

    def result(self, kind: str, key: str, suffix: str) -> Path:
        """Path of a task's result: in one of 256 folders, so that none gets too long."""
        return self.path / kind / key[:2] / f"{key}{suffix}"

    def prepare(self) -> None:
        """Make the folder, with those above it, or take over one of a batch.

        Raises Sd2Error if it holds something else, or cannot be made.
        """
        ours = {"lock", self.log.name}
        if (self.path.exists() and not self.exists) and (
            not self.path.is_dir() or {one.name for one in self.path.iterdir()} - ours
        ):
            raise Sd2Error(
                f"{self.path} exists and is not the folder of a batch",
                "a new folder, or one that `sd2 batch` made",
                "Choose another `out` in the plan",
            )
        make_folder(self.path)

    def status(self) -> BatchStatus:
        """Current status, from all lines of progress.

        Raises Sd2Error if there is no batch, or its description is damaged.
        """
        state, about = self.state_and_about()
        with self.refusing_damage():
            return status_of(state, about, read_events(self.progress))


def status_of(state: State, about: dict[str, Any], events: list[Event]) -> BatchStatus:
    """Status of a batch from its lines; only the last run counts."""
    starts = [number for number, event in enumerate(events) if event["event"] == "start"]
    events = events[starts[-1] :] if starts else []
    last = last_of([one for one in events if one["event"] in ("progress", "end")], "end")
    last = last or last_of(events, "progress") or {}
    names = {"total", "done", "there", "failed", "waiting", "elapsed_s"}
    if state == "running":
        names |= {"running", "workers", "left_s"}
    error = last.get("error")
    return BatchStatus(
        state,
        about.get("pid"),
        about.get("started_unix_s", 0.0),
        **{name: last[name] for name in names & last.keys()},
        error=str(Sd2Error(**error)) if isinstance(error, dict) else None,
    )
