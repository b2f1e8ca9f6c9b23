"""The folder of a batch: what is in it, whether its process lives, how it stands.

Needs neither Dask nor torch: the window and ``sd2 batch --status`` look at batches with it.
``docs/formats.md`` says what the files hold.
"""

from __future__ import annotations

import json
import os
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_write_text
from sd2core.files.lock import FileLock, is_locked
from sd2core.runs.control import write_control
from sd2core.runs.progress import Event, last_of, read_events
from sd2core.version import __version__

State = Literal["running", "finished", "stopped", "failed", "died"]
"""``died`` is never written: the file says that it runs, and its process is gone."""

FORMAT = "sd2-batch"
VERSION = 1
PROGRESS_FORMAT = "sd2-batch-progress"
PROGRESS_VERSION = 1

_PATIENCE_S = 0.5


@dataclass(frozen=True)
class BatchStatus:
    """How a batch stands.

    Parameters
    ----------
    state : State
    pid : int or None
        Of the process that works or worked on it.
    started_unix_s : float
        When the last run began.
    total, done, there : dict of str to int
        Per step: tasks that are known of so far, made by the last run, found made already.
    failed : int
        Tasks that cannot be done.
    waiting : int
        Tasks that are not done because of those.
    running, workers : int
    elapsed_s, left_s : float or None
    error : str or None
        Why the whole batch failed.
    """

    state: State
    pid: int | None
    started_unix_s: float
    total: dict[str, int] = field(default_factory=dict)
    done: dict[str, int] = field(default_factory=dict)
    there: dict[str, int] = field(default_factory=dict)
    failed: int = 0
    waiting: int = 0
    running: int = 0
    workers: int = 0
    elapsed_s: float | None = None
    left_s: float | None = None
    error: str | None = None


class BatchFolder:
    """The results of one batch on disk.

    Parameters
    ----------
    path : Path
    """

    def __init__(self, path: Path) -> None:
        self.path = Path(path)

    about = property(lambda self: self.path / "batch.json")
    plan = property(lambda self: self.path / "plan.toml")
    progress = property(lambda self: self.path / "progress.jsonl")
    control = property(lambda self: self.path / "control")
    log = property(lambda self: self.path / "log.txt")
    report = property(lambda self: self.path / "report.json")
    results = property(lambda self: self.path / "results.jsonl")
    _lock = property(lambda self: self.path / "lock")

    @property
    def exists(self) -> bool:
        """Whether there is a batch."""
        return bool(self.about.is_file())

    @property
    def live(self) -> bool:
        """Whether a process is at it."""
        return is_locked(self._lock)

    def result(self, kind: str, key: str, suffix: str) -> Path:
        """Where what a task makes is kept: in 256 folders, so that none gets too long."""
        return self.path / kind / key[:2] / f"{key}{suffix}"

    def prepare(self) -> None:
        """Make the folder, or take over one of a batch.

        Raises
        ------
        Sd2Error
            When it holds something else, or there is nowhere to make it.
        """
        ours = {"lock", self.log.name}
        if self.path.exists() and not self.exists:
            if not self.path.is_dir() or {one.name for one in self.path.iterdir()} - ours:
                raise Sd2Error(
                    f"{self.path} exists and is not the folder of a batch",
                    "a new folder, or one that `sd2 batch` made",
                    "Choose another `out` in the plan",
                )
        elif not self.path.absolute().parent.is_dir():
            raise Sd2Error(
                f"The folder {self.path.absolute().parent} does not exist",
                "an existing folder in which the batch's is made",
            )
        self.path.mkdir(exist_ok=True)

    def lock(self) -> FileLock:
        """Take the batch for this process.

        Raises
        ------
        Sd2Error
            When another process is at it.
        """
        lock = FileLock(self._lock)
        until_s = time.monotonic() + _PATIENCE_S
        while not lock.take():
            # Whoever looks whether the batch lives holds the file for an instant.
            if time.monotonic() < until_s:
                time.sleep(0.02)
                continue
            raise Sd2Error(
                f"A process is at work in {self.path} already",
                "one batch at a time in a folder",
                f"Look at it with `sd2 batch --status {self.path}`",
            )
        return lock

    def set_state(self, state: State, **about: Any) -> None:
        """Note how it stands, and that this process is at it."""
        content = {"format": FORMAT, "version": VERSION, **self._about_if_any(), **about}
        content |= {"state": state, "pid": os.getpid(), "made_by": f"SD² Studio {__version__}"}
        atomic_write_text(self.about, json.dumps(content, indent=2, ensure_ascii=False) + "\n")

    def stop(self) -> None:
        """Tell the process that is at it to stop; the same command goes on later.

        Raises
        ------
        Sd2Error
            When no process is at it.
        """
        if not self.live:
            raise Sd2Error(f"No process is at work in {self.path}", "a batch that runs")
        write_control(self.control, "stop")

    def status(self) -> BatchStatus:
        """How it stands; reads all of its progress.

        Raises
        ------
        Sd2Error
            When there is no batch, or its description is damaged.
        """
        about = self.read_about()
        state: State = about["state"]
        if state == "running" and not self.live:
            # It may have come to its end between the two looks.
            again: State = self.read_about()["state"]
            state = "died" if again == "running" else again
        return status_of(state, about, read_events(self.progress))

    def _about_if_any(self) -> dict[str, Any]:
        return self.read_about() if self.exists else {}

    def read_about(self) -> dict[str, Any]:
        """What its description says; of a run that died still that it runs.

        Raises
        ------
        Sd2Error
            When there is no batch, or the description is damaged.
        """
        try:
            about = json.loads(self.about.read_text(encoding="utf-8"))
        except FileNotFoundError:
            raise Sd2Error(
                f"{self.path} is no folder of a batch", "a folder that `sd2 batch` made"
            ) from None
        except (OSError, ValueError) as error:
            raise Sd2Error(
                f"{self.about} cannot be read ({error})", "what `sd2 batch` wrote"
            ) from error
        known = isinstance(about, dict) and about.get("format") == FORMAT
        if not known or about.get("version") != VERSION or about.get("state") not in _WRITTEN:
            raise Sd2Error(
                f"{self.about} is no description of a batch", f"{FORMAT} version {VERSION}"
            )
        return dict(about)


_WRITTEN = ("running", "finished", "stopped", "failed")


def status_of(state: State, about: dict[str, Any], events: list[Event]) -> BatchStatus:
    """How a batch stands, from what it wrote; only the last run counts."""
    starts = [number for number, event in enumerate(events) if event["event"] == "start"]
    events = events[starts[-1] :] if starts else []
    last = last_of([one for one in events if one["event"] in ("progress", "end")], "end")
    last = last or last_of(events, "progress") or {}
    error = last.get("error")
    return BatchStatus(
        state=state,
        pid=about.get("pid"),
        started_unix_s=float(about.get("started_unix_s", 0.0)),
        total=dict(last.get("total", {})),
        done=dict(last.get("done", {})),
        there=dict(last.get("there", {})),
        failed=int(last.get("failed", 0)),
        waiting=int(last.get("waiting", 0)),
        running=int(last.get("running", 0)) if state == "running" else 0,
        workers=int(last.get("workers", 0)) if state == "running" else 0,
        elapsed_s=last.get("elapsed_s"),
        left_s=last.get("left_s") if state == "running" else None,
        error=str(Sd2Error(**error)) if isinstance(error, dict) else None,
    )
