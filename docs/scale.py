"""Makes ``scale.md``: ``make scale``, about ten minutes on two idle cores.

Every figure is measured when this runs; what a million recordings need follows from them.
``--quick`` measures little, to see that it works.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from sd2core.batch.estimate import task_rates
from sd2core.batch.flow import Flow
from sd2core.batch.folder import BatchFolder
from sd2core.batch.inputs import find_origins, glance
from sd2core.batch.plan_file import plan_from_text
from sd2core.batch.stretches import LONGEST_FRAMES
from sd2core.cli.batch_words import bytes_words
from sd2core.compiled import warm_up
from sd2core.errors import Sd2Error
from sd2core.ladder.scene import this_machine
from sd2core.resources import resource_path

DOCS = Path(__file__).resolve().parent
sys.path.insert(0, str(DOCS.parent / "tests" / "benchmarks"))
from batches import (  # noqa: E402
    Compared,
    Memory,
    files_per_second,
    memory,
    nothing_to_do,
    ten_times_the_tasks,
    two_against_one,
)

RECORDINGS, FRAMES, PLACES = 1_000_000, 1800, 8
"""What is reckoned for: a minute each at 30 frames/s."""

_GB = 1e9

INTRODUCTION = """\
# Batches at scale

What `sd2 batch` costs, measured, and what a million recordings would need, reckoned from that.
Made by

```
make scale
```

on {machine}. How it works is [decision 39](decisions/0039-batches.md), what a plan and its folder
hold [formats.md](formats.md#batches).
"""


@dataclass(frozen=True)
class Sizes:
    """How much is measured."""

    recordings: int
    places: int
    rounds: int
    tenth: int
    tenth_places: int
    minutes: tuple[float, ...]
    many: int
    fit: bool


FULL = Sizes(4, 55, 3, 10, 8, (1.0, 12.0, 90.0), 20, fit=True)
QUICK = Sizes(2, 5, 1, 2, 3, (0.2, 0.5), 2, fit=False)


@dataclass(frozen=True)
class Cost:
    """Of one step, on one process."""

    step: str
    frame_s: float
    task_s: float
    frame_bytes: float
    task_bytes: float

    def seconds(self, frames: int) -> float:
        """Of one task."""
        return self.task_s + frames * self.frame_s

    def bytes(self, frames: int) -> float:
        """That one task writes."""
        return self.task_bytes + frames * self.frame_bytes


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

    two = two_against_one(folder("two processes"), sizes.recordings, sizes.places, sizes.rounds)
    ten = ten_times_the_tasks(
        folder("ten times the tasks"), sizes.tenth, sizes.tenth_places, sizes.rounds
    )
    there_s = nothing_to_do(folder("nothing to do"), 10 * sizes.tenth, sizes.tenth_places)
    place = folder("memory")
    how = "visibility = 'facing'"
    used = [memory(place, minutes, 1, 1229, how) for minutes in sizes.minutes]
    used.append(memory(place, sizes.minutes[0], sizes.many, 1229, how))
    used.append(memory(place, sizes.minutes[0], 1, 13348, "visibility = 'exact'"))
    costs = _costs(folder("costs"), sizes)
    written, looked = files_per_second(folder("files"))
    own_s = statistics.median(ten.own_s) / ten.tasks
    return "\n".join(
        [
            INTRODUCTION.format(machine=this_machine()),
            _processes(two, ten, there_s),
            _memory(used),
            _steps(costs),
            _million(costs, two, own_s, written, looked),
        ]
    )


def _processes(two: Compared, ten: Compared, there_s: float) -> str:
    rounds = len(two.one_s)
    return f"""\
## Processes and tasks

In turns, {rounds} round{"s" if rounds > 1 else ""} each; the median of the rounds' ratios. Processes
had been started and had loaded the program.

| what | measured | wanted |
|---|---|---|
| {two.tasks} maps of 2,000 vertices, exact: two processes against one | {two.ratio:.2f} times as fast \
({_seconds(two.one_s)} s and {_seconds(two.other_s)} s) | ≥ 1.8 |
| {ten.tasks} maps against a tenth of them | {ten.ratio:.2f} times the time \
({_seconds(ten.one_s)} s and {_seconds(ten.other_s)} s) | ≤ 10.5 |
| a task, in the process that gives them out and schedules them | \
{1e3 * statistics.median(ten.own_s) / ten.tasks:.1f} ms of processor time | |
| a map that is there already | {1e3 * there_s:.2f} ms | |

Each process is given four tasks ahead: the scheduler never holds more, however many there are.
"""


def _memory(used: list[Memory]) -> str:
    rows = [
        f"| {one.recordings} | {one.minutes:g} min | {one.vertices:,} |"
        + "|".join(f" {one.peak_mb[step]:.0f} MB " for step in ("synthesise", "denoise", "export"))
        + "|"
        for one in used
    ]
    return "\n".join(
        [
            "## Memory of one process",
            "",
            "The most that a process had by the end of a step, in MB. Wanted: at most 1 GB, whatever",
            f"the number and length of recordings. A mesh is streamed, and a map is made in stretches"
            f" of {LONGEST_FRAMES:,}",
            "frames. From the step `denoise` on, torch is loaded.",
            "",
            "| recordings | each | vertices | synthesise | denoise | export |",
            "|---|---|---|---|---|---|",
            *rows,
            "",
            "A fit holds the whole clip: what it takes grows with the length of the video, see",
            "[decision 39](decisions/0039-batches.md).",
            "",
        ]
    )


def _steps(costs: list[Cost]) -> str:
    rows = [
        f"| {one.step} | {1e3 * one.frame_s:.2f} ms | {1e3 * one.task_s:.0f} ms |"
        f" {one.frame_bytes:.0f} B | {bytes_words(one.task_bytes)} |"
        for one in costs
    ]
    return "\n".join(
        [
            "## Steps",
            "",
            "On one process, for the sample recording (5,000 vertices). `fit` is its video.",
            "",
            "| step | per frame | and per task | written per frame | and per task |",
            "|---|---|---|---|---|",
            *rows,
            "",
        ]
    )


def _million(costs: list[Cost], two: Compared, own_s: float, written: float, looked: float) -> str:
    by_step = {one.step: one for one in costs}
    count = {"fit": RECORDINGS, "synthesise": RECORDINGS * PLACES, "denoise": RECORDINGS * PLACES}
    exact, quick = by_step["synthesise"], by_step["synthesise, 2 %"]
    rows, total_s, total_bytes = [], 0.0, 0.0
    for step, tasks in count.items():
        cost = by_step.get(step)
        if cost is None:
            continue
        seconds, size = tasks * cost.seconds(FRAMES), tasks * cost.bytes(FRAMES)
        total_s, total_bytes = total_s + seconds, total_bytes + size
        rows.append(f"| {step} | {tasks:,} | {seconds / 3600:,.0f} | {bytes_words(size)} |")
    tasks = RECORDINGS + sum(count[step] for step in count if step in by_step)
    cores = (256, 1024, 4096)
    machines = "\n".join(
        f"| {number:,} | {-(-number // 64):,} | {total_s / number / 86400:.1f} days |"
        f" {tasks / (total_s / number):.0f} | {tasks * own_s / (total_s / number):.0%} |"
        for number in cores
    )
    full = total_s / (tasks * own_s)
    saved = RECORDINGS * PLACES * (exact.seconds(FRAMES) - quick.seconds(FRAMES)) / 3600
    gain = two.ratio / 2
    first = (
        "the scheduler"
        if 1 / own_s < written * 2
        else "the file system, if it does not write faster than the disk here"
    )
    return f"""\
## A million recordings

Reckoned from the above, for {RECORDINGS:,} recordings of {FRAMES:,} frames from {PLACES} placements each,
on processors like this one. Two processes here give {gain:.0%} of twice the work; so would more, as far as
memory and disks keep up.

| step | tasks | hours of one core | written |
|---|---|---|---|
{chr(10).join(rows)}
| all | {tasks:,} | {total_s / 3600:,.0f} | {bytes_words(total_bytes)} |

| cores | machines of 64 | time | tasks/s | load of the scheduler |
|---|---|---|---|---|
{machines}

- **Hours.** {total_s / 3600:,.0f} of one core. A tolerance of 2 % (`tolerance = 0.02`) saves
  {saved:,.0f} of them, once a plan is chosen per map.
- **Bytes.** {bytes_words(total_bytes)}, of which fitted meshes are most; they can be deleted when their maps are made,
  and are made again when another placement is asked for.
- **Scheduler.** {1 / own_s:,.0f} tasks/s at most: one process gives out tasks and schedules them. It is full with
  {full:,.0f} cores at work on recordings of this length; shorter ones fill it sooner.
- **File system.** {tasks:,} small files in 256 folders per kind. Here {written:,.0f} are written in a second, each flushed
  to disk, and {looked:,.0f} looked at. A run that finds everything made looks at each once.
- **First to saturate:** the processors, up to some {min(full, written / (tasks / total_s)):,.0f} cores; then {first}.
"""


def _costs(folder: Path, sizes: Sizes) -> list[Cost]:
    sample = resource_path("swipes.sd2")
    costs = []
    if sizes.fit and (fit := _fit_cost(folder, sample)) is not None:
        costs.append(fit)
    for title, how in (("synthesise", ""), ("synthesise, 2 %", "tolerance = 0.02")):
        text = (
            f'out = "{folder / "made"}"\n[recordings]\nfiles = ["{sample}"]\n'
            f"[synthesise]\n{how}\n[denoise]\n"
        )
        plan = plan_from_text(text, folder)
        origins = find_origins(plan.recordings, Path(plan.out))
        flow = Flow(plan, BatchFolder(Path(plan.out)), origins)
        rates = task_rates(flow, glance(origins[0]))
        for step in ("synthesise", "denoise"):
            if step == "synthesise" or not how:
                rate = rates[step]
                costs.append(
                    Cost(
                        title if step == "synthesise" else step,
                        rate.frame_s,
                        rate.seconds,
                        rate.frame_bytes,
                        rate.bytes,
                    )
                )
    return costs


def _fit_cost(folder: Path, sample: Path) -> Cost | None:
    """Of the sample's video; None where the landmark models are not there."""
    from sd2core.batch.fitting import fit_to_video
    from sd2core.recording import open_recording

    video = open_recording(sample).video
    assert video is not None
    begun_s = time.process_time()
    try:
        fit_to_video(str(video), {}, None, str(folder / "fit.zarr"))
    except Sd2Error as error:
        _say(f"no fit: {error}")
        return None
    seconds = time.process_time() - begun_s
    size = sum(one.stat().st_size for one in (folder / "fit.zarr").rglob("*") if one.is_file())
    with open_recording(sample).open_video() as reader:
        count = len(reader)
    return Cost("fit", seconds / count, 0.0, size / count, 0.0)


def _seconds(values: list[float]) -> str:
    return f"{statistics.median(values):.1f}"


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


if __name__ == "__main__":
    main()
