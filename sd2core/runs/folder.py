"""Folder through which a run is followed and steered: its state, its process, its progress.

One process at a time works in it. It holds the lock for as long as it lives, so whoever looks
tells a run that died from one that goes on. ``docs/formats.md`` says what the files hold.
Needs neither Qt, Dask nor torch.
"""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, ClassVar, Literal

from pydantic import ValidationError

from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_write_json
from sd2core.files.lock import FileLock, is_locked
from sd2core.files.texts import first_fault, read_json
from sd2core.processes import ProcessId
from sd2core.runs.control import Command, write_control
from sd2core.version import __version__

State = Literal[
    "starting", "running", "paused", "finished", "stopped", "cancelled", "failed", "died"
]
"""``died`` is never written: the file says that it runs, and its process is gone."""

LIVE: tuple[State, ...] = ("starting", "running", "paused")
ENDED: dict[State, str] = {
    "finished": "finished",
    "stopped": "been stopped",
    "cancelled": "been cancelled",
    "failed": "failed",
    "died": "lost its process",
}
"""States of a run without a process, as ``it has …``."""

_PATIENCE_S = 2.0


class RunFolder:
    """Folder of one run on disk, which may not be there yet; subclasses name its kind."""

    format: ClassVar[str]
    file_name: ClassVar[str]  # of the description
    noun: ClassVar[str]
    maker: ClassVar[str]  # the command that makes such a folder
    working: ClassVar[str] = "at work"
    look: ClassVar[str]  # the command that shows it
    version: ClassVar[int] = 1

    def __init__(self, path: Path) -> None:
        self.path = Path(path)
        self.description = self.path / self.file_name  # state of the run and its process
        self.progress = self.path / "progress.jsonl"  # JSON lines
        self.control = self.path / "control"  # the word that the process obeys
        self.log = self.path / "log.txt"  # for people
        self._lock = self.path / "lock"

    @property
    def output(self) -> Path:
        """File with what the process prints; beside the folder, which may not be made yet."""
        return self.path.with_name(f".{self.path.name}.out")

    @property
    def exists(self) -> bool:
        """True if there is a run."""
        return self.description.is_file()

    @property
    def live(self) -> bool:
        """True while a process works in the folder."""
        return is_locked(self._lock)

    @property
    def taken(self) -> bool:
        """True while a process works in the folder, or is about to where that is known."""
        return self.live

    @property
    def process(self) -> ProcessId | None:
        """Process that works or worked in it; None where yesterday's version noted no start."""
        try:
            about = self.about()
            return ProcessId(int(about["pid"]), float(about["process_started_unix_s"]))
        except (Sd2Error, KeyError, TypeError, ValueError, OverflowError):
            return None

    def lock(self) -> FileLock:
        """Take the run for this process.

        Raises Sd2Error when another process works in it.
        """
        lock = FileLock(self._lock)
        until_s = time.monotonic() + _PATIENCE_S
        while not lock.take():
            # Looking whether the run lives holds the file for an instant.
            if time.monotonic() < until_s:
                time.sleep(0.02)
                continue
            raise Sd2Error(
                f"A process is {self.working} in {self.path} already",
                "one process at a time in a folder",
                f"Look at it with `{self.look} {self.path}`",
            )
        return lock

    def set_state(self, state: State, **about: Any) -> None:
        """Note the state, and that this process works on it."""
        process = ProcessId.current()
        self._describe(
            state,
            **about,
            pid=process.pid,
            process_started_unix_s=process.started_unix_s,
            made_by=f"SD² Studio {__version__}",
        )

    def state(self) -> State:
        """Current state.

        Raises Sd2Error when there is no run, or its description is damaged.
        """
        return self.state_and_about()[0]

    def state_and_about(self) -> tuple[State, dict[str, Any]]:
        """Current state, and all that the description says; raises as :meth:`state`."""
        about = self.about()
        if about["state"] in LIVE and not self.taken:
            # It may have ended between the two looks.
            about = self.about()
            if about["state"] in LIVE:
                return "died", about
        return about["state"], about

    def about(self) -> dict[str, Any]:
        """Content of the description, which says of a run that died that it runs.

        Raises Sd2Error when there is no run, or its description is damaged.
        """
        path = self.description
        if not os.path.exists(path):
            raise Sd2Error(
                f"{self.path} is no {self.noun}",
                f"a folder with {self.file_name}, made by `{self.maker}`",
            )
        about = read_json(path, f"what `{self.maker}` wrote")
        known = isinstance(about, dict) and about.get("format") == self.format
        known = known and about.get("version") == self.version
        if not known or about.get("state") not in (*LIVE, *ENDED):
            raise Sd2Error(
                f"{path} does not describe a {self.noun}", f"{self.format} version {self.version}"
            )
        return dict(about)

    @contextmanager
    def refusing_damage(self) -> Iterator[None]:
        """Raise Sd2Error for what fails because values are of other types than were written."""
        try:
            yield
        except (TypeError, ValueError, KeyError, AttributeError, OverflowError) as error:
            reason = first_fault(error) if isinstance(error, ValidationError) else error
            raise Sd2Error(
                f"{self.description} or {self.progress.name} is damaged ({reason})",
                f"what `{self.maker}` wrote",
                "Copy the folder again",
            ) from error

    def tell(self, word: Command) -> None:
        """Tell the process what to do.

        Raises Sd2Error when there is no run, or no process works on it.
        """
        state = self.state()
        if state not in LIVE:
            raise Sd2Error(
                f"No process is at work in {self.path}: it has {ENDED[state]}",
                f"a {self.noun} whose process is there",
                self._how_to_resume(state),
            )
        write_control(self.control, word)

    def discard(self) -> None:
        """Delete what the run made; by default it is left to the user."""

    def _how_to_resume(self, state: State) -> str:
        return ""

    def _describe(self, state: State, **about: Any) -> None:
        before = self.about() if self.exists else {}
        content = {"format": self.format, "version": self.version, **before, **about}
        atomic_write_json(self.description, content | {"state": state})
