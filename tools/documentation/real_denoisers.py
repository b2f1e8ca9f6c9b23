"""Makes ``real-denoisers.md``: ``python -m tools.documentation.real_denoisers``, half an hour.

Every MARS person is judged by models that learnt from the others. Pairs and runs stay in
``build/real-denoisers`` (or ``--folder``); what is there is not made again. Runs are as many at
once as the machine has cores, one thread each.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from sd2core.accuracy.cache import this_machine
from sd2core.files.tables import markdown_table
from sd2core.pairs.store import read_pairs
from tools.documentation.measured import write_page
from tools.documentation.places import BUILD, SHARED
from tools.documentation.runs import (
    ERRORS,
    Job,
    evaluated,
    run_of,
    sd2,
    settings,
    spread,
    timed,
    train,
)

MARS = tuple(SHARED / "paired" / f"mars_subject{person}" for person in (1, 2, 4))

# At 10 frames/s the S4's steps are longer.
_S4 = ("s4", *settings({"dt_min": 0.2, "dt_max": 2.0}))
_BOTH_WAYS = (*_S4, *settings({"bidirectional": "true"}))
MODELS = {
    "s4-map": (*_S4, "--inputs", "map"),
    "s4-both-map": (*_BOTH_WAYS, "--inputs", "map"),
    "s4-both-limbs": (*_BOTH_WAYS, "--inputs", "limbs"),
    "s4-both-kinematics": (*_BOTH_WAYS, "--inputs", "kinematics"),
    "gru-kinematics": ("gru", "--inputs", "kinematics"),
}

BEST = "s4-both-kinematics"

PAGE = """\
# Denoisers on a real radar

What do denoisers make of a **real** radar, of people whom they have not learnt from? MARS: a body
driven by a Kinect's skeleton, and what a 77 GHz radar saw of the same person, 10 frames/s
([decision 27](decisions/0027-real-pairs.md)). Each of the three persons is judged by models that
learnt from the two others alone; ± is over {seeds} seeds. Beside the map models learn its mean
velocity (`--velocity-weight 1`). That and the dropout, 0.5, were chosen by persons 1 and 4: only
person 2 is new to them. The S4's steps are longer than for 30 frames/s. Made by

```sh
python -m tools.documentation.real_denoisers --seeds {seeds} --minutes {minutes:g}
```

on {machine}. *None* is the synthetic map; the next three are filters. `-both` looks both ways;
*kinematics* is how joints move ([decision 52](decisions/0052-limb-maps.md)). *Peak* is the velocity
of the strongest bin, *mean* that of the whole column, where the radar shows movement; *corr.* is
that of the mean. How much of it the radar's few points allow:
[real pairs](real-pairs.md#what-the-radar-allows).

{table}

{gain} {beside_ridge}

Wanted were 35 % less than *none*, a correlation of 0.84, and peaks nearer than `ridge`'s.

## What this cannot say

- Three persons' exercises, not swipes, and the input is a Kinect's skeleton, not a fitted video.
- Differences within the spread of the seeds rank nothing.
"""


def main() -> None:
    """Make what is missing, measure everything and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--folder", type=Path, default=BUILD / "real-denoisers")
    parser.add_argument("--minutes", type=float, default=1.0, help="of training, each run")
    parser.add_argument("--seeds", type=int, default=3)
    options = parser.parse_args()
    folder: Path = options.folder
    mars = folder / "mars.zarr"
    sd2("pairs", "mars", *MARS, "--limbs", "--out", mars)
    people = read_pairs(mars).subjects
    runs: dict[str, list[Job]] = {}
    for judged in people:
        for name, model in MODELS.items():
            how = (
                *("--model", *model, *settings({"dropout": 0.5}), "--batch-size", "16"),
                *("--velocity-weight", "1"),
                *("--validation-subjects", "none", "--test-subjects", judged),
            )
            job = timed(folder, Job(f"mars-{judged}-{name}", mars, how), options.minutes)
            runs.setdefault(judged, []).extend(map(job.seeded, range(options.seeds)))
    train(folder, [job for own in runs.values() for job in own])
    evaluations = {
        judged: evaluated([folder / job.name for job in own], mars, "--subjects", judged)
        for judged, own in runs.items()
    }
    page = PAGE.format(
        seeds=options.seeds,
        minutes=options.minutes,
        machine=this_machine(),
        table=_table(evaluations),
        gain=_gain(evaluations),
        beside_ridge=_beside_ridge(evaluations.values()),
    )
    write_page("real-denoisers.md", page)


def _table(evaluations: Mapping[str, Mapping[str, Any]]) -> str:
    """Errors of the filters and models for each person, side by side."""
    rows: dict[str, list[str]] = {"model": ["model"]}
    for judged, evaluation in evaluations.items():
        rows["model"] += [f"person {judged}: peak MAE m/s", "mean MAE m/s", "corr."]
        for group in evaluation["groups"]:
            name = run_of(group).removeprefix(f"mars-{judged}-")
            rows.setdefault(name, [name]).extend(
                [
                    spread(group["peak_mae_mps"]),
                    spread(group["mean_mae_mps"]),
                    spread(group["mean_correlation"], 2),
                ]
            )
    return "\n".join(markdown_table(list(rows.values())))


def _gain(evaluations: Mapping[str, Mapping[str, Any]]) -> str:
    """Sentence on what kinematics gain against no denoising."""
    told = []
    for judged, evaluation in evaluations.items():
        none, *groups = evaluation["groups"]
        (best,) = (one for one in groups if run_of(one) == f"mars-{judged}-{BEST}")
        ratio = best["mean_mae_mps"]["mean"] / none["mean_mae_mps"]["mean"]
        told.append(f"{100.0 * (ratio - 1.0):+.0f} % for person {judged}")
    return f"`{BEST}` changes the error of the mean velocity by {', '.join(told)}."


def _beside_ridge(evaluations: Iterable[Mapping[str, Any]]) -> str:
    """Sentence on how often a network does better than the best of the filters."""
    better = []
    for evaluation in evaluations:
        ridge, *trained = [
            one for one in evaluation["groups"] if one["trained"] or one["name"] == "ridge"
        ]
        better += [[one[name]["mean"] < ridge[name]["mean"] for name in ERRORS] for one in trained]
    peak, mean, _ = map(sum, zip(*better, strict=True))
    return (
        f"A network has nearer peaks than `ridge`, a linear filter, in {peak} of {len(better)}"
        f" cases, and a nearer mean velocity in {mean}."
    )


if __name__ == "__main__":
    main()
