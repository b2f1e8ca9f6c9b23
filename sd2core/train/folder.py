"""Folder of a training run: its files and its status.

Needs no torch: the window and ``sd2 runs`` look at runs without loading it.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

from pydantic.dataclasses import dataclass

from sd2core.errors import Sd2Error
from sd2core.files.atomic import remove_leftovers
from sd2core.files.paths import make_folder
from sd2core.runs.folder import LIVE, RunFolder, State
from sd2core.runs.progress import Event, effective, last_of, read_events


@dataclass(frozen=True)
class RunStatus:
    """Current state of a run."""

    state: State
    model: str  # name of its architecture
    pid: int | None  # of the process that trains or trained
    started_unix_s: float
    epoch: int | None  # epochs that are done
    epochs: int | None  # None while unknown, or if the run is limited by time
    minutes: float | None  # limit of its training time, if there is one
    elapsed_s: float | None  # like left_s without pauses
    left_s: float | None
    validation_rmse: float | None  # of the best epoch
    validation_mae_mps: float | None
    resumable: bool  # by ``sd2 train --resume``
    has_model: bool  # a best model is there
    error: str | None  # reason of a failure


class TrainingFolder(RunFolder):
    """Folder of one training run."""

    format = "sd2-run"
    file_name = "run.json"
    noun = "run"
    maker = "sd2 train"
    working = "training"
    look = "sd2 runs"

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self.config = self.path / "config.toml"  # settings
        self.best = self.path / "best.safetensors"  # model of the best epoch
        self.last = self.path / "last.safetensors"  # checkpoint to resume from
        self.last_record = self.path / "last.json"  # description of the checkpoint

    def make(self) -> None:
        """Make the folder, with those above it.

        Raises Sd2Error if it exists with content, or lies in something that is no folder.
        """
        if self.path.exists() and not self._is_empty():
            what = "a run" if self.exists else "something that is not an empty folder"
            raise Sd2Error(
                f"{self.path} is {what} already",
                "a new folder for the run",
                "Choose another name"
                + (f", or go on with it: `sd2 train --resume {self.path}`" if self.exists else ""),
            )
        make_folder(self.path)

    def create(self, model: str) -> None:
        """Make the folder and the description of the run. Raises Sd2Error as :meth:`make`."""
        self.make()
        self.set_state("starting", model=model, started_unix_s=time.time())

    def status(self) -> RunStatus:
        """Current status, from all lines of progress.

        Raises Sd2Error if there is no run, or its description is damaged.
        """
        state, about = self.state_and_about()
        with self.refusing_damage():
            return _status(self, state, about, effective(read_events(self.progress)))

    def discard(self) -> None:
        """Delete what the run made, and the folder when nothing else is in it."""
        made = (self.config, self.best, self.last, self.last_record, self.progress, self.control)
        for path in (*made, self.log, self.description, self._lock):
            path.unlink(missing_ok=True)
        remove_leftovers(self.path)
        if self.path.is_dir() and not any(self.path.iterdir()):
            self.path.rmdir()

    def _is_empty(self) -> bool:
        """True if the folder holds nothing but a lock."""
        return self.path.is_dir() and all(one.name == "lock" for one in self.path.iterdir())

    def _how_to_resume(self, state: State) -> str:
        resumable = state in ("stopped", "died")
        return f"Go on with it: `sd2 train --resume {self.path}`" if resumable else ""


def runs_in(folder: Path) -> list[TrainingFolder]:
    """Return the runs in a folder by their names; the folder itself if it is one.

    Raises Sd2Error if there is no such folder.
    """
    folder = Path(folder)
    if not folder.is_dir():
        found = f"{folder} is a file" if folder.exists() else f"The folder {folder} does not exist"
        raise Sd2Error(found, "a run, or a folder of runs")
    if TrainingFolder(folder).exists:
        return [TrainingFolder(folder)]
    runs = [TrainingFolder(path) for path in sorted(folder.iterdir()) if path.is_dir()]
    return [run for run in runs if run.exists]


def _status(
    folder: TrainingFolder, state: State, about: dict[str, Any], events: list[Event]
) -> RunStatus:
    start = last_of(events, "start") or {}
    epoch = last_of(events, "epoch") or {}
    best = last_of([event for event in events if event.get("best")], "epoch") or {}
    end = last_of(events, "end") or {}
    newest = max(
        (event for event in events if event["event"] in ("step", "epoch")),
        key=lambda event: event.get("elapsed_s") or 0.0,
        default={},
    )
    error = end.get("error")
    return RunStatus(
        state=state,
        model=str(about.get("model", "")),
        pid=about.get("pid"),
        started_unix_s=float(about.get("started_unix_s", 0.0)),
        epoch=epoch.get("epoch"),
        epochs=start.get("epochs"),
        minutes=start.get("minutes"),
        elapsed_s=newest.get("elapsed_s"),
        left_s=newest.get("left_s") if state in LIVE else None,
        validation_rmse=best.get("validation_rmse"),
        validation_mae_mps=best.get("validation_mae_mps"),
        resumable=state in ("stopped", "died", "failed") and folder.last.exists(),
        has_model=folder.best.exists(),
        error=str(Sd2Error(**error)) if isinstance(error, dict) else None,
    )
