"""Makes ``denoiser-comparison.md``: ``make denoiser-comparison``, hours.

Campaign, pairs and runs stay in ``build/denoiser-comparison`` (or ``--folder``); what is there is
not made again, a run that was broken off goes on. Runs are as many at once as the machine has
cores, one thread each. The real pairs are left out where the recordings are not there
(``SD2_SHARED_DATA``).
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from sd2core.accuracy.cache import this_machine
from sd2core.denoise.registry import options as options_of
from sd2core.files.tables import markdown_table
from sd2core.pairs.store import read_pairs
from tools.documentation.measured import write_page
from tools.documentation.places import BUILD, DOCS, SHARED
from tools.documentation.runs import (
    ERRORS,
    Job,
    TimedJob,
    campaign_of,
    epoch_ends_s,
    errors_of,
    evaluated,
    sd2,
    settings,
    spread,
    timed,
    train,
)

NAME = "denoiser-comparison.md"
MARS = tuple(SHARED / "paired" / f"mars_subject{person}" for person in (1, 2, 4))

WITH_LIMBS = {f"{name}-limbs": (name, "--inputs", "limbs") for name in ("s4", "gru", "unet")}
COMPARED = ("s4", "s4d", "gru", "unet", "swin", *WITH_LIMBS)
ALL = {
    **{name: (name,) for name in COMPARED if name not in WITH_LIMBS},
    **WITH_LIMBS,
    # As long a step of training as the S4 has.
    "unet-step": ("unet", *settings({**options_of("unet"), "channels": 5})),
    "swin-step": ("swin", *settings({**options_of("swin"), "channels": 16})),
    "s4-both": ("s4", *settings({"bidirectional": "true"})),
    "s4-range": ("s4", "--range-factor", "2"),
}
"""Arguments after ``--model`` of every run."""
SERIAL = "s4-serial"
DROPOUT = 0.1

PAGE = """\
# Denoisers compared

Which network denoises best at equal time, and what do denoisers make of a real radar? The first
table is of a **simulated** radar, the second of a **real** one. Made by

```sh
make denoiser-comparison
```

with `--campaign-minutes {campaign_minutes:g} --minutes {minutes:g} --seeds {seeds}`, on {machine}.
Nobody who is judged was learnt from. *Peak*: velocity of the strongest bin, *mean*: of the whole
column, both where the radar shows movement; *map*: all cells. The bundled models are measured in
[the denoiser](denoiser.md).

## Models at equal time

A simulated campaign as [there](denoiser.md#the-simulated-campaign), with errors of fits as
measured; {moving:,} moving frames of one person. Each model: {seeds} seed(s), {minutes:g} minutes
of processor time on one thread, a dropout of {dropout:g}, about as many parameters as the S4.

{simulated}

{leader}

*None* is the synthetic map; the next three are filters. `-limbs` takes maps of five parts of the
body ([decision 52](decisions/0052-limb-maps.md)); `-step` has fewer channels, so a step takes as
long as the S4's; `-both` also looks ahead, as U-Net and Swin transformer do, and cannot run live;
`-range` scales input and target together (`--range-factor 2`; moved sensors:
[range synthesis](range-synthesis.md)); `{serial}` is the paper's literal form, whose one epoch took
{serial_minutes:.1f} minutes.

"""
LIMITS = """\
## What this cannot say

- Who leads on a simulated radar need not lead on a real one
  ([decision 26](decisions/0026-the-simulated-campaign.md)).
- One seed has no spread: differences of some thousandths rank nothing.
- The real pairs are three persons' exercises, not swipes, and their input is a Kinect's skeleton,
  not a fitted video.
"""

# At 10 frames/s the S4's steps are longer.
_REAL_S4 = ("s4", *settings({"dt_min": 0.2, "dt_max": 2.0}))
_BOTH_WAYS = (*_REAL_S4, *settings({"bidirectional": "true"}))
REAL_MODELS = {
    "s4-map": (*_REAL_S4, "--inputs", "map"),
    "s4-both-map": (*_BOTH_WAYS, "--inputs", "map"),
    "s4-both-limbs": (*_BOTH_WAYS, "--inputs", "limbs"),
    "s4-both-kinematics": (*_BOTH_WAYS, "--inputs", "kinematics"),
    "gru-kinematics": ("gru", "--inputs", "kinematics"),
}

REAL_HEADING = "Real pairs"
REAL = """\
## {heading}

MARS: a body driven by a Kinect's skeleton, and what a **real** 77 GHz radar saw of the same person,
10 frames/s ([decision 27](decisions/0027-real-pairs.md)). Each of the three persons is judged by
models that learnt from the two others alone; ± is over {seeds} seeds. Beside the map they learn its
mean velocity (`--velocity-weight 1`). That and the dropout, 0.5, were chosen by persons 1 and 4:
only person 2 is new to them. The S4's steps are longer. Made by

```sh
python -m tools.documentation.denoiser_comparison --only-real --seeds {seeds} \\
  --real-minutes {real_minutes:g}
```

on {machine}. `-both` looks both ways; *kinematics* is how joints move
([decision 52](decisions/0052-limb-maps.md)). *Corr.* is that of the mean velocity; how much of it
the radar's few points allow: [real pairs](real-pairs.md#what-the-radar-allows).

{table}

{beside_ridge}

"""


def main() -> None:
    """Make what is missing, measure everything and write the page."""
    options = _options()
    folder: Path = options.folder
    if options.only_real:
        before, *_ = (DOCS / NAME).read_text("utf-8").partition(f"## {REAL_HEADING}")
        write_page(NAME, before + _real(folder, options) + LIMITS)
        return
    campaign = campaign_of(folder, options.campaign_minutes, "--seed", 1, "--limbs")
    jobs = {name: _timed(folder, campaign, name, options) for name in ALL}
    compared = [jobs[name].seeded(seed) for seed in range(options.seeds) for name in COMPARED]
    alone = {name: jobs[name].seeded(0) for name in ALL if name not in COMPARED}
    # A pilot of several epochs would take longer than all runs of another model.
    serial = TimedJob(_job(campaign, SERIAL, (SERIAL,)), math.nan, epochs=1)
    alone[SERIAL] = serial.seeded(0)
    train(folder, [*compared, *alone.values()])
    # Alone: beside the S4 it would count as a second seed of it.
    scaled = alone.pop("s4-range")
    runs = [[*compared, *alone.values()], [scaled]]
    evaluations = [evaluated([folder / job.name for job in those], campaign) for those in runs]
    page = PAGE.format(
        machine=this_machine(),
        campaign_minutes=options.campaign_minutes,
        seeds=options.seeds,
        minutes=options.minutes,
        dropout=DROPOUT,
        moving=evaluations[0]["moving_frames"],
        simulated=_simulated(evaluations, {**jobs, SERIAL: serial}),
        leader=_leader(evaluations[0]),
        serial=SERIAL,
        serial_minutes=epoch_ends_s(folder / alone[SERIAL].name)[0] / 60.0,
    )
    write_page(NAME, page + _real(folder, options) + LIMITS)


def _simulated(evaluations: Sequence[Mapping[str, Any]], jobs: Mapping[str, TimedJob]) -> str:
    """Errors of the filters and of every run, as a table."""
    rows = [["run", "epochs", *ERRORS.values()]]
    for evaluation in evaluations:
        for group in evaluation["groups"]:
            name = _run_of(group)
            if group["trained"] or evaluation is evaluations[0]:
                epochs = str(jobs[name].epochs) if group["trained"] else ""
                rows.append([name, epochs, *errors_of(group)])
    return "\n".join(markdown_table(rows))


def _leader(evaluation: Mapping[str, Any]) -> str:
    """Sentence on which network does best of those that learn from the map, as the paper's do."""
    mae_mps = {
        _run_of(group): group["peak_mae_mps"]["mean"]
        for group in evaluation["groups"]
        if group["trained"] and _run_of(group) not in WITH_LIMBS
    }
    best = min(mae_mps, key=mae_mps.__getitem__)
    return (
        f"Of what learns from the map, as the paper's models do, `{best}` has the nearest peaks"
        f" ({mae_mps[best]:.3f} m/s); the S4 that does not look ahead errs by {mae_mps['s4']:.3f},"
        f" the U-Net by {mae_mps['unet']:.3f}. All are regularised, by the dropout."
    )


def _run_of(group: Mapping[str, Any]) -> str:
    """Name of the run without its seed, or of the filter."""
    return group["models"][0]["name"].rpartition("-")[0] if group["trained"] else group["name"]


def _timed(folder: Path, campaign: Path, name: str, options: argparse.Namespace) -> TimedJob:
    return timed(folder, _job(campaign, name, ALL[name]), options.minutes)


def _job(campaign: Path, name: str, model: tuple[str, ...]) -> Job:
    return Job(name, campaign, ("--model", *model, *settings({"dropout": DROPOUT})))


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--folder", type=Path, default=BUILD / "denoiser-comparison")
    parser.add_argument("--campaign-minutes", type=float, default=168, help="of all people")
    parser.add_argument("--minutes", type=float, default=10.0, help="of training, each run")
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--real-minutes", type=float, default=1.5, help="of training, each run")
    parser.add_argument(
        "--only-real", action="store_true", help="renew the section on real pairs alone"
    )
    return parser.parse_args()


def _real(folder: Path, options: argparse.Namespace) -> str:
    """Section on real pairs; empty where the recordings are not there."""
    if not all(part.exists() for part in MARS):
        return ""
    mars = folder / "mars.zarr"
    sd2("pairs", "mars", *MARS, "--limbs", "--out", mars)
    people = read_pairs(mars).subjects
    runs: dict[str, list[Job]] = {}
    for judged in people:
        for name, model in REAL_MODELS.items():
            how = (
                *("--model", *model, *settings({"dropout": 0.5}), "--batch-size", "16"),
                *("--velocity-weight", "1"),
                *("--validation-subjects", "none", "--test-subjects", judged),
            )
            job = timed(folder, Job(f"mars-{judged}-{name}", mars, how), options.real_minutes)
            runs.setdefault(judged, []).extend(map(job.seeded, range(options.seeds)))
    train(folder, [job for own in runs.values() for job in own])
    evaluations = {
        judged: evaluated([folder / job.name for job in own], mars, "--subjects", judged)
        for judged, own in runs.items()
    }
    return REAL.format(
        heading=REAL_HEADING,
        seeds=options.seeds,
        real_minutes=options.real_minutes,
        machine=this_machine(),
        table=_real_table(evaluations),
        beside_ridge=_beside_ridge(evaluations.values()),
    )


def _real_table(evaluations: Mapping[str, Mapping[str, Any]]) -> str:
    """Errors of the filters and models for each person, side by side."""
    rows: dict[str, list[str]] = {"model": ["model"]}
    for judged, evaluation in evaluations.items():
        rows["model"] += [f"person {judged}: peak MAE m/s", "mean MAE m/s", "corr."]
        for group in evaluation["groups"]:
            name = _run_of(group).removeprefix(f"mars-{judged}-")
            rows.setdefault(name, [name]).extend(
                [
                    spread(group["peak_mae_mps"]),
                    spread(group["mean_mae_mps"]),
                    spread(group["mean_correlation"], 2),
                ]
            )
    return "\n".join(markdown_table(list(rows.values())))


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
