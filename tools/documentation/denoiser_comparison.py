"""Makes ``denoiser-comparison.md``: ``make denoiser-comparison``, hours.

Campaign, pairs and runs stay in ``build/denoiser-comparison`` (or ``--folder``); what is there is
not made again, a run that was broken off goes on. Runs are as many at once as the machine has
cores, one thread each.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from sd2core.accuracy.cache import this_machine
from sd2core.denoise.registry import options as options_of
from sd2core.files.tables import markdown_table
from tools.documentation.measured import write_page
from tools.documentation.places import BUILD
from tools.documentation.runs import (
    ERRORS,
    Job,
    TimedJob,
    campaign_of,
    epoch_ends_s,
    errors_of,
    evaluated,
    run_of,
    settings,
    timed,
    train,
)

NAME = "denoiser-comparison.md"

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

Which network denoises best at equal time? The radar is **simulated**; a real one is in
[denoisers on a real radar](real-denoisers.md). Made by

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

## What this cannot say

- Who leads on a simulated radar need not lead on a real one
  ([decision 26](decisions/0026-the-simulated-campaign.md)).
- One seed has no spread: differences of some thousandths rank nothing.
"""


def main() -> None:
    """Make what is missing, measure everything and write the page."""
    options = _options()
    folder: Path = options.folder
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
    write_page(NAME, page)


def _simulated(evaluations: Sequence[Mapping[str, Any]], jobs: Mapping[str, TimedJob]) -> str:
    """Errors of the filters and of every run, as a table."""
    rows = [["run", "epochs", *ERRORS.values()]]
    for evaluation in evaluations:
        for group in evaluation["groups"]:
            name = run_of(group)
            if group["trained"] or evaluation is evaluations[0]:
                epochs = str(jobs[name].epochs) if group["trained"] else ""
                rows.append([name, epochs, *errors_of(group)])
    return "\n".join(markdown_table(rows))


def _leader(evaluation: Mapping[str, Any]) -> str:
    """Sentence on which network does best of those that learn from the map, as the paper's do."""
    mae_mps = {
        run_of(group): group["peak_mae_mps"]["mean"]
        for group in evaluation["groups"]
        if group["trained"] and run_of(group) not in WITH_LIMBS
    }
    best = min(mae_mps, key=mae_mps.__getitem__)
    return (
        f"Of what learns from the map, as the paper's models do, `{best}` has the nearest peaks"
        f" ({mae_mps[best]:.3f} m/s); the S4 that does not look ahead errs by {mae_mps['s4']:.3f},"
        f" the U-Net by {mae_mps['unet']:.3f}. All are regularised, by the dropout."
    )


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
    return parser.parse_args()


if __name__ == "__main__":
    main()
