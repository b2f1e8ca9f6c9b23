"""A program that lives on when the window is closed."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path

from sd2core.errors import Sd2Error

_WINDOWS_FLAGS = getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0) | getattr(
    subprocess, "CREATE_NO_WINDOW", 0
)
_KEPT_BYTES = 16 * 1024


def start_detached(
    command: Sequence[str], output: Path, environment: Mapping[str, str] | None = None
) -> int | None:
    """Start it with a session of its own; None where it cannot be started.

    Parameters
    ----------
    command : sequence of str
        The program and its arguments.
    output : Path
        What it writes, to either stream, goes here.
    environment : mapping, optional
        In addition to what this process has.

    Returns
    -------
    int or None
        Its process number.
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
            return None
    # Nobody is going to wait for it: it may outlive this process.
    process.returncode = 0
    return process.pid


def launch(
    command: Sequence[str], output: Path, environment: Mapping[str, str] | None = None
) -> int:
    """Start it as :func:`start_detached` does, and give its process number.

    Raises
    ------
    Sd2Error
        When it cannot be started.
    """
    pid = start_detached(command, output, environment)
    if pid is None:
        raise Sd2Error(f"{command[0]} cannot be started", remedy="Look whether it is installed")
    return pid


def is_alive(pid: int) -> bool:
    """Whether there is a process of this number that has not ended."""
    if sys.platform == "win32":
        return _is_alive_on_windows(pid)
    # One that has ended keeps its number until its parent has asked how.
    with suppress(ChildProcessError):
        if os.waitpid(pid, os.WNOHANG)[0] == pid:
            return False
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True


def _is_alive_on_windows(pid: int) -> bool:
    import ctypes

    still_active, query = 259, 0x1000  # STILL_ACTIVE, PROCESS_QUERY_LIMITED_INFORMATION
    kernel = ctypes.windll.kernel32  # type: ignore[attr-defined,unused-ignore]
    handle = kernel.OpenProcess(query, False, pid)
    if not handle:
        return False
    code = ctypes.c_ulong()
    kernel.GetExitCodeProcess(handle, ctypes.byref(code))
    kernel.CloseHandle(handle)
    return code.value == still_active


def last_words(output: Path) -> str:
    """The end of what a program wrote; empty where there is nothing."""
    try:
        content = output.read_bytes()[-_KEPT_BYTES:]
    except OSError:
        return ""
    return content.decode("utf-8", "replace").strip()
