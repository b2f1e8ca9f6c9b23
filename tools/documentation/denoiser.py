"""Makes ``denoiser.md`` and its picture: ``make denoiser``, half an hour for the campaign.

Every figure is measured when this runs. The campaign stays in ``build/denoiser`` (or
``--folder``); what is there is not made again.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from sd2core.accuracy.cache import this_machine
from sd2core.denoise.files import load_model
from sd2core.denoise.metrics import mean_velocity_error, peak_error, stands_out
from sd2core.files.atomic import atomic_write_text
from sd2core.files.figure_files import save_figure
from sd2core.files.resources import resource_path
from sd2core.pairs.store import PairSet, read_pairs
from sd2core.simulate.campaign.takes import Campaign, TakeMaker, take_name
from tools.documentation.places import BUILD, DOCS, IMAGES
from tools.documentation.runs import campaign_of, tables

SHOWN_FRAMES = 450
LIMIT_TAKES = 16

PAGE = """\
# The denoiser

What it makes of synthetic Doppler, measured. Made by

```
make denoiser
```

here with `--minutes {minutes}`, on {machine}. Models beside each other, and real radar, are in
[denoiser-comparison.md](denoiser-comparison.md).
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

The errors are not invented: `python -m tools.fitting errors` measured them on the sixteen clips of
[fitting.md](fitting.md). Bodies that are disturbed by them, scored as those fits are, give: hands
along the line of sight 0.31 m/s RMS (fits 0.22), correlation 0.91 (0.96), Doppler maps of gestures
L1 0.50 (0.48). What is simulated and what is not (reflections in the room, glints, clothes, other
people, fits that lose the person) is [decision 26](decisions/0026-the-simulated-campaign.md).

## The bundled model

`resources/denoiser.safetensors`, an S4; its card (`sd2 info`) has command, data and limits. Judged
on the last person of {minutes} minutes of the campaign (seed 1), whom it has not seen:

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
"""


def main() -> None:
    """Make what is missing, measure everything and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--folder", type=Path, default=BUILD / "denoiser")
    parser.add_argument("--minutes", type=float, default=168, help="of all people")
    options = parser.parse_args()
    campaign = campaign_of(options.folder, options.minutes, "--seed", 1)
    pairs = read_pairs(campaign)
    bundled = resource_path("denoiser.safetensors")
    _triple(bundled, pairs)
    page = PAGE.format(
        limits=_limits(bundled, pairs),
        limit_takes=LIMIT_TAKES,
        machine=this_machine(),
        minutes=f"{options.minutes:g}",
        bundled=tables(options.folder, [bundled], campaign),
    )
    atomic_write_text(DOCS / "denoiser.md", page)


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
