"""Workers do not outlive the process that started them, nor free memory its use."""

from __future__ import annotations

import os
import platform
import signal
import subprocess
import sys
import time

import pytest

from sd2core.files.lock import is_locked
from sd2core.processes import ProcessId

PARENT = """
import multiprocessing, os, sys, time
from sd2core.processes import end_with_parent

def work(ready):
    end_with_parent()
    ready.put(os.getpid())
    time.sleep(600)

if __name__ == "__main__":
    context = multiprocessing.get_context("spawn")
    ready = context.Queue()
    context.Process(target=work, args=(ready,)).start()
    print(ready.get(), flush=True)
    time.sleep(600)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="looks for the process as POSIX does")
def test_a_worker_ends_when_its_parent_is_killed(tmp_path) -> None:
    script = tmp_path / "parent.py"
    script.write_text(PARENT)
    parent = subprocess.Popen([sys.executable, str(script)], stdout=subprocess.PIPE, text=True)
    assert parent.stdout is not None
    worker = int(parent.stdout.readline())
    assert _lives(worker)
    parent.send_signal(signal.SIGKILL)
    parent.wait()
    parent.stdout.close()
    deadline_s = time.monotonic() + 30.0
    while _lives(worker) and time.monotonic() < deadline_s:
        time.sleep(0.05)
    try:
        assert not _lives(worker)
    finally:
        if _lives(worker):
            os.kill(worker, signal.SIGKILL)


def _lives(process: int) -> bool:
    """Whether it runs; one that ended but that nobody has asked for does not."""
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    try:
        with open(f"/proc/{process}/stat") as stream:
            return stream.read().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return True


def test_a_process_that_ended_is_told_from_one_with_its_number() -> None:
    process = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    ours = ProcessId.of(process.pid)
    assert ours is not None
    assert ours.is_alive
    # The same number, of a process that started an hour before.
    earlier = ProcessId(process.pid, ours.started_unix_s - 3600.0)
    assert not earlier.is_alive
    earlier.terminate(at_once=True)
    assert ours.is_alive
    ours.terminate(at_once=True)
    process.communicate()
    assert not ours.is_alive
    assert not ours.is_same(ProcessId.of(process.pid))


@pytest.mark.skipif(sys.platform == "win32", reason="nothing lingers there")
def test_a_child_that_nobody_waits_for_is_not_alive() -> None:
    process = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    ours = ProcessId.of(process.pid)
    assert ours is not None
    assert process.stdin is not None
    process.stdin.close()
    until_s = time.monotonic() + 30.0
    while ours.is_alive and time.monotonic() < until_s:
        time.sleep(0.02)
    assert not ours.is_alive
    process.returncode = 0  # its exit code was taken by then


@pytest.mark.skipif(sys.platform == "win32", reason="niceness is a Unix notion")
def test_the_background_gives_way() -> None:
    program = "from sd2core.processes import lower_priority"
    script = f"import os; {program}; lower_priority(); print(os.nice(0))"
    said = subprocess.run([sys.executable, "-c", script], capture_output=True, check=True).stdout
    assert int(said) == min(os.nice(0) + 10, 19)


HOLDER = """
import sys, threading, time
from pathlib import Path
from sd2core.files.lock import FileLock

lock = FileLock(Path(sys.argv[1]))
assert lock.take()
for _ in range(200):
    threading.Thread(target=time.sleep, args=(600,), daemon=True).start()
print("held", flush=True)
time.sleep(600)
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="there threads end with their process")
def test_a_process_that_is_gone_holds_no_lock(tmp_path) -> None:
    """Its first thread is gone before the others, which still hold what it had open."""
    for _ in range(5):
        words = [sys.executable, "-c", HOLDER, str(tmp_path / "lock")]
        with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as started:
            assert started.stdout is not None
            assert started.stdout.readline() == "held\n"
            process = ProcessId.of(started.pid)
            assert process is not None
            process.terminate(at_once=True)
            while process.is_alive:
                pass
            assert not is_locked(tmp_path / "lock")
            started.returncode = -signal.SIGKILL  # it has been asked for above


USE = """
import ctypes, sys, threading
import numpy as np
import psutil
from sd2core.processes import keep_little_free_memory

if sys.argv[1] == "little":
    keep_little_free_memory()

def resident_mb():
    return psutil.Process().memory_info().rss / 1e6

def work(kept, together):
    for _ in range(5):
        large = np.ones(20_000_000, np.uint8)
        kept.append(bytes(200_000))  # between two large ones, as what a window keeps is
    del large
    together.wait()

kept, together = [], threading.Barrier(9)
np.ones(30_000_000, np.uint8)
before_mb = resident_mb()
threads = [threading.Thread(target=work, args=(kept, together)) for _ in range(8)]
for thread in threads:
    thread.start()
together.wait()
print(resident_mb() - before_mb - sum(map(len, kept)) / 1e6)
"""


@pytest.mark.slow
@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="of the GNU C library")
def test_memory_that_threads_have_freed_goes_back_to_the_system() -> None:
    def left_mb(wish: str) -> float:
        run = subprocess.run(
            [sys.executable, "-c", USE, wish], capture_output=True, text=True, check=True
        )
        return float(run.stdout)

    assert left_mb("little") < 30 < 60 < left_mb("much")


FREED = """
import psutil
from sd2core.processes import return_free_memory

def resident_mb():
    return psutil.Process().memory_info().rss / 1e6

kept = [bytes(2000) for _ in range(50_000)]
del kept[:-1]  # the last one lies above what is free
before_mb = resident_mb()
return_free_memory()
print(before_mb - resident_mb())
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="of the GNU C library")
def test_freed_memory_below_what_is_kept_goes_back_when_asked() -> None:
    run = subprocess.run([sys.executable, "-c", FREED], capture_output=True, text=True, check=True)
    assert float(run.stdout) > 50
