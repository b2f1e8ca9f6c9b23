"""The folder of a command that runs beside the window: what it was told, said, and came to."""

from __future__ import annotations

import json
import os
import shutil
import sys
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from sd2app.background.detached import last_words, launch
from sd2core.files.atomic import atomic_write_text
from sd2core.files.lock import FileLock, is_locked
from sd2core.processes import ONE_THREAD
from sd2core.runs.progress import ProgressTail

COMMAND = (sys.executable, "-u", "-m", "sd2app.background.run_in_folder")

_ABOUT, _OUTPUT, _LOCK, _STOP, _END = "about.json", "output.txt", "lock", "stop", "end.json"
_FORMAT = "sd2-command"


class CommandFolder:
    """One command on disk.

    Parameters
    ----------
    path : Path
    """

    def __init__(self, path: Path) -> None:
        self.path = Path(path)

    # --- what is known --------------------------------------------------------------------

    @property
    def exists(self) -> bool:
        """Whether there is one."""
        return (self.path / _ABOUT).is_file()

    @property
    def live(self) -> bool:
        """Whether its process is there."""
        return is_locked(self.path / _LOCK)

    @property
    def stop_wanted(self) -> bool:
        """Whether somebody told it to stop."""
        return (self.path / _STOP).exists()

    @property
    def code(self) -> int | None:
        """Exit code; None while it runs, and where it was killed."""
        try:
            return int(json.loads((self.path / _END).read_text("utf-8"))["code"])
        except (OSError, ValueError, KeyError, TypeError):
            return None

    @property
    def about(self) -> dict[str, Any]:
        """What it was started as; empty where that cannot be read."""
        try:
            about = json.loads((self.path / _ABOUT).read_text("utf-8"))
        except (OSError, ValueError):
            return {}
        return dict(about) if isinstance(about, dict) and about.get("format") == _FORMAT else {}

    @property
    def words(self) -> str:
        """The last that it said that is no line for programs."""
        lines = last_words(self.path / _OUTPUT).splitlines()
        return "\n".join(line for line in lines if not line.startswith("{"))

    def lines(self) -> ProgressTail:
        """What it says for programs, from the beginning."""
        return ProgressTail(self.path / _OUTPUT)

    # --- requests -------------------------------------------------------------------------

    def start(
        self,
        arguments: Sequence[str],
        about: Mapping[str, Any],
        command: Sequence[str] = COMMAND,
        environment: Mapping[str, str] = ONE_THREAD,
    ) -> int:
        """Start it, or start it again in the same folder; returns its process number.

        Parameters
        ----------
        arguments : sequence of str
            Of ``sd2``.
        about : mapping
            To be known of it; fits into JSON.
        command : sequence of str
            What runs it.
        environment : mapping
            In addition to what this process has. By default it gets by with one processor:
            what moves on the screen comes first.

        Raises
        ------
        Sd2Error
            When it cannot be started.
        OSError
            When the folder cannot be made.
        """
        self.path.mkdir(parents=True, exist_ok=True)
        for name in (_STOP, _END, _OUTPUT):
            (self.path / name).unlink(missing_ok=True)
        told = {
            "format": _FORMAT,
            "started_unix_s": time.time(),
            "arguments": list(arguments),
            **about,
        }
        atomic_write_text(self.path / _ABOUT, json.dumps(told, indent=1) + "\n")
        words = [*command, str(self.path), *arguments]
        return launch(words, self.path / _OUTPUT, environment)

    def stop(self) -> None:
        """Tell it to stop, as Ctrl-C does."""
        (self.path / _STOP).touch()

    def delete(self) -> None:
        """Delete it with all that it made."""
        shutil.rmtree(self.path, ignore_errors=True)

    # --- of the process itself ------------------------------------------------------------

    def lock(self) -> FileLock:
        """Held for as long as the process lives."""
        return FileLock(self.path / _LOCK)

    def note_end(self, code: int) -> None:
        """Note how it ended."""
        with suppress(OSError):  # deleted meanwhile
            atomic_write_text(
                self.path / _END, json.dumps({"code": code, "pid": os.getpid()}) + "\n"
            )


def folders_in(place: Path) -> list[CommandFolder]:
    """The commands in a folder, the newest first."""
    if not place.is_dir():
        return []
    found = [CommandFolder(path) for path in place.iterdir() if path.is_dir()]
    known = [one for one in found if one.exists]
    return sorted(known, key=lambda one: one.about.get("started_unix_s", 0.0), reverse=True)
