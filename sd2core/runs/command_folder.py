"""``sd2`` commands in background processes, which may outlive the program that started them."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any

from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_write_text
from sd2core.files.texts import read_json
from sd2core.processes import INTERRUPTED, ONE_THREAD, ProcessId
from sd2core.runs.control import read_control, write_control
from sd2core.runs.folder import LIVE, RunFolder, State

COMMAND = (sys.executable, "-u", "-m", "sd2core.cli.background")
COMMAND_IN_FOLDER = (*COMMAND, "--folder")

_KEPT_BYTES = 16 * 1024
_STATES: dict[int | None, State] = {None: "starting", 0: "finished", INTERRUPTED: "stopped"}
_WINDOWS_FLAGS = getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0) | getattr(
    subprocess, "CREATE_NO_WINDOW", 0
)


def launch(
    command: Sequence[str], output: Path, environment: Mapping[str, str] | None = None
) -> ProcessId:
    """Start a program that outlives this process; what it prints goes to a file.

    Raises Sd2Error if it cannot be started.
    """
    with output.open("ab") as stream:
        try:
            process = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=stream,
                stderr=stream,
                env={**os.environ, "PYTHONIOENCODING": "utf-8", **(environment or {})},
                # No terminal that is closed takes it along.
                start_new_session=True,
                creationflags=_WINDOWS_FLAGS,
            )
        except OSError as error:
            stream.write(str(error).encode())
            raise Sd2Error(
                f"{command[0]} cannot be started", remedy="Look whether it is installed"
            ) from error
    # It is not waited for: it may outlive this process.
    process.returncode = 0
    return ProcessId.of(process.pid) or ProcessId(process.pid, time.time())


def last_output(output: Path) -> str:
    """End of what a program printed; empty where there is nothing."""
    try:
        with output.open("rb") as stream:
            stream.seek(max(stream.seek(0, os.SEEK_END) - _KEPT_BYTES, 0))
            return stream.read().decode("utf-8", "replace").strip()
    except OSError:
        return ""


class CommandFolder(RunFolder):
    """Folder of one ``sd2`` command that the window has started."""

    format = "sd2-command"
    file_name = "about.json"
    noun = "folder of a command"
    maker = "SD² Studio"
    look = "the window"

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self.progress = self.output  # which also has plain lines

    @property
    def output(self) -> Path:
        """File with what the process prints."""
        return self.path / "output.txt"

    @property
    def facts(self) -> dict[str, Any]:
        """Content of the description; empty where it cannot be read."""
        try:
            return self.about()
        except Sd2Error:
            return {}

    @property
    def taken(self) -> bool:
        """True while a process works in the folder or is about to."""
        if self.live:
            return True
        launched = self._read_launch("process")
        return launched is not None and launched.is_alive and self.facts.get("state") in LIVE

    @property
    def is_followed(self) -> bool:
        """True while the window that started or took up the command is open."""
        window = self._read_launch("window")
        return window is not None and window.is_alive

    @property
    def stop_wanted(self) -> bool:
        """True once the command was told to end."""
        return read_control(self.control) in ("stop", "cancel")

    def start(
        self,
        arguments: Sequence[str],
        about: Mapping[str, Any],
        command: Sequence[str] = COMMAND_IN_FOLDER,
        environment: Mapping[str, str] = ONE_THREAD,
    ) -> ProcessId:
        """Start an ``sd2`` command with these arguments, or start it again in the same folder.

        Parameters
        ----------
        arguments : sequence of str
            Those after ``sd2``.
        about : mapping
            Kept with it; must fit into JSON.
        command : sequence of str
            Program that is started, to which this folder and the arguments are added.
        environment : mapping of str to str
            Added to that of this process; by default matrices are multiplied on one thread, so that
            the window stays quick.

        Raises
        ------
        Sd2Error
            If it cannot be started.
        OSError
            If the folder cannot be made.
        """
        self.path.mkdir(parents=True, exist_ok=True)
        for path in (self.description, self.output, self._launched, *self._of_yesterday):
            path.unlink(missing_ok=True)
        write_control(self.control, "run")
        facts = {"started_unix_s": time.time(), "arguments": list(arguments), **about}
        self._describe("starting", **facts)
        process = launch([*command, str(self.path), *arguments], self.output, environment)
        self._note_launch(process)
        return process

    def about(self) -> dict[str, Any]:
        """Content of the description; that of an earlier version has its state elsewhere."""
        try:
            return super().about()
        except Sd2Error:
            end = self._of_yesterday[1]
            with suppress(Sd2Error, ValueError, KeyError, TypeError):
                about = read_json(self.description)
                if about["format"] == self.format and "state" not in about:
                    code = int(read_json(end)["code"]) if end.exists() else None
                    state = _STATES.get(code, "failed")
                    return {**about, "version": self.version, "state": state, "code": code}
            raise

    def discard(self) -> None:
        """Delete the folder with all that the command made."""
        shutil.rmtree(self.path, ignore_errors=True)

    def note_end(self, code: int) -> None:
        """Note the exit code of the command, which this process has run."""
        with suppress(OSError, Sd2Error):  # deleted meanwhile
            self.set_state(_STATES.get(code, "failed"), code=code)

    def take_up(self) -> None:
        """Note that this window follows the command."""
        process = self._read_launch("process") or self.process
        if process is not None:
            self._note_launch(process)

    # The process has a file of its own, so that neither overwrites what the other notes.
    def _note_launch(self, process: ProcessId) -> None:
        launched = {"process": asdict(process), "window": asdict(ProcessId.current())}
        atomic_write_text(self._launched, json.dumps(launched) + "\n")

    def _read_launch(self, part: str) -> ProcessId | None:
        try:
            return ProcessId(**read_json(self._launched)[part])
        except (Sd2Error, KeyError, TypeError):
            return None

    @property
    def _launched(self) -> Path:
        return self.path / "launched.json"

    @property
    def _of_yesterday(self) -> tuple[Path, Path]:
        return self.path / "stop", self.path / "end.json"
