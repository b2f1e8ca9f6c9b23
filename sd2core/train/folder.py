"""The folder of a run: what is in it, whether its process lives, how to steer it.

Needs no torch: the window and ``sd2 runs`` look at runs without loading it.
"""

from __future__ import annotations

import json
import os
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_write_text
from sd2core.files.lock import FileLock, is_locked
from sd2core.runs.control import Word, write_control
from sd2core.runs.progress import Event, last_of, read_events, standing
from sd2core.version import __version__

State = Literal[
    "starting", "running", "paused", "finished", "stopped", "cancelled", "failed", "died"
]
"""``died`` is never written: the file says that it runs, and its process is gone."""

LIVE: tuple[State, ...] = ("starting", "running", "paused")

FORMAT = "sd2-run"
VERSION = 1

RUN_NAME = "run.json"
CONFIG_NAME = "config.toml"
PROGRESS_NAME = "progress.jsonl"
CONTROL_NAME = "control"
BEST_NAME = "best.safetensors"
LAST_NAME = "last.safetensors"
LAST_RECORD_NAME = "last.json"
LOG_NAME = "log.txt"
LOCK_NAME = "lock"

_PATIENCE_S = 0.5

_OURS = (
    CONFIG_NAME, PROGRESS_NAME, CONTROL_NAME, BEST_NAME, LAST_NAME, LAST_RECORD_NAME, LOG_NAME,
    RUN_NAME, LOCK_NAME,
)  # fmt: skip


@dataclass(frozen=True)
class RunStatus:
    """How a run stands.

    Parameters
    ----------
    state : State
    model : str
        Name of its architecture.
    pid : int or None
        Of the process that trains or trained.
    started_unix_s : float
    epoch, epochs : int or None
        Epochs that are done, of so many; None where it is not known yet, or where the
        run is limited by time.
    minutes : float or None
        Training time that it may take, where that is its limit.
    elapsed_s, left_s : float or None
        Without pauses.
    validation_rmse, validation_mae_mps : float or None
        Of the best epoch.
    resumable : bool
        Whether ``sd2 train --resume`` can go on with it.
    has_model : bool
        Whether there is a best model to use.
    error : str or None
        Why it failed.
    """

    state: State
    model: str
    pid: int | None
    started_unix_s: float
    epoch: int | None
    epochs: int | None
    minutes: float | None
    elapsed_s: float | None
    left_s: float | None
    validation_rmse: float | None
    validation_mae_mps: float | None
    resumable: bool
    has_model: bool
    error: str | None


class RunFolder:
    """One run on disk.

    Parameters
    ----------
    path : Path
    """

    def __init__(self, path: Path) -> None:
        self.path = Path(path)

    config = property(lambda self: self.path / CONFIG_NAME)
    progress = property(lambda self: self.path / PROGRESS_NAME)
    control = property(lambda self: self.path / CONTROL_NAME)
    best = property(lambda self: self.path / BEST_NAME)
    last = property(lambda self: self.path / LAST_NAME)
    last_record = property(lambda self: self.path / LAST_RECORD_NAME)
    log = property(lambda self: self.path / LOG_NAME)

    @property
    def exists(self) -> bool:
        """Whether there is a run."""
        return (self.path / RUN_NAME).is_file()

    @property
    def live(self) -> bool:
        """Whether a process is at it."""
        return is_locked(self.path / LOCK_NAME)

    def lock(self) -> FileLock:
        """Take the run for this process.

        Raises
        ------
        Sd2Error
            When another process is at it.
        """
        lock = FileLock(self.path / LOCK_NAME)
        until_s = time.monotonic() + _PATIENCE_S
        while not lock.take():
            # Whoever looks whether the run lives holds the file for an instant.
            if time.monotonic() < until_s:
                time.sleep(0.02)
                continue
            raise Sd2Error(
                f"A process is training in {self.path} already",
                "one process per run",
                f"Look at it with `sd2 runs {self.path}`",
            )
        return lock

    def make(self) -> None:
        """Make the folder.

        Raises
        ------
        Sd2Error
            When there is something already, or nowhere to make it.
        """
        if self.path.exists() and not self._is_empty():
            what = "a run" if self.exists else "something that is not an empty folder"
            raise Sd2Error(
                f"{self.path} is {what} already",
                "a new folder for the run",
                "Choose another name"
                + (f", or go on with it: `sd2 train --resume {self.path}`" if self.exists else ""),
            )
        if not self.path.absolute().parent.is_dir():
            raise Sd2Error(
                f"The folder {self.path.absolute().parent} does not exist",
                "an existing folder in which the run is made",
            )
        self.path.mkdir(exist_ok=True)

    def create(self, model: str) -> None:
        """Make the folder and the description of the run.

        Raises
        ------
        Sd2Error
            As :meth:`make`.
        """
        self.make()
        self._write({"model": model, "started_unix_s": time.time(), "state": "starting"})

    def set_state(self, state: State) -> None:
        """Note how it stands, and that this process is at it."""
        about = self._about()
        self._write({**about, "state": state})

    def tell(self, word: Word) -> None:
        """Tell the process what to do.

        Raises
        ------
        Sd2Error
            When there is no run, or no process is at it.
        """
        state = self.state()
        if state not in LIVE:
            raise Sd2Error(
                f"The run {self.path} has {_WORDS[state]}",
                "a run whose process is there",
                f"Go on with it: `sd2 train --resume {self.path}`"
                if state in ("stopped", "died") else "",
            )  # fmt: skip
        write_control(self.control, word)

    def state(self) -> State:
        """How it stands, in one word.

        Raises
        ------
        Sd2Error
            When there is no run, or its description is damaged.
        """
        return self._state_and_about()[0]

    def status(self) -> RunStatus:
        """How it stands; reads all of its progress.

        Raises
        ------
        Sd2Error
            When there is no run, or its description is damaged.
        """
        state, about = self._state_and_about()
        return _status(self, state, about, standing(read_events(self.progress)))

    def discard(self) -> None:
        """Delete what the run made, and the folder when nothing else is in it."""
        for name in _OURS:
            (self.path / name).unlink(missing_ok=True)
        # What a write left that was killed.
        for rest in self.path.glob(".sd2-*.tmp"):
            rest.unlink(missing_ok=True)
        if self.path.is_dir() and not any(self.path.iterdir()):
            self.path.rmdir()

    def _is_empty(self) -> bool:
        """Whether it is a folder in which nothing is but the lock of who is about to use it."""
        return self.path.is_dir() and all(one.name == LOCK_NAME for one in self.path.iterdir())

    def _state_and_about(self) -> tuple[State, dict[str, Any]]:
        about = self._about()
        state: State = about["state"]
        if state in LIVE and not self.live:
            # It may have come to its end between the two looks.
            about = self._about()
            state = about["state"] if about["state"] not in LIVE else "died"
        return state, about

    def _about(self) -> dict[str, Any]:
        path = self.path / RUN_NAME
        try:
            about = json.loads(path.read_text(encoding="utf-8"))
        except FileNotFoundError:
            raise Sd2Error(
                f"{self.path} is no run", f"a folder with {RUN_NAME}, made by `sd2 train`"
            ) from None
        except (OSError, ValueError) as error:
            raise Sd2Error(f"{path} cannot be read ({error})", "what `sd2 train` wrote") from error
        known = isinstance(about, dict) and about.get("format") == FORMAT
        if not known or about.get("version") != VERSION or about.get("state") not in _WORDS:
            raise Sd2Error(f"{path} is no description of a run", f"{FORMAT} version {VERSION}")
        return dict(about)

    def _write(self, about: dict[str, Any]) -> None:
        content = {"format": FORMAT, "version": VERSION, **about}
        content |= {"pid": os.getpid(), "made_by": f"SD² Studio {__version__}"}
        atomic_write_text(
            self.path / RUN_NAME, json.dumps(content, indent=2, ensure_ascii=False) + "\n"
        )


def runs_in(folder: Path) -> list[RunFolder]:
    """The runs in a folder, by their names; the folder itself when it is one.

    Raises
    ------
    Sd2Error
        When there is no such folder.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise Sd2Error(f"The folder {folder} does not exist", "a run, or a folder of runs")
    if RunFolder(folder).exists:
        return [RunFolder(folder)]
    runs = [RunFolder(path) for path in sorted(folder.iterdir()) if path.is_dir()]
    return [run for run in runs if run.exists]


_WORDS: dict[State, str] = {
    "starting": "not begun yet",
    "running": "not ended",
    "paused": "not ended",
    "finished": "finished",
    "stopped": "been stopped",
    "cancelled": "been cancelled",
    "failed": "failed",
    "died": "lost its process",
}


def _status(
    folder: RunFolder, state: State, about: dict[str, Any], events: list[Event]
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
