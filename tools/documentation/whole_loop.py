"""Makes ``whole-loop.md`` and its picture: ``make whole-loop``, under 20 minutes.

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
from textwrap import indent

from sd2core.accuracy.cache import this_machine
from sd2core.files.resources import resource_path
from tools.documentation.measured import write_page
from tools.documentation.places import BUILD, IMAGES, REPOSITORY
from tools.documentation.runs import sections

MINUTES = 12.0
"""Of the campaign."""

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

What does the whole way take, from pairs to a classifier, and what does synthetic data add on it?
Made by

```sh
make whole-loop
```

which ran every command below on {machine}: **{minutes:.1f} minutes** in all. No real radar has part
in it: the campaign's radar is **simulated**, and so is the sample, `swipes.sd2`. Campaign and
trainings are small, to show the way; figures to go by are in
[the gesture classifier](classifier.md) and, for many recordings, in [scale](scale.md).

## Step by step

With the seconds that each took, and where the window has the same.

{steps}

## What comes out

Segments of the data set:

![Segments of the data set](images/whole-loop-set.png)

The study of the last step. Judged are maps of the **simulated** radar of people who were not
learnt from; points of frames over real data alone, with 95 % intervals.

{table}

## What this cannot say

- With two seeds and {campaign_minutes:g} minutes gains are rough; with more of the radar's data
  they shrink ([the gesture classifier](classifier.md)).
- What synthetic data do for a classifier on a real radar: [studies](studies.md).
"""


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
        f"sd2 simulate campaign --people 6 --minutes {MINUTES:g} --sensors 2 --seed 2"
        " --out campaign.zarr",
        "*Train* page",
    ),
    Step(
        "Plan sensors around the person",
        "sd2 placements swipes.sd2 --ranges 1.5:3:0.5 --azimuths=-30:30:30 --out grid.json",
        "*Edit → Placements…*",
    ),
    Step(
        "Look ahead",
        "sd2 batch plan.toml --dry-run",
        "*File → Batch…*",
    ),
    Step(
        "Synthesise, denoise and export from all of them",
        "sd2 batch plan.toml",
        "*File → Batch…*",
    ),
    Step(
        "Export a data set",
        "sd2 export swipes.sd2 campaign.zarr --validation-subjects s05 --test-subjects s06"
        " --out set.zarr",
        "*File → Export data set…*",
    ),
    Step(
        "Train a classifier on it",
        "sd2 classify train set.zarr --maps radar,denoised --out gestures.safetensors",
        "*Train* page, *Classifier*",
    ),
    Step(
        "Judge it on a person it has not seen",
        "sd2 classify eval campaign.zarr --model gestures.safetensors",
        "*Train* page, *Study*, *Open a result…*",
    ),
    Step(
        "Find gestures in the sample",
        "sd2 classify apply swipes.sd2 --of denoised --model gestures.safetensors --out found.json",
        "*Labels → Suggestions → Find gestures*",
    ),
    Step(
        "What does synthetic data add?",
        "sd2 classify table campaign.zarr --out tables --quick",
        "*Train* page, *Study*",
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
        took_s = _run(step.command, folder)
        total_s += took_s
        parts.append(_part(number, step, took_s))
    shutil.copyfile(folder / "set.png", IMAGES / "whole-loop-set.png")
    page = PAGE.format(
        machine=this_machine(),
        minutes=total_s / 60.0,
        steps="\n".join(parts).rstrip(),
        campaign_minutes=MINUTES,
        table=_gained((folder / "tables" / "study.md").read_text("utf-8")),
    )
    write_page("whole-loop.md", page)


def _gained(page: str) -> str:
    """Table of the gains of a study's page."""
    part = sections(page)["Gained"]
    return part[part.index("|") : part.index("!")].strip()


def _run(command: str, folder: Path) -> float:
    """Seconds that a command takes; one that fails ends the program."""
    words = [sys.executable, "-m", "sd2core.cli", *shlex.split(command)[1:]]
    print(f"$ {command}", flush=True)
    path = os.pathsep.join(filter(None, [str(REPOSITORY), os.environ.get("PYTHONPATH")]))
    begun_s = time.monotonic()
    done = subprocess.run(words, cwd=folder, env={**os.environ, "PYTHONPATH": path})
    if done.returncode:
        sys.exit(f"{command}: exit code {done.returncode}")
    return time.monotonic() - begun_s


def _part(number: int, step: Step, took_s: float) -> str:
    given = f"`plan.toml`:\n\n```toml\n{PLAN}```\n\n" if "--dry-run" in step.command else ""
    text = f"{step.title}: {took_s:.0f} s; {step.window}\n\n{given}```sh\n{step.command}\n```\n"
    return f"{number}. {indent(text, '   ').lstrip()}"


if __name__ == "__main__":
    main()
