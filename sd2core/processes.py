"""Identity, priority, environment and memory of processes, and their processor."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Self

ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
"""Environment in which a process multiplies matrices on one thread, whichever library does it."""

INTERRUPTED = 130
"""Exit code of a command that the user stopped."""

_M_TRIM_THRESHOLD, _M_MMAP_THRESHOLD, _M_ARENA_MAX = -1, -3, -8
_HEAPS = 2
_LARGE_BYTES = 8 << 20
"""Above a picture of full HD: to have each from the system would cost milliseconds a frame."""

_START_TOLERANCE_S = 2.0
"""The start of a process is told by the system's clock, which may be set meanwhile."""


def end_beside(process: subprocess.Popen[Any], patience_s: float) -> None:
    """End a process that works until its input ends: by that, or where it goes on, by a kill."""
    if process.stdin is not None:
        with suppress(OSError):  # it has ended already
            process.stdin.close()
    try:
        process.wait(patience_s)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


@dataclass(frozen=True)
class ProcessId:
    """Number and start time of a process: a number alone is given to another process later."""

    pid: int
    started_unix_s: float

    @classmethod
    def of(cls, pid: int) -> Self | None:
        """Process that has this number now; None where there is none."""
        import psutil

        try:
            return cls(pid, psutil.Process(pid).create_time())
        except psutil.Error:
            return None

    @classmethod
    def current(cls) -> Self:
        """Identity of the calling process."""
        process = cls.of(os.getpid())
        assert process is not None
        return process

    @property
    def is_alive(self) -> bool:
        """True until the process has ended."""
        import psutil

        if not self.is_same(self.of(self.pid)):
            return False
        try:
            if psutil.Process(self.pid).status() != psutil.STATUS_ZOMBIE:
                return True
        except psutil.Error:
            return False
        # A child that has ended keeps its number until its parent asks for its exit code. There is
        # none while a thread of it still ends, which keeps its locks.
        with suppress(ChildProcessError):
            return os.waitpid(self.pid, os.WNOHANG)[0] == 0
        return False

    def is_same(self, other: ProcessId | None) -> bool:
        """True if both are one process."""
        return (
            other is not None
            and self.pid == other.pid
            and abs(self.started_unix_s - other.started_unix_s) < _START_TOLERANCE_S
        )

    def terminate(self, *, at_once: bool = False) -> None:
        """Ask the process to end, or end it at once; a process that reuses its number is spared."""
        if self.is_alive:
            kill = getattr(signal, "SIGKILL", signal.SIGTERM)
            with suppress(OSError):  # it has ended meanwhile
                os.kill(self.pid, kill if at_once else signal.SIGTERM)


def lower_priority(nice: int | None = None) -> None:
    """Let other programs go first; where the system refuses, the priority stays.

    ``nice`` is 0 to 19; by default 10 more than now. Windows knows one step below the
    normal priority.
    """
    import psutil

    process = psutil.Process()
    with suppress(psutil.Error, OSError):
        if sys.platform == "win32":
            if nice != 0:
                process.nice(psutil.BELOW_NORMAL_PRIORITY_CLASS)
            return
        now = int(process.nice())
        process.nice(min(now + 10, 19) if nice is None else max(nice, now))


def keep_little_free_memory() -> None:
    """Keep the GNU C library from holding much freed memory; call it before threads are there.

    By default threads get up to eight heaps per core, which large arrays are taken from as well;
    what is free in them stays with the process (decision 63). Other C libraries are left alone.
    """
    import ctypes

    with suppress(AttributeError, OSError, TypeError):
        mallopt = ctypes.CDLL(None).mallopt
        mallopt(_M_ARENA_MAX, _HEAPS)
        mallopt(_M_MMAP_THRESHOLD, _LARGE_BYTES)
        mallopt(_M_TRIM_THRESHOLD, 2 * _LARGE_BYTES)


def return_free_memory() -> None:
    """Give freed memory in the GNU C library's heaps back to the system; some milliseconds."""
    import ctypes

    with suppress(AttributeError, OSError, TypeError):
        ctypes.CDLL(None).malloc_trim(0)


def end_with_parent() -> None:
    """End this process when the one that started it is gone, however that ended.

    A worker whose parent is killed outright would wait for work for ever. Call it first
    in a worker; it returns at once.
    """
    # The window reads the constant above and starts no workers of this kind.
    import multiprocessing.connection

    parent = multiprocessing.parent_process()
    assert parent is not None

    def watch() -> None:
        multiprocessing.connection.wait([parent.sentinel])
        os._exit(1)

    threading.Thread(target=watch, name="sd2-parent", daemon=True).start()


def processor_name() -> str:
    """Name of this machine's processor."""
    import platform

    with suppress(OSError), open("/proc/cpuinfo", encoding="utf-8", errors="replace") as stream:
        for line in stream:
            name, _, value = line.partition(":")
            if name.strip() == "model name":
                return value.strip()
    return platform.processor() or platform.machine()
