"""What batches cost: processes, tasks, memory, files."""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from itertools import cycle, islice
from pathlib import Path
from typing import Any

from peaks import peak_mb
from scaling import body

from sd2core.batch.folder import BatchFolder
from sd2core.batch.plan_file import plan_from_text
from sd2core.batch.pool import Pool, local_client
from sd2core.batch.run import BatchEnd, run_batch
from sd2core.files.atomic import atomic_write_text
from sd2core.io.mesh import save_mesh
from sd2core.io.video import open_video
from sd2core.io.video_writing import write_video
from sd2core.processes import ONE_THREAD

_PLAN = """
out = "{out}"
[recordings]
files = ["{files}"]
[placements]
kind = "positions"
positions_m = [{places}]
[synthesise]
{how}
"""


def save_bodies(folder: Path, count: int, vertices: int, frames: int) -> None:
    """Meshes of swaying ellipsoids, each of another size: none is like another."""
    folder.mkdir()
    for number in range(count):
        mesh = body(vertices, frames, 1.0 + 1e-5 * number)
        save_mesh(mesh, folder / f"{number:05d}.npz")


def run(
    folder: Path,
    files: str,
    places: int,
    how: str,
    client: Any,
    more: str = "",
    out: str | None = None,
) -> tuple[BatchEnd, float, float]:
    """One batch on processes that are there already; seconds that passed, and of this process."""
    where = ", ".join(f"[{0.01 * number}, 0, 0]" for number in range(places))
    out = out or tempfile.mkdtemp(prefix="out-", dir=folder)
    text = _PLAN.format(out=out, files=files, places=where, how=how) + more
    plan = plan_from_text(text, folder)
    pool = Pool(client, BatchFolder(Path(plan.out)), most_deaths=2)
    begun_s, own_s = time.perf_counter(), time.process_time()
    end = run_batch(plan, pool=nullcontext(pool))
    assert end.outcome == "finished"
    assert not end.failed
    return end, time.perf_counter() - begun_s, time.process_time() - own_s


@contextmanager
def processes(count: int, folder: Path) -> Iterator[Any]:
    """A client of so many warm workers on this machine; the scheduler is in this process."""
    with local_client(folder / "dask", count) as client:
        warm = folder / f"warm-{count}"
        save_bodies(warm, 2 * count, 100, 10)
        run(warm, "*.npz", 4, "", client)
        yield client


@dataclass(frozen=True)
class Compared:
    """The same work done in two ways, in turns.

    Parameters
    ----------
    tasks : int
        Of maps.
    one_s, other_s : list of float
        Per round.
    own_s : list of float
        Processor seconds of batch and scheduler in the second way.
    """

    tasks: int
    one_s: list[float]
    other_s: list[float]
    own_s: list[float]

    @property
    def ratio(self) -> float:
        """Median over the rounds of how many times the first takes what the second does."""
        return statistics.median(a / b for a, b in zip(self.one_s, self.other_s, strict=True))


def two_against_one(
    folder: Path, recordings: int, places: int, rounds: int, frames: int = 600
) -> Compared:
    """The same maps on one process and on two; of as many vertices as a fit gives."""
    save_bodies(folder / "bodies", recordings, 5000, frames)
    one_s, two_s, own_s = [], [], []
    with processes(1, folder) as one, processes(2, folder) as two:
        for _ in range(rounds):
            one_s.append(run(folder, "bodies/*.npz", places, "", one)[1])
            _, seconds, own = run(folder, "bodies/*.npz", places, "", two)
            two_s.append(seconds)
            own_s.append(own)
    return Compared(recordings * places, one_s, two_s, own_s)


def ten_times_the_tasks(folder: Path, recordings: int, places: int, rounds: int) -> Compared:
    """Ten times the recordings against those, on two processes; maps that cost little."""
    save_bodies(folder / "bodies", 10 * recordings, 300, 30)
    many_s, few_s, own_s = [], [], []
    with processes(2, folder) as client:
        for _ in range(rounds):
            few_s.append(run(folder, "bodies/0000[0-9].npz", places, _QUICK, client)[1])
            _, seconds, own = run(folder, "bodies/*.npz", places, _QUICK, client)
            many_s.append(seconds)
            own_s.append(own)
    return Compared(10 * recordings * places, many_s, few_s, own_s)


_QUICK = "visibility = 'facing'"


def nothing_to_do(folder: Path, recordings: int, places: int) -> float:
    """Seconds per task of a batch that finds everything made."""
    save_bodies(folder / "bodies", recordings, 300, 30)
    out = str(folder / "made")
    with processes(2, folder) as client:
        run(folder, "bodies/*.npz", places, _QUICK, client, out=out)
        _, seconds, _ = run(folder, "bodies/*.npz", places, _QUICK, client, out=out)
    return seconds / (recordings * places)


@dataclass(frozen=True)
class Memory:
    """The most memory that a worker had.

    Parameters
    ----------
    minutes : float
        Of every recording, at 30 frames/s.
    recordings, vertices : int
    how : str
        Visibility; empty: the preset's.
    peak_mb : dict of str to float
        After the last task of a step.
    """

    minutes: float
    recordings: int
    vertices: int
    how: str
    peak_mb: dict[str, float]


def memory(folder: Path, minutes: float, recordings: int, vertices: int, how: str) -> Memory:
    """Synthesise, denoise and export in a process of its own, and see what it took."""
    bodies = folder / f"long-{minutes}-{recordings}-{vertices}"
    bodies.mkdir()
    for number in range(recordings):
        frames = round(minutes * 1800) + number
        save_mesh(body(vertices, frames), bodies / f"{number:05d}.zarr")
    told = subprocess.run(
        [sys.executable, __file__, str(bodies), f"visibility = '{how}'" if how else ""],
        env=os.environ | ONE_THREAD,
        capture_output=True,
        text=True,
        check=True,
    )
    return Memory(minutes, recordings, vertices, how, json.loads(told.stdout.splitlines()[-1]))


def _in_this_process(bodies: Path, how: str) -> None:
    """One worker's part of a batch; prints its peak after each step."""
    from sd2core.batch.pool import Ending
    from sd2core.batch.tasks import run_tasks

    out = bodies / "made"
    text = _PLAN.format(out=out, files="*.zarr", places="[0, 0, 0]", how=how)
    plan = plan_from_text(text + "[denoise]\n[export]\n", bodies)
    peaks: dict[str, float] = {}

    class Here:
        """Does what it is given at once."""

        def __init__(self) -> None:
            self._ended: list[Any] = []

        def workers(self) -> dict[str, int]:
            return {"here": 1}

        def submit(self, tasks: tuple[Any, ...], worker: str | None) -> None:
            outcomes = run_tasks(tasks, out)
            peaks[tasks[0].step] = peak_mb()
            self._ended.append(Ending(tasks, outcomes, "here"))

        def ended(self, timeout_s: float) -> list[Any]:
            ended, self._ended = self._ended, []
            return ended

    end = run_batch(plan, pool=nullcontext(Here()))
    assert not end.failed
    print(json.dumps(peaks))


def fit_of(video: Path, frames: int, folder: Path) -> tuple[float, float]:
    """Processor seconds and peak in MB of a fit to so many frames of a video, again and again.

    Raises
    ------
    subprocess.CalledProcessError
        When it fails: without the landmark models, for one.
    """
    made = folder / f"{frames}.mp4"
    with open_video(video) as reader:
        pictures = (reader.read(number) for number in islice(cycle(range(len(reader))), frames))
        write_video(made, pictures, 30, (reader.width, reader.height), preset="ultrafast")
    out = str(folder / f"{frames}.zarr")
    told = subprocess.run(
        [sys.executable, __file__, "fit", str(made), out],
        env=os.environ | ONE_THREAD,
        capture_output=True,
        text=True,
        check=True,
    )
    seconds, peak = json.loads(told.stdout.splitlines()[-1])
    return seconds, peak


def _fit_in_this_process(video: str, out: str) -> None:
    from sd2core.batch.fitting import fit_to_video

    begun_s = time.process_time()
    fit_to_video(video, {}, None, out)
    print(json.dumps([time.process_time() - begun_s, peak_mb()]))


def files_per_second(folder: Path, count: int = 400) -> tuple[float, float]:
    """Small files written in one step each, and looked at, per second."""
    text = "x" * 2000
    begun_s = time.perf_counter()
    for number in range(count):
        atomic_write_text(folder / f"{number}.json", text)
    written_s = time.perf_counter() - begun_s
    begun_s = time.perf_counter()
    for number in range(count):
        os.stat(folder / f"{number}.json")
    return count / written_s, count / (time.perf_counter() - begun_s)


if __name__ == "__main__":
    if sys.argv[1] == "fit":
        _fit_in_this_process(*sys.argv[2:])
    else:
        _in_this_process(Path(sys.argv[1]), sys.argv[2])
