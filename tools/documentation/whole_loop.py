"""Makes ``whole-loop.md`` and its pictures: ``make whole-loop``, under 20 minutes.

From the sample recording and a small simulated campaign to a data set, a classifier and
what synthetic data does for it. Every command is run and timed when this runs, in
``build/whole-loop`` (or ``--folder``), which must be new or empty.
"""

from __future__ import annotations

import argparse
import os
import shlex
import shutil
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

from sd2core.accuracy.cache import this_machine
from sd2core.files.atomic import atomic_write_text
from sd2core.files.resources import resource_path
from tools.documentation.places import BUILD, DOCS, IMAGES, REPOSITORY

LINES = 12
"""Longest output of a command that is shown."""

PLAN = """\
out = "made"

[recordings]
files = ["swipes.sd2"]

[placements]
kind = "grid"
ranges_m = [1.5, 2.0, 2.5, 3.0]
azimuths_deg = [-30.0, 0.0, 30.0]
elevations_deg = [0.0]

[synthesise]

[denoise]

[export]
"""

PAGE = """\
# From a recording to a classifier

The whole way in one sequence of commands, and where each step is in the window. Made by

```
make whole-loop
```

which ran every command below on {machine}: **{minutes:.1f} minutes** in all. No real radar has part
in it: the campaign's radar is **simulated**, and so is the sample recording. The figures are of a
small campaign and few trainings, to show the way; those to go by are in
[classifier.md](classifier.md), and what many recordings take is in [scale.md](scale.md).

{steps}
## What comes out

The data set, a few segments of each label:

![Segments of the data set](images/whole-loop-set.png)

Confusion matrices of classifiers that learnt from the (simulated) radar alone, and with synthetic
data added:

![Confusion matrices](images/whole-loop-confusion.png)

{table}"""


@dataclass(frozen=True)
class Step:
    """One command."""

    title: str
    command: str
    window: str
    """Place in the window where the same is done."""


STEPS = (
    Step(
        "Pairs to learn from",
        "sd2 simulate campaign --people 6 --minutes 12 --sensors 2 --seed 2 --out campaign.zarr",
        "*Train* page, where a campaign or recordings of one's own are chosen. (Who has a radar"
        " makes pairs with `sd2 pairs` instead.)",
    ),
    Step(
        "Plan sensors around the person",
        "sd2 placements swipes.sd2 --ranges 1.5:3:0.5 --azimuths=-30:30:30 --out grid.json",
        "*Edit → Placements…*: grid or cloud, drawn in the scene, with what it will cost.",
    ),
    Step(
        "Look ahead",
        "sd2 batch plan.toml --dry-run",
        "*File → Batch…* says the same before it starts.",
    ),
    Step(
        "Synthesise, denoise and export from all of them",
        "sd2 batch plan.toml",
        "*File → Batch…*; it goes on when the window is closed.",
    ),
    Step(
        "Export a data set",
        "sd2 export swipes.sd2 campaign.zarr --validation s05 --test s06 --out set.zarr",
        "*File → Export data set…*, for recordings.",
    ),
    Step(
        "Train a classifier on it",
        "sd2 classify train set.zarr --maps radar,denoised --out gestures.safetensors",
        "*Train* page, *Classifier*.",
    ),
    Step(
        "Judge it on a person it has not seen",
        "sd2 classify eval campaign.zarr --model gestures.safetensors",
        "*Train* page, *Classifier*: *Open a result…* shows a file of what `--json` prints.",
    ),
    Step(
        "Find gestures in the sample",
        "sd2 classify apply swipes.sd2 --of denoised --model gestures.safetensors --out found.json",
        "*Labels → Suggestions → Find gestures*: offered as suggestions, with a read-out while"
        " playing.",
    ),
    Step(
        "What does synthetic data add?",
        "sd2 classify table campaign.zarr --out tables --quick",
        "*Train* page, *Classifier*: *Compare* shows the matrices and the curve.",
    ),
)


def main() -> None:
    """Run everything and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--folder", type=Path, default=BUILD / "whole-loop")
    folder: Path = parser.parse_args().folder
    if folder.exists() and any(folder.iterdir()):
        sys.exit(f"{folder} is not empty: what is there already would not be timed")
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copytree(resource_path("swipes.sd2"), folder / "swipes.sd2")
    (folder / "plan.toml").write_text(PLAN, "utf-8")
    parts, total_s = [], 0.0
    for number, step in enumerate(STEPS, start=1):
        printed, took_s = _run(step.command, folder)
        total_s += took_s
        parts.append(_part(number, step, printed, took_s))
    for name, made in (
        ("whole-loop-set.png", "set.png"),
        ("whole-loop-confusion.png", "tables/confusion.png"),
    ):
        shutil.copyfile(folder / made, IMAGES / name)
    page = PAGE.format(
        machine=this_machine(),
        minutes=total_s / 60.0,
        steps="\n".join(parts),
        table=(folder / "tables" / "table.md").read_text("utf-8"),
    )
    atomic_write_text(DOCS / "whole-loop.md", page)


def _run(command: str, folder: Path) -> tuple[str, float]:
    """Output of a command and its seconds; a command that fails ends the program."""
    words = [sys.executable, "-m", "sd2core.cli", *shlex.split(command)[1:]]
    print(f"$ {command}", flush=True)
    path = os.pathsep.join(filter(None, [str(REPOSITORY), os.environ.get("PYTHONPATH")]))
    begun_s = time.monotonic()
    done = subprocess.run(
        words, cwd=folder, env={**os.environ, "PYTHONPATH": path}, stdout=subprocess.PIPE, text=True
    )
    took_s = time.monotonic() - begun_s
    if done.returncode:
        sys.exit(f"{command}: exit code {done.returncode}\n{done.stdout}")
    return done.stdout.replace(f"{folder.resolve()}{os.sep}", ""), took_s


def _part(number: int, step: Step, printed: str, took_s: float) -> str:
    lines = printed.rstrip().splitlines()
    shown = "\n".join(lines[:LINES] + (["…"] if len(lines) > LINES else []))
    given = f"`plan.toml`:\n\n```toml\n{PLAN}```\n\n" if "--dry-run" in step.command else ""
    return (
        f"## {number}. {step.title}\n\n{given}```\n$ {step.command}\n{shown}\n```\n\n"
        f"{took_s:.0f} s. In the window: {step.window}\n"
    )


if __name__ == "__main__":
    main()
