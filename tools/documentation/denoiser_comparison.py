"""Makes ``denoiser-comparison.md`` and its pictures: ``make denoiser-comparison``, hours.

Campaign, pairs and runs stay in ``build/denoiser-comparison`` (or ``--folder``); what is there is
not made again, a run that was broken off goes on. Runs are as many at once as the machine has
cores, one thread each. The real pairs are left out where the recordings are not there
(``SD2_SHARED_DATA``).
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Mapping
from pathlib import Path

from matplotlib.figure import Figure

from sd2core.accuracy.cache import this_machine
from sd2core.denoise.registry import options as options_of
from sd2core.files.atomic import atomic_write_text
from sd2core.files.figure_files import save_figure
from sd2core.pairs.store import read_pairs
from sd2core.runs.progress import read_events, standing
from sd2core.train.folder import TrainingFolder
from tools.documentation.places import BUILD, DOCS, IMAGES, SHARED
from tools.documentation.runs import (
    PILOT_EPOCHS,
    Job,
    TimedJob,
    campaign_of,
    epoch_ends_s,
    sd2,
    settings,
    tables,
    timed,
    train,
)

MARS = (SHARED / "paired" / "mars_subject1", SHARED / "paired" / "mars_subject4")

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

The bundled one is measured in [denoiser.md](denoiser.md), which also says what the campaign is;
here the errors of its fits are as measured.
This page is made by

```
make denoiser-comparison
```

here with `--campaign-minutes {campaign_minutes:g} --minutes {minutes:g} --seeds {seeds}`, on
{machine}.
The people that are judged were seen neither in training nor in choosing the best epoch. What the
errors are is written in `sd2core/denoise/metrics.py`.

## Models at equal time

Every model trained from {seeds} seed(s), for {minutes:g} minutes of processor time each on
one thread, with a dropout of {dropout:g}. All have about as many parameters. Three
also learn from the maps of five parts of the body (`limbs`). A run of {pilot} epochs tells the
processor time of one, and so how many epochs fit: other work on the machine does not change what is
learnt.

{epochs}

{tables}
![Error of every model, per gesture and per person](images/denoiser-campaign.png)

Validation error of the same runs against the processor time they had trained:

![Validation error against training time](images/denoiser-curves.png)

### As long a step

The U-Net and the Swin transformer take longer for a step than the S4. With fewer channels, so that
a step takes as long (one run each):

{same_step}
{variants}{real}"""

VARIANTS = """\
### Variants of the S4

`s4-serial` is the paper's literal form, 2,304 samples of one channel; it had one epoch, which took
{serial_minutes:.1f} minutes of processor time.
`bidirectional` also looks ahead, as the U-Net and the Swin transformer do, and cannot run live.
Judged on the same takes.

{tables}
### Range synthesis

Input and target of a segment scaled together, as if the person were up to twice as near or as far
(`--range-factor 2`); everything else as the S4 above. The campaign itself has people at 1.5 to 4 m.
What learning from moved sensors gives (`--placements all`) is in
[range-synthesis.md](range-synthesis.md).

{range_tables}
"""

# At 10 frames/s the S4's steps are longer.
_REAL_S4 = ("s4", *settings({"dt_min": 0.2, "dt_max": 2.0}))
REAL_MODELS = {
    "s4-map": (*_REAL_S4, "--inputs", "map"),
    "s4-limbs": (*_REAL_S4, "--inputs", "limbs"),
    "s4-both-limbs": (*_REAL_S4, *settings({"bidirectional": "true"}), "--inputs", "limbs"),
    "gru-limbs": ("gru", "--inputs", "limbs"),
    "unet-limbs": ("unet", "--inputs", "limbs"),
}

REAL_HEAD = "## Real pairs\n"
REAL = """\

MARS: a body driven by a Kinect's skeleton, and what a real 77 GHz radar saw of the same person at
10 frames/s ([decision 27](decisions/0027-real-pairs.md); what the pairs are worth before denoising:
[real-pairs.md](real-pairs.md)). Every person is judged by models that have seen nothing of them:
they learn from the other person, whose last fifth of the takes chooses the best epoch. One learns
from the map, as in the paper, the others from the maps of five parts of the body (`limbs`: trunk,
upper arms, forearms, thighs, lower legs; [decision 52](decisions/0052-limb-maps.md)). As there are
3 to 8 minutes to learn from, batches are of 16 segments and the dropout is 0.3; the S4's steps are
longer; `bidirectional` looks ahead as well. What a linear map makes of the same pairs is in
[real-pairs.md](real-pairs.md).

This section alone is made by `python -m tools.documentation.denoiser_comparison --only-real`, here
with `--seeds {seeds} --real-minutes {real_minutes:g}`, on {machine}.

{tables}
"""


def main() -> None:
    """Make what is missing, measure everything and write the page."""
    options = _options()
    folder: Path = options.folder
    path = DOCS / "denoiser-comparison.md"
    if options.only_real:
        before = path.read_text("utf-8").partition(REAL_HEAD)[0]
        atomic_write_text(path, before + _real(folder, options))
        return
    campaign = campaign_of(folder, options.campaign_minutes, "--seed", 1, "--limbs")
    jobs = {name: _timed(folder, campaign, name, options) for name in ALL}
    compared = [jobs[name].seeded(seed) for seed in range(options.seeds) for name in COMPARED]
    alone = {name: jobs[name].seeded(0) for name in ALL if name not in COMPARED}
    # A pilot of several epochs would take longer than all runs of another model.
    alone[SERIAL] = TimedJob(_job(campaign, SERIAL, (SERIAL,)), math.nan, epochs=1).seeded(0)
    train(folder, [*compared, *alone.values()])
    _curves(folder, jobs, options.seeds)
    s4 = folder / jobs["s4"].seeded(0).name

    def beside(*names: str) -> str:
        return tables(folder, [s4, *(folder / alone[name].name for name in names)], campaign)

    runs = [folder / job.name for job in compared]
    page = PAGE.format(
        machine=this_machine(),
        campaign_minutes=options.campaign_minutes,
        seeds=options.seeds,
        minutes=options.minutes,
        dropout=DROPOUT,
        pilot=PILOT_EPOCHS,
        epochs=_epochs(jobs),
        same_step=beside("unet-step", "swin-step"),
        tables=tables(folder, runs, campaign, "--figure", IMAGES / "denoiser-campaign.png"),
        variants=VARIANTS.format(
            tables=beside("s4-both", SERIAL),
            serial_minutes=epoch_ends_s(folder / alone[SERIAL].name)[0] / 60.0,
            # Alone: beside the other one it would count as a second seed of it.
            range_tables=tables(folder, [folder / alone["s4-range"].name], campaign),
        ),
        real=_real(folder, options),
    )
    atomic_write_text(path, page)


def _timed(folder: Path, campaign: Path, name: str, options: argparse.Namespace) -> TimedJob:
    return timed(folder, _job(campaign, name, ALL[name]), options.minutes)


def _job(campaign: Path, name: str, model: tuple[str, ...]) -> Job:
    return Job(name, campaign, ("--model", *model, *settings({"dropout": DROPOUT})))


def _epochs(jobs: Mapping[str, TimedJob]) -> str:
    lines = ["| run | s per epoch | epochs |", "| --- | ---: | ---: |"]
    lines += [f"| {name} | {job.epoch_s:.1f} | {job.epochs} |" for name, job in jobs.items()]
    return "\n".join(lines)


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
                *("--model", *model, *settings({"dropout": 0.3}), "--batch-size", "16"),
                *("--validation-subjects", "none", "--test-subjects", judged),
            )
            job = timed(folder, Job(f"mars-{judged}-{name}", mars, how), options.real_minutes)
            runs.setdefault(judged, []).extend(map(job.seeded, range(options.seeds)))
    train(folder, [job for own in runs.values() for job in own])
    shown = [
        f"### Person {judged}\n\n"
        + tables(folder, [folder / job.name for job in own], mars, "--subjects", judged)
        for judged, own in runs.items()
    ]
    return REAL_HEAD + REAL.format(
        seeds=options.seeds,
        real_minutes=options.real_minutes,
        machine=this_machine(),
        tables="\n".join(shown),
    )


def _curves(folder: Path, jobs: Mapping[str, TimedJob], seeds: int) -> None:
    """Validation error of the map and of the peak velocity, against time."""
    figure = Figure(figsize=(9.6, 3.6), dpi=110, layout="constrained")
    axes = figure.subplots(1, 2)
    for colour, name in enumerate(COMPARED):
        for seed in range(seeds):
            run = TrainingFolder(folder / jobs[name].seeded(seed).name)
            epochs = [one for one in standing(read_events(run.progress)) if one["event"] == "epoch"]
            minutes = [event["epoch"] * jobs[name].epoch_s / 60 for event in epochs]
            for axis, part in zip(axes, ("validation_rmse", "validation_mae_mps"), strict=True):
                axis.plot(
                    minutes,
                    [event[part] for event in epochs],
                    color=f"C{colour}",
                    linewidth=1.0,
                    label=None if seed else name,
                )
    axes[0].set_ylabel("RMSE of compressed values")
    axes[1].set_ylabel("mean error of the peak velocity (m/s)")
    axes[0].legend(fontsize=8)
    for axis in axes:
        axis.set_yscale("log")
        axis.set_xlabel("minutes of training")
        axis.grid(alpha=0.25, which="both")
    save_figure(figure, IMAGES / "denoiser-curves.png")


if __name__ == "__main__":
    main()
