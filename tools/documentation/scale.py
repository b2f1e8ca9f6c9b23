"""Makes ``scale.md``: ``make scale``, about ten minutes on two idle cores.

Every figure is measured when this runs; what a million recordings need follows from them.
"""

from __future__ import annotations

import itertools
import statistics
import sys
import tempfile
import timeit
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from sd2core.batch.denoising import denoise
from sd2core.batch.folder import BatchFolder
from sd2core.batch.inputs import find_origins, glance, mesh_input_of
from sd2core.batch.plan import BatchPlan
from sd2core.batch.plan_file import plan_from_text
from sd2core.batch.synthesis import Choosing, synthesise
from sd2core.batch.task_graph import TaskGraph
from sd2core.files.limits import size_bytes
from sd2core.files.tables import bytes_text
from sd2core.io.mesh import load_mesh, save_mesh
from sd2core.numerics.compiled import warm_up
from sd2core.recording.recording import open_recording
from sd2core.sensor import VirtualSensor
from tools.documentation.measured import BENCHMARKS, SAMPLE, table, write_filled

sys.path.insert(0, str(BENCHMARKS))
from batches import (
    Compared,
    Memory,
    files_per_second,
    fit_of,
    memory,
    nothing_to_do,
    ten_times_the_tasks,
    two_against_one,
)
from long_fits import LongFit, long_fit, sample_landmarks

RECORDINGS, FRAMES, PLACES = 1_000_000, 1800, 8
"""Size of the estimated batch: recordings of a minute each at 30 frames/s."""

CHOSEN = "synthesise, 2 %"

_TIMED_FRAMES = (450, 120)

_MAP_FRAMES, _ROUNDS, _TENTH, _TENTH_PLACES = 600, 2, 10, 8
_MEMORY_MIN = (1.0, 12.0, 90.0)
_FIT_FRAMES, _LONG_FRAMES = (150, 750), (3600, 9000)


@dataclass(frozen=True)
class Cost:
    """Cost of one step, on one process."""

    step: str
    frame_s: float
    task_s: float
    frame_bytes: float
    task_bytes: float

    def seconds(self, frames: int) -> float:
        """Cost of one task."""
        return self.task_s + frames * self.frame_s

    def bytes(self, frames: int) -> float:
        """That one task writes."""
        return self.task_bytes + frames * self.frame_bytes


@dataclass(frozen=True)
class Fitted:
    """A fit to so many frames: processor seconds, the most memory, and what was written."""

    frames: int
    seconds: float
    peak_mb: float
    bytes: int


def main() -> None:
    """Measure, and write the page."""
    warm_up()
    with tempfile.TemporaryDirectory(prefix="sd2-scale-") as name:
        write_filled("scale.md", **_measured(Path(name)))


def _measured(root: Path) -> dict[str, object]:
    """Tables and figures of the page."""

    def folder(what: str) -> Path:
        print(what, file=sys.stderr, flush=True)
        made = root / what.replace(" ", "-")
        made.mkdir()
        return made

    two = two_against_one(folder("two processes"), 4, 55, _ROUNDS, _MAP_FRAMES)
    ten = ten_times_the_tasks(folder("ten times the tasks"), _TENTH, _TENTH_PLACES, _ROUNDS)
    there_s = nothing_to_do(folder("nothing to do"), 10 * _TENTH, _TENTH_PLACES)
    place = folder("memory")
    used = [memory(place, minutes, 1, 1229, "facing") for minutes in _MEMORY_MIN]
    used.append(memory(place, _MEMORY_MIN[0], 20, 1229, "facing"))
    used.append(memory(place, _MEMORY_MIN[0], 1, 13348, ""))
    fits = _fits(folder("fits"))
    long = _long_fits(folder("long fits"))
    costs = _costs(folder("costs"), fits[-1])
    files_per_s = files_per_second(folder("files"))[0]
    own_s = statistics.median(ten.own_s) / ten.tasks
    return {
        "processes": _processes(two, ten, there_s),
        "memory": _memory(used),
        "fits": _fit_memory(fits, long),
        "recordings": RECORDINGS,
        "frames": FRAMES,
        "places": PLACES,
        "together": two.ratio / 2,
        **_million(costs, own_s, files_per_s),
    }


def _processes(two: Compared, ten: Compared, there_s: float) -> str:
    rows = [["what", "measured", "wanted"]]
    what = f"{two.tasks} maps of 5,000 vertices and {_MAP_FRAMES} frames: two processes against one"
    rows.append([what, f"{two.ratio:.2f} times as fast", "≥ 1.8"])
    what = f"{ten.tasks} quick maps against a tenth of them"
    rows.append([what, f"{ten.ratio:.2f} times the time", "≤ 10.5"])
    rows.append(["a map that is there already", f"{1e3 * there_s:.2f} ms", ""])
    return table(rows)


def _memory(used: list[Memory]) -> str:
    rows = [["recordings", "vertices, visibility", "maps", "denoised, exported"]]
    for one in used:
        what = f"{one.recordings} × {one.minutes:g} min", f"{one.vertices:,}, {one.how or 'exact'}"
        peaks_mb = one.peak_mb["synthesise"], max(one.peak_mb.values())
        rows.append([*what, *(f"{peak_mb:.0f}" for peak_mb in peaks_mb)])
    return table(rows, names=2)


def _fit_memory(fits: list[Fitted], long: list[LongFit]) -> str:
    """Real fits, and long ones whose landmarks are there already."""
    sizes = ", ".join(f"{one.peak_mb:.0f} MB with {one.frames:,} frames" for one in fits)
    few, many = (max(one.peak_mb.values()) for one in (long[0], long[-1]))
    each_mb = (many - few) / (long[-1].frames - long[0].frames)
    reached = ""
    if each_mb > 0:
        hours = (long[-1].frames + (1000 - many) / each_mb) / (30 * 3600)
        reached = f": 1 GB would be reached with {hours:.1f} hours of video at 30 frames/s"
    return (
        f"A fit of the sample's video takes {sizes}; of landmarks that are there already,"
        f" {few:.0f} MB with {long[0].frames:,} and {many:.0f} MB with {long[-1].frames:,}"
        f"{reached}."
    )


def _million(costs: list[Cost], own_s: float, files_per_s: float) -> dict[str, object]:
    """Tables and figures of the estimated batch."""
    by_step = {one.step: one for one in costs}
    count = {"fit": RECORDINGS, "synthesise": RECORDINGS * PLACES, "denoise": RECORDINGS * PLACES}
    seconds = {step: tasks * by_step[step].seconds(FRAMES) for step, tasks in count.items()}
    size = {step: tasks * by_step[step].bytes(FRAMES) for step, tasks in count.items()}
    tasks, total_s = RECORDINGS + sum(count.values()), sum(seconds.values())
    # What each part lets through, in cores that it keeps at work.
    full = {
        "the process that schedules": total_s / (tasks * own_s),
        "a file system that writes no faster than the disk here": total_s / (tasks / files_per_s),
    }
    first = min(full, key=lambda part: full[part])
    steps = [["step", "per frame", "hours of one core", "written"]]
    for step in count:
        frame = f"{1e3 * by_step[step].frame_s:.3f} ms"
        steps.append([step, frame, f"{seconds[step] / 3600:,.0f}", bytes_text(size[step])])
    steps.append(["all", "", f"{total_s / 3600:,.0f}", bytes_text(sum(size.values()))])
    machines = [["cores", "time", "load of the scheduler"]]
    for number in (64, 256, 1024, 4096):
        time_s = total_s / number
        machines.append([f"{number:,}", f"{time_s / 3600:,.0f} h", f"{tasks * own_s / time_s:.0%}"])
    return {
        "steps": table(steps),
        "chosen_ms": 1e3 * by_step[CHOSEN].frame_s,
        "machines": table(machines),
        "full": full[first],
        "first": first,
        "files_per_s": files_per_s,
    }


def _costs(folder: Path, fit: Fitted) -> list[Cost]:
    costs = [Cost("fit", fit.seconds / fit.frames, 0.0, fit.bytes / fit.frames, 0.0)]
    for title, how in (("synthesise", ""), (CHOSEN, "tolerance = 0.02")):
        text = (
            f'out = "{folder / "made"}"\n[recordings]\nfiles = ["{SAMPLE}"]\n'
            f"[synthesise]\n{how}\n[denoise]\n"
        )
        made, denoised = _costs_of_maps(plan_from_text(text, folder), folder / title, title)
        costs += [made] if how else [made, denoised]
    return costs


def _costs_of_maps(plan: BatchPlan, folder: Path, title: str) -> tuple[Cost, Cost]:
    """Costs of a map and of denoising it, from many frames of a recording and from few."""
    folder.mkdir()
    origins = find_origins(plan.recordings, Path(plan.out))
    denoiser = TaskGraph(plan, BatchFolder(Path(plan.out)), origins).model
    assert denoiser is not None
    model, _ = denoiser
    inspection, section = glance(origins[0]), plan.synthesise
    mesh, counts = inspection.mesh, _TIMED_FRAMES
    assert mesh is not None
    assert section is not None
    chosen = Choosing(folder / "plan.json", (inspection.sensor,), mesh.frames)
    choosing = None if section.tolerance is None else chosen
    places = (VirtualSensor((1e-3 * number, 0.0, 0.0)) for number in itertools.count(1))
    whole, clips = load_mesh(mesh.path), {}
    for count in counts:
        clip = folder / f"{count}.zarr"
        save_mesh(whole.between(0, count), clip)
        clips[count] = mesh_input_of(clip, "")

    def made(count: int) -> Path:
        return folder / f"{count}.npz"

    def denoised(count: int) -> Path:
        return folder / f"denoised-{count}.npz"

    def make(count: int) -> None:
        # From another place each time: masks of a place are kept, and would cost nothing.
        synthesise(clips[count], next(places), section, choosing, [made(count)])

    def clean(count: int) -> None:
        denoise(made(count), model, denoised(count))

    for count in counts:  # what is opened and chosen once is not counted
        make(count)
        clean(count)
    return _cost(title, make, made), _cost("denoise", clean, denoised)


def _cost(title: str, work: Callable[[int], None], out: Callable[[int], Path]) -> Cost:
    """Cost per task and per frame."""
    long, short = _TIMED_FRAMES
    seconds = {count: min(timeit.repeat(lambda c=count: work(c), number=1, repeat=2))
               for count in _TIMED_FRAMES}  # fmt: skip
    sizes = {count: out(count).stat().st_size for count in _TIMED_FRAMES}
    frame_s, frame_bytes = (
        max((values[long] - values[short]) / (long - short), 0.0) for values in (seconds, sizes)
    )
    task_s = max(seconds[short] - frame_s * short, 0.0)
    return Cost(title, frame_s, task_s, frame_bytes, max(sizes[short] - frame_bytes * short, 0.0))


def _fits(folder: Path) -> list[Fitted]:
    """Fits of the sample's video."""
    video = open_recording(SAMPLE).video
    assert video is not None
    fits = []
    for count in _FIT_FRAMES:
        seconds, peak_mb = fit_of(video, count, folder)
        fits.append(Fitted(count, seconds, peak_mb, size_bytes(folder / f"{count}.zarr")))
    return fits


def _long_fits(folder: Path) -> list[LongFit]:
    track = sample_landmarks(folder)
    return [long_fit(track, count, folder) for count in _LONG_FRAMES]


if __name__ == "__main__":
    main()
