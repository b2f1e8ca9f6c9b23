"""A batch on a real scheduler with two worker processes, one of which is killed."""

from __future__ import annotations

import contextlib
import logging
import os
import platform
import re
import signal
import socket
import ssl
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from dask_processes import cluster
from moving_spheres import maps_in, save_spheres
from pools import in_this_process

from sd2core.batch import pool
from sd2core.batch.plan import BatchPlan
from sd2core.batch.plan_file import plan_from_text
from sd2core.batch.pool import local_client
from sd2core.batch.run import run_batch
from sd2core.batch.tasks import BEGUN

_PLAN = """
out = "{out}"
[recordings]
files = ["meshes/*.npz"]
[placements]
kind = "grid"
ranges_m = [2.2, 3, 4]
[synthesise]
"""


def _plan(folder: Path, out: str) -> BatchPlan:
    return plan_from_text(_PLAN.format(out=out), folder)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="stops and kills processes by signals")
def test_a_killed_worker_loses_its_current_task_only(tmp_path: Path) -> None:
    save_spheres(tmp_path / "meshes", 6, frames=200)
    run_batch(_plan(tmp_path, "calm"), pool=in_this_process(tmp_path / "calm"))
    expected = maps_in(tmp_path / "calm")
    assert len(expected) == 18

    out = tmp_path / "disturbed"
    said: list[dict[str, Any]] = []
    with cluster(tmp_path / "cluster", 2) as both:
        killer = _Killer(out, both.workers[0])
        killer.start()
        end = run_batch(_plan(tmp_path, "disturbed"), scheduler=both.address, watch=said.append)
        killer.join()
    assert killer.during is not None, "no worker was killed at work"
    assert (end.outcome, end.failed) == ("finished", 0)
    found = maps_in(out)
    assert found.keys() == expected.keys()
    for name, values in expected.items():
        np.testing.assert_array_equal(found[name], values)
    # What had been done by then is as it was then.
    assert killer.there
    for path, changed_ns in killer.there.items():
        assert path.stat().st_mtime_ns == changed_ns
    assert end.facts["done"]["synthesise"] == 18
    notes = [one["text"] for one in said if one["event"] == "note"]
    assert len(notes) == 1
    # Between its look and the kill the worker may have begun its next task.
    assert re.match("A worker died during (inspect|synthesise) of m", notes[0])


@pytest.mark.slow
def test_other_users_of_the_machine_cannot_connect_to_a_local_batch(tmp_path: Path) -> None:
    pytest.importorskip("cryptography")
    with local_client(tmp_path, 1) as client:
        assert client.submit(abs, -3).result(timeout=60) == 3
        (worker,) = client.scheduler_info()["workers"]
        for address in (client.scheduler.address, worker):
            assert address.startswith("tls://127.0.0.1:")
            # Somebody who asks for no certificate and shows none.
            stranger = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
            stranger.check_hostname, stranger.verify_mode = False, ssl.CERT_NONE
            with (
                socket.create_connection(("127.0.0.1", int(address.rsplit(":", 1)[1]))) as plain,
                pytest.raises(ssl.SSLError, match="CERTIFICATE_REQUIRED"),
                stranger.wrap_socket(plain) as line,
            ):
                line.recv(1)


def test_without_keys_a_local_batch_says_so(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    from distributed import Security

    def missing() -> None:
        raise ImportError("cryptography")

    monkeypatch.setattr(Security, "temporary", missing)
    monkeypatch.setattr(logging.getLogger("distributed"), "propagate", True)
    assert pool._security() is None
    assert "other users of this machine could connect" in caplog.text


class _Killer(threading.Thread):
    """Kills a worker in the middle of a task, when some have been done."""

    def __init__(self, out: Path, worker: subprocess.Popen[bytes]) -> None:
        super().__init__(daemon=True)
        self._out, self._worker = out, worker
        self.during: str | None = None
        self.there: dict[Path, int] = {}

    def run(self) -> None:
        process = f"{platform.node()} {self._worker.pid}"

        def at_work() -> Path | None:
            for marker in self._out.glob(f"{BEGUN}/task-*"):
                with contextlib.suppress(FileNotFoundError):
                    if process in marker.read_text().splitlines():
                        return marker
            return None

        until_s = time.monotonic() + 60
        while time.monotonic() < until_s:
            if at_work() and len(list(self._out.glob("synthetic/*/*.npz"))) >= 4:
                os.kill(self._worker.pid, signal.SIGSTOP)
                # It may have come to its end just before it was stopped.
                if (marker := at_work()) is not None:
                    self.during = marker.name
                    self.there = {
                        path: path.stat().st_mtime_ns
                        for path in self._out.glob("synthetic/*/*.npz")
                    }
                    self._worker.kill()
                    return
                os.kill(self._worker.pid, signal.SIGCONT)
            time.sleep(0.002)
