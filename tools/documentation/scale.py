"""Makes ``scale.md``: ``make scale``, about ten minutes on two idle cores.

Every figure is measured when this runs; what a million recordings need follows from them.
``--quick`` measures little, to see that it works.
"""

from __future__ import annotations

import argparse
import itertools
import statistics
import subprocess
import sys
import tempfile
import timeit
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from sd2core.accuracy.cache import this_machine
from sd2core.batch.denoising import denoise
from sd2core.batch.driver import AHEAD
from sd2core.batch.folder import BatchFolder
from sd2core.batch.inputs import find_origins, glance
from sd2core.batch.plan import BatchPlan
from sd2core.batch.plan_file import plan_from_text
from sd2core.batch.synthesis import LONGEST_FRAMES, Choosing, synthesise
from sd2core.batch.task_graph import TaskGraph
from sd2core.cli.batch import bytes_words
from sd2core.files.limits import size_bytes
from sd2core.files.resources import resource_path
from sd2core.numerics.compiled import warm_up
from sd2core.recording.recording import open_recording
from sd2core.sensor import VirtualSensor
from tools.documentation.places import BENCHMARKS, DOCS

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

_TIMED_FRAMES = (450, 120)

INTRODUCTION = """\
# Batches at scale

What `sd2 batch` costs, measured, and what a million recordings would need, reckoned from that.
Made by

```
make scale
```

on {machine}. How it works is [decision 39](decisions/0039-batches.md); what a plan
and its folder hold, [formats.md](formats.md#batches).
"""


LITTLE = """
**Measured in little (`--quick`), beside other work: these are not the final figures.**
"""


@dataclass(frozen=True)
class Sizes:
    """Amounts that are measured."""

    recordings: int
    places: int
    frames: int
    rounds: int
    tenth: int
    tenth_places: int
    minutes: tuple[float, ...]
    many: int
    fit_frames: tuple[int, ...]
    long_frames: tuple[int, ...]


FULL = Sizes(4, 55, 600, 2, 10, 8, (1.0, 12.0, 90.0), 20, (150, 750), (3600, 9000))
QUICK = Sizes(2, 5, 60, 1, 2, 3, (0.2, 0.5), 2, (20, 40), (60, 120))


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
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--out", type=Path, default=DOCS / "scale.md")
    options = parser.parse_args()
    sizes = QUICK if options.quick else FULL
    warm_up()
    with tempfile.TemporaryDirectory(prefix="sd2-scale-") as name:
        page = _page(Path(name), sizes)
    options.out.write_text(page, encoding="utf-8")


def _page(root: Path, sizes: Sizes) -> str:
    def folder(what: str) -> Path:
        _say(what)
        made = root / what.replace(" ", "-")
        made.mkdir()
        return made

    two = two_against_one(
        folder("two processes"), sizes.recordings, sizes.places, sizes.rounds, sizes.frames
    )
    ten = ten_times_the_tasks(
        folder("ten times the tasks"), sizes.tenth, sizes.tenth_places, sizes.rounds
    )
    there_s = nothing_to_do(folder("nothing to do"), 10 * sizes.tenth, sizes.tenth_places)
    place = folder("memory")
    used = [memory(place, minutes, 1, 1229, "facing") for minutes in sizes.minutes]
    used.append(memory(place, sizes.minutes[0], sizes.many, 1229, "facing"))
    used.append(memory(place, sizes.minutes[0], 1, 13348, ""))
    fits = _fits(folder("fits"), sizes.fit_frames)
    long = _long_fits(folder("long fits"), sizes.long_frames) if fits else []
    costs = _costs(folder("costs"), fits)
    files = files_per_second(folder("files"))
    own_s = statistics.median(ten.own_s) / ten.tasks
    return "\n".join(
        [
            INTRODUCTION.format(machine=this_machine()) + (LITTLE if sizes is QUICK else ""),
            _processes(two, ten, there_s, sizes.frames),
            _memory(used, fits, long),
            _steps(costs),
            _million(costs, two, own_s, files),
        ]
    )


def _processes(two: Compared, ten: Compared, there_s: float, frames: int) -> str:
    rounds = "one round" if len(two.one_s) == 1 else f"{len(two.one_s)} rounds"
    own_ms = 1e3 * statistics.median(ten.own_s) / ten.tasks
    rows = (
        (
            f"{two.tasks} maps of 5,000 vertices and {frames} frames: two processes against one",
            f"{two.ratio:.2f} times as fast ({_both(two)})",
            "≥ 1.8",
        ),
        (
            f"{ten.tasks} quick maps against a tenth of them",
            f"{ten.ratio:.2f} times the time ({_both(ten)})",
            "≤ 10.5",
        ),
        (
            "each of these, in the process that gives out and schedules",
            f"{own_ms:.1f} ms of processor time",
            "",
        ),
        ("a map that is there already", f"{1e3 * there_s:.2f} ms", ""),
    )
    return "\n".join(
        [
            "## Processes and tasks",
            "",
            f"In turns, {rounds}; ratios are the medians of those of the rounds. The processes had",
            "been started and had loaded the program, which takes some seconds once.",
            "",
            "| what | measured | wanted |",
            "|---|---|---|",
            *(f"| {what} | {measured} | {wanted} |" for what, measured, wanted in rows),
            "",
            "Tasks of one recording that take little go out in bundles of about a second. Each",
            f"process has {AHEAD} bundles ahead: the scheduler never holds more, however many"
            " there are.",
            "",
        ]
    )


def _memory(used: list[Memory], fits: list[Fitted], long: list[LongFit]) -> str:
    rows = [
        f"| {one.recordings} | {one.minutes:g} min | {one.vertices:,} | {one.how or 'exact'} |"
        + "|".join(f" {one.peak_mb[step]:.0f} MB " for step in ("synthesise", "denoise", "export"))
        + "|"
        for one in used
    ]
    return "\n".join(
        [
            "## Memory of one process",
            "",
            "The most that a process had by the end of a step. Wanted: at most 1 GB, whatever the",
            "number and length of recordings. A mesh is streamed, and a map is made in stretches",
            f"of {LONGEST_FRAMES:,} frames. From the step `denoise` on, torch is loaded.",
            "",
            "| recordings | each | vertices | visibility | synthesise | denoise | export |",
            "|---|---|---|---|---|---|---|",
            *rows,
            "",
            *_fit_memory(fits, long),
        ]
    )


def _fit_memory(fits: list[Fitted], long: list[LongFit]) -> list[str]:
    """Real fits, and long ones whose landmarks are there already."""
    if not long:
        return []
    stages = [name for name in long[0].peak_mb if name != "start"]
    lines = [
        "A fit reads its clip in parts ([decision 42](decisions/0042-fits-of-any-length.md)). Of "
        "the sample's video, its",
        "landmarks found as well: "
        + ", ".join(f"{one.peak_mb:.0f} MB with {one.frames:,} frames" for one in fits)
        + ". With landmarks that go",
        "forwards and backwards through the sample's, the most in each stage:",
        "",
        f"| frames | {' | '.join(stages)} |",
        "|---|" + "---|" * len(stages),
        *(
            f"| {one.frames:,} |"
            + "|".join(f" {one.peak_mb[name]:.0f} MB " for name in stages)
            + "|"
            for one in long
        ),
        "",
    ]
    few, many = (max(one.peak_mb.values()) for one in (long[0], long[-1]))
    each_kb = 1e3 * (many - few) / (long[-1].frames - long[0].frames)
    if each_kb > 0:
        hours = (long[-1].frames + 1e3 * (1000 - many) / each_kb) / (30 * 3600)
        lines += [
            f"That is {each_kb:.1f} kB per frame; if it goes on so, 1 GB is reached with"
            f" {hours:.1f} hours of video at 30 frames/s.",
            "",
        ]
    return lines


def _steps(costs: list[Cost]) -> str:
    rows = [
        f"| {one.step} | {1e3 * one.frame_s:.3f} ms | {1e3 * one.task_s:.0f} ms |"
        f" {one.frame_bytes:.0f} B | {bytes_words(one.task_bytes)} |"
        for one in costs
    ]
    return "\n".join(
        [
            "## Steps",
            "",
            "On one process, for the sample recording (5,000 vertices); `fit` is of its video, in",
            "processor time. For a tolerance one plan is chosen per mesh, where that pays.",
            "",
            "| step | per frame | and per task | written per frame | and per task |",
            "|---|---|---|---|---|",
            *rows,
            "",
        ]
    )


def _million(costs: list[Cost], two: Compared, own_s: float, files: tuple[float, float]) -> str:
    by_step = {one.step: one for one in costs}
    count = {"fit": RECORDINGS, "synthesise": RECORDINGS * PLACES, "denoise": RECORDINGS * PLACES}
    count = {step: tasks for step, tasks in count.items() if step in by_step}
    seconds = {step: tasks * by_step[step].seconds(FRAMES) for step, tasks in count.items()}
    size = {step: tasks * by_step[step].bytes(FRAMES) for step, tasks in count.items()}
    tasks, total_s = RECORDINGS + sum(count.values()), sum(seconds.values())
    # What each part lets through, in cores that it keeps at work.
    full = {
        "the process that gives out tasks and schedules them": total_s / (tasks * own_s),
        "a file system that writes no faster than the disk here": total_s / (tasks / files[0]),
    }
    first = min(full, key=lambda part: full[part])
    rows = [
        f"| {step} | {tasks:,} | {seconds[step] / 3600:,.0f} | {bytes_words(size[step])} |"
        for step, tasks in count.items()
    ]
    machines = [
        f"| {number:,} | {-(-number // 64):,} | {total_s / number / 3600:,.0f} h |"
        f" {tasks / (total_s / number):,.0f} | {tasks * own_s / (total_s / number):.0%} |"
        for number in (64, 256, 1024, 4096)
    ]
    lines = [
        "## A million recordings",
        "",
        f"Reckoned from the above, for {RECORDINGS:,} videos of {FRAMES:,} frames, each from"
        f" {PLACES} placements,",
        f"on processors like this one. Two processes here do {two.ratio / 2:.0%} of twice the work"
        " of one; more",
        "are taken to lose no more.",
        "",
        "| step | tasks | hours of one core | written |",
        "|---|---|---|---|",
        *rows,
        f"| all, with the looking | {tasks:,} | {total_s / 3600:,.0f} |"
        f" {bytes_words(sum(size.values()))} |",
        "",
        "| cores | machines of 64 | time | tasks/s | load of the scheduler |",
        "|---|---|---|---|---|",
        *machines,
        "",
        f"- **Scheduler.** {1 / own_s:,.0f} tasks/s at most, in one process beside the batch's",
        "  own work; above 100 % it keeps cores waiting. Longer recordings load it less, as a task",
        "  is a map. Beyond that, divide the recordings over several plans, each with a scheduler",
        "  and a folder.",
        f"- **File system.** {tasks:,} small files in 256 folders per kind. Here {files[0]:,.0f}",
        f"  are written in a second, each flushed to disk, and {files[1]:,.0f} looked at; a run",
        "  that finds all made looks at each.",
        f"- **First to saturate:** the processors, up to {full[first]:,.0f} cores; from there on",
        f"  {first}.",
        "",
    ]
    return "\n".join(lines)


def _costs(folder: Path, fits: list[Fitted]) -> list[Cost]:
    sample = resource_path("swipes.sd2")
    costs = []
    if fits:
        longest = fits[-1]
        each_s, each_bytes = longest.seconds / longest.frames, longest.bytes / longest.frames
        costs.append(Cost("fit", each_s, 0.0, each_bytes, 0.0))
    for title, how in (("synthesise", ""), ("synthesise, 2 %", "tolerance = 0.02")):
        text = (
            f'out = "{folder / "made"}"\n[recordings]\nfiles = ["{sample}"]\n'
            f"[synthesise]\n{how}\n[denoise]\n"
        )
        made, denoised = _costs_of_maps(plan_from_text(text, folder), folder / title, title)
        costs += [made] if how else [made, denoised]
    return costs


def _costs_of_maps(plan: BatchPlan, folder: Path, title: str) -> tuple[Cost, Cost]:
    """Costs of a map and of denoising it, from many frames of a recording and from few."""
    folder.mkdir()
    origins = find_origins(plan.recordings, Path(plan.out))
    model, digest = TaskGraph(plan, BatchFolder(Path(plan.out)), origins).model
    found, section = glance(origins[0]), plan.synthesise
    mesh, counts = found.mesh, _TIMED_FRAMES
    assert mesh is not None
    assert section is not None
    choosing = None
    if section.tolerance is not None:
        choosing = Choosing(folder / "plan.json", (found.sensor,), mesh.frames)
    places = (VirtualSensor((1e-3 * number, 0.0, 0.0)) for number in itertools.count(1))

    def made(count: int) -> Path:
        return folder / f"{count}.npz"

    def denoised(count: int) -> Path:
        return folder / f"denoised-{count}.npz"

    def make(count: int) -> None:
        # From another place each time: masks of a place are kept, and would cost nothing.
        synthesise(mesh, next(places), section, (0, count), choosing, made(count))

    def clean(count: int) -> None:
        denoise([made(count)], model, digest, [denoised(count)])

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


def _fits(folder: Path, frames: tuple[int, ...]) -> list[Fitted]:
    """Fits of the sample's video; none where the landmark models are missing."""
    video = open_recording(resource_path("swipes.sd2")).video
    assert video is not None
    fits = []
    for count in frames:
        try:
            seconds, peak_mb = fit_of(video, count, folder)
        except subprocess.CalledProcessError as error:
            _say(f"no fit: {error.stderr}")
            return []
        mesh = folder / f"{count}.zarr"
        fits.append(Fitted(count, seconds, peak_mb, size_bytes(mesh)))
    return fits


def _long_fits(folder: Path, frames: tuple[int, ...]) -> list[LongFit]:
    track = sample_landmarks(folder)
    return [long_fit(track, count, folder) for count in frames]


def _both(compared: Compared) -> str:
    one_s, other_s = map(statistics.median, (compared.one_s, compared.other_s))
    return f"{one_s:.1f} s and {other_s:.1f} s"


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


if __name__ == "__main__":
    main()
