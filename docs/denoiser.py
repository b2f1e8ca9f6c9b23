"""Makes ``denoiser.md`` and its pictures: ``make denoiser``, hours.

Every figure is measured when this runs. Campaign, pairs and runs stay in
``build/denoiser`` (or ``--folder``); what is there is not made again, a run that was
broken off goes on. Runs are as many at once as the machine has cores, one thread each, and
each gets the same time. The real pairs are left out where the recordings are not there
(``SD2_SHARED_DATA``).
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from runs import Job, sd2, settings, tables, train

from sd2core.atomic import atomic_write_text
from sd2core.denoise.files import load_model
from sd2core.denoise.metrics import mean_velocity_error, peak_error, stands_out
from sd2core.denoise.registry import MODELS
from sd2core.denoise.registry import options as options_of
from sd2core.figure_files import save_figure
from sd2core.ladder.scene import this_machine
from sd2core.pairs import PairSet, read_pairs
from sd2core.resources import resource_path
from sd2core.simulate.campaign.takes import Campaign, TakeMaker, take_name
from sd2core.train.folder import RunFolder
from sd2core.train.progress import read_events, standing

DOCS = Path(__file__).resolve().parent
IMAGES = DOCS / "images"
SHARED = Path(os.environ.get("SD2_SHARED_DATA", DOCS.parent.parent / "shared" / "data"))
MARS = (SHARED / "paired" / "mars_subject1", SHARED / "paired" / "mars_subject4")

COMPARED = ("s4", "s4d", "gru", "unet", "swin")
DROPOUT = 0.1
SHOWN_FRAMES = 450
LIMIT_TAKES = 16

PAGE = """\
# The denoiser

What it makes of synthetic Doppler, measured. Made by

```
make denoiser
```

(or `python docs/denoiser.py --seeds 0` for the bundled model alone), here with
`--campaign-minutes {campaign_minutes} --minutes {minutes:g} --seeds {seeds}`, on {machine}.
The people that are judged were seen neither in training nor in choosing the best epoch. What the
errors are is written in `sd2core/denoise/metrics.py`; models and scaling are [decision
24](decisions/0024-scaling-and-models.md), the S4 itself [decision 23](decisions/0023-s4.md),
training [decision 25](decisions/0025-training-runs.md).

## The simulated campaign

`sd2 simulate campaign OUT --subjects 6 --minutes 90 --seed N` makes pairs without a radar: what a
**simulated** 60 GHz radar shows of people's true motion (the target), and the synthetic Doppler of
bodies that err as fits of videos were measured to err (the input). People of random shape swipe to
the right, left, down and up in random order, rest, do other things, or step to and fro, in takes of
15 s; each take has its own distance (1.5 to 4 m), heading, height of the camera, and errors of its
fit. With `--placements N` each take is also seen from N - 1 other ranges and angles (range
synthesis). Takes depend on seed, subject and number alone: a campaign that was stopped goes on and
comes out the same, and `--minutes` may be raised later. Split it by subject.

The input: a true motion with drawn errors of a fit, 5,000 vertices, counted as the paper's preset
counts them (exact visibility, smoothed), as a share of vertices × (2.2 m / R)⁴. The target: FMCW
samples of the true motion of a rough surface (1,229 vertices) with noise, rounding and static
clutter, through the chain of real captures, 12 looks averaged; a power of 1 is 1 m² rough surface
square on at 2.2 m; the mean noise is taken off, and what does not rise above it is zero. Bins 14 to
16 are empty in both.

The errors are not invented: `sd2 simulate fit-errors` measured them on the sixteen clips of
[fitting.md](fitting.md), fitted with the lifter that was bundled before ([decision
18](decisions/0018-the-temporal-lifter.md)). Bodies that are disturbed by them, scored as those fits
are, give: hands along the line of sight 0.31 m/s RMS (fits 0.24), correlation 0.92 (0.95), Doppler
maps of gestures
L1 0.51 (0.55). What is simulated and what is not (reflections in the room, glints, clothes, other
people, fits that lose the person) is [decision 26](decisions/0026-the-simulated-campaign.md).

## The bundled model

`resources/denoiser.safetensors`, an S4; its card (`sd2 info`) has command, data and limits. Judged
on the last person of {campaign_minutes} minutes of the campaign (seed 1), whom it has not seen:

{bundled}
Much of the error without denoising is that of frames in which the body merely sways: the radar's
strongest bin is then next to the emptied ones, and the synthetic map is empty. The rows per gesture
are free of that.

One take of that person; the radar is simulated:

![Synthetic, denoised and radar's map of one take](images/denoiser-triple.png)

What limits it, in {limit_takes} takes of that person. *The radar again* saw the same motion with
other noise and another rough surface: nothing that knows only the motion can be expected to do
better. *True motion* is the synthetic map of a body without the errors of a fit:

{limits}
{compared}"""

COMPARISON = """
## Models compared at equal time

Every model trained {seeds} times with different seeds for {minutes:g} minutes on one thread each,
as many at once as there are cores, with a dropout of {dropout:g}. All have about as many
parameters. Times are by the clock: beside other work a run makes fewer steps.

{tables}
![Error of every model, per gesture and per person](images/denoiser-campaign.png)

Validation error of the same runs against the time they had trained:

![Validation error against training time](images/denoiser-curves.png)

### As long a step

The U-Net and the Swin transformer take longer for a step than the S4. With fewer channels, so that
a step takes as long (one run each):

{same_step}
{variants}{real}"""

VARIANTS = """\
### Variants of the S4

`s4-serial` is the paper's literal form, 2,304 samples of one channel.
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

REAL = """\
## Real pairs

MARS: a body driven by a Kinect's skeleton, and what a real 77 GHz radar saw of the same person at
10 frames/s ([decision 27](decisions/0027-real-pairs.md); what the pairs are worth before denoising:
[real-pairs.md](real-pairs.md)). Each part is judged by models that have seen neither its person nor
its part; the last fifth of the takes they learn from chooses their best epoch. As there are 3 to 8
minutes to learn from, batches are of 16 segments and the dropout is 0.3; at 10 frames/s the S4's
steps are longer. These settings were found on 4-validate; the other parts were not looked at.

{tables}
"""


def main() -> None:
    """Make what is missing, measure everything and write the page."""
    options = _options()
    folder: Path = options.folder
    folder.mkdir(parents=True, exist_ok=True)
    campaign = options.campaign or _campaign(folder, options.campaign_minutes)
    pairs = read_pairs(campaign)
    bundled = resource_path("denoiser.safetensors")
    _triple(bundled, pairs)
    page = PAGE.format(
        limits=_limits(bundled, pairs),
        limit_takes=LIMIT_TAKES,
        machine=this_machine(),
        minutes=options.minutes,
        seeds=options.seeds,
        campaign_minutes=round(pairs.frames / pairs.frame_rate_hz / 60),
        bundled=tables(folder, [bundled], campaign),
        compared=_comparison(folder, campaign, options) if options.seeds else "",
    )
    atomic_write_text(DOCS / "denoiser.md", page)


def _comparison(folder: Path, campaign: Path, options: argparse.Namespace) -> str:
    """Everything that has to be trained first."""
    mars = _mars(folder)
    length = ("--minutes", f"{options.minutes:g}", *settings({"dropout": DROPOUT}))
    compared = [
        Job(f"{name}-{seed}", campaign, ("--model", name, "--seed", str(seed), *length))
        for seed in range(options.seeds)
        for name in options.models
    ]
    same_step = [
        Job(
            f"{name}-step",
            campaign,
            ("--model", name, *settings(options_of(name, "time")), *length),
        )
        for name in ("unet", "swin")
    ]
    ranged = Job("s4-range", campaign, ("--model", "s4", "--range-factor", "2", *length))
    variants = [
        Job("s4-both", campaign, ("--model", "s4", *length, *settings({"bidirectional": "true"}))),
        Job("s4-serial", campaign, ("--model", "s4-serial", *length)),
    ]
    real = _real_jobs(mars, options) if mars is not None else {}
    others = (job for jobs in real.values() for job in jobs)
    train(folder, [*compared, *same_step, *variants, ranged, *others])
    _curves(folder, compared)
    runs = [folder / job.name for job in compared]
    s4 = folder / "s4-0"
    small = [s4, *(folder / job.name for job in same_step)]
    varied = [s4, *(folder / job.name for job in variants)]
    return COMPARISON.format(
        seeds=options.seeds,
        minutes=options.minutes,
        dropout=DROPOUT,
        same_step=tables(folder, small, campaign),
        tables=tables(folder, runs, campaign, "--plot", IMAGES / "denoiser-campaign.png"),
        variants=VARIANTS.format(
            tables=tables(folder, varied, campaign),
            range_tables=tables(folder, [folder / ranged.name], campaign),
        ),
        real="" if mars is None else REAL.format(tables=_real_tables(folder, mars, real)),
    )


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--folder", type=Path, default=DOCS.parent / "build" / "denoiser")
    parser.add_argument("--campaign", type=Path, help="a campaign that is there already")
    parser.add_argument("--campaign-minutes", type=float, default=240, help="of all people")
    parser.add_argument("--minutes", type=float, default=20.0, help="of training, each run")
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--models", nargs="+", default=COMPARED, choices=MODELS)
    parser.add_argument("--real-minutes", type=float, default=1.5, help="of training, each run")
    return parser.parse_args()


def _campaign(folder: Path, minutes: float) -> Path:
    path = folder / "campaign.zarr"
    sd2("simulate", "campaign", path, "--subjects", 6, "--minutes", minutes, "--seed", 1)
    return path


def _mars(folder: Path) -> Path | None:
    if not all(part.exists() for part in MARS):
        return None
    path = folder / "mars.zarr"
    if not path.exists():
        sd2("pairs", "mars", *MARS, "--out", path)
    return path


def _real_jobs(mars: Path, options: argparse.Namespace) -> dict[str, list[Job]]:
    """For every part the runs that have seen neither its person nor its part."""
    jobs = {}
    everybody = read_pairs(mars).subjects
    for judged in everybody:
        others = [name for name in everybody if _strange(name, judged)]
        if not others:
            continue
        kept_out = [name for name in everybody if name not in others]
        jobs[judged] = [
            Job(
                f"mars-{judged}-{model}-{seed}",
                mars,
                (
                    *("--model", model, "--seed", str(seed), *settings({"dropout": 0.3, **given})),
                    *("--minutes", f"{options.real_minutes:g}", "--batch-size", "16"),
                    *("--validation-subjects", "none", "--test-subjects", ",".join(kept_out)),
                ),
            )
            for model, given in (("s4", {"dt_min": 0.2, "dt_max": 2.0}), ("gru", {}))
            for seed in range(options.seeds)
        ]
    return jobs


def _strange(name: str, judged: str) -> bool:
    """Whether two parts share neither person nor part, e.g. ``1-test`` and ``4-validate``."""
    return not set(name.split("-")) & set(judged.split("-"))


def _real_tables(folder: Path, mars: Path, jobs: dict[str, list[Job]]) -> str:
    return "\n".join(
        f"### {judged}\n\n"
        + tables(folder, [folder / job.name for job in parts], mars, "--subjects", judged)
        for judged, parts in jobs.items()
    )


def _curves(folder: Path, jobs: Sequence[Job]) -> None:
    """Validation error of the map and of the peak velocity, against time."""
    figure = Figure(figsize=(9.6, 3.6), dpi=110, layout="constrained")
    axes = figure.subplots(1, 2)
    names = list(dict.fromkeys(job.name.rpartition("-")[0] for job in jobs))
    for job in jobs:
        events = standing(read_events(RunFolder(folder / job.name).progress))
        epochs = [event for event in events if event["event"] == "epoch"]
        minutes = [event["elapsed_s"] / 60 for event in epochs]
        name, _, seed = job.name.rpartition("-")
        for axis, part in zip(axes, ("validation_rmse", "validation_mae_mps"), strict=True):
            axis.plot(
                minutes,
                [event[part] for event in epochs],
                color=f"C{names.index(name)}",
                linewidth=1.0,
                label=name if seed == "0" else None,
            )
    axes[0].set_ylabel("RMSE of compressed values")
    axes[1].set_ylabel("mean error of the peak velocity (m/s)")
    axes[0].legend(fontsize=8)
    for axis in axes:
        axis.set_yscale("log")
        axis.set_xlabel("minutes of training")
        axis.grid(alpha=0.25, which="both")
    save_figure(figure, IMAGES / "denoiser-curves.png")


def _limits(path: Path, pairs: PairSet) -> str:
    """Errors of what a denoiser could know, as a table."""
    model = load_model(path)
    campaign = Campaign(pairs.provenance["seed"], pairs.provenance["take_seconds"])
    maker = TakeMaker(campaign)
    by_name = {take.name: take for take in pairs.of(pairs.subjects[-1:]).takes}
    judged = [by_name[take_name(number)] for number in range(LIMIT_TAKES)]
    maps: dict[str, list[np.ndarray]] = {}
    for number, take in enumerate(judged):
        again = maker.make(len(pairs.subjects) - 1, number, look=1)[0]
        for name, values in (
            ("synthetic", take.synthetic),
            ("synthetic, denoised", model.denoise_values(take.synthetic)),
            ("synthetic of the true motion", again.synthetic),
            ("the same, denoised", model.denoise_values(again.synthetic)),
            ("the radar again", again.radar),
        ):
            maps.setdefault(name, []).append(values)
    radar = np.concatenate([take.radar for take in judged])
    moving = np.concatenate([stands_out(take.radar, pairs.null_bins) for take in judged])
    gesture = moving & np.concatenate([take.label > 0 for take in judged])
    lines = [
        "| map | peak MAE m/s | in gestures | mean MAE m/s |",
        "| --- | ---: | ---: | ---: |",
    ]
    for name, parts in maps.items():
        values = np.concatenate(parts)
        errors = (
            peak_error(values[moving], radar[moving], pairs.axis),
            peak_error(values[gesture], radar[gesture], pairs.axis),
            mean_velocity_error(values[moving], radar[moving], pairs.axis),
        )
        lines.append(f"| {name} | " + " | ".join(f"{one.mae_mps:.3f}" for one in errors) + " |")
    return "\n".join(lines)


def _triple(path: Path, pairs: PairSet) -> None:
    """The liveliest take of the last person, whom the model has not seen: in, out, target."""
    model = load_model(path)
    take = max(pairs.of(pairs.subjects[-1:]).takes, key=lambda take: int((take.label > 0).sum()))
    maps = {
        "synthetic": take.synthetic,
        f"denoised ({model.card.model})": model.denoise_values(take.synthetic),
        f"radar ({pairs.kind})": take.radar,
    }
    figure = Figure(figsize=(9.6, 5.2), dpi=110, layout="constrained")
    extent = (0.0, SHOWN_FRAMES / pairs.frame_rate_hz, -pairs.axis.v_max_mps, pairs.axis.v_max_mps)
    for axis, (name, values) in zip(figure.subplots(3, 1, sharex=True), maps.items(), strict=True):
        shown = values[:SHOWN_FRAMES].T
        level_db = 10 * np.log10(np.maximum(shown / shown.max(), 1e-4))
        picture = axis.imshow(
            level_db, origin="lower", aspect="auto", extent=extent, cmap="viridis", vmin=-30, vmax=0
        )
        axis.set_ylabel("m/s")
        axis.set_title(name, fontsize=9, loc="left")
    axis.set_xlabel("s")
    figure.colorbar(picture, ax=figure.axes, label="dB below each map's own strongest cell")
    save_figure(figure, IMAGES / "denoiser-triple.png")


if __name__ == "__main__":
    main()
