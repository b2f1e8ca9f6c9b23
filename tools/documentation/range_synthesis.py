"""Makes ``range-synthesis.md``: ``make range-synthesis``, about half an hour.

Whether a denoiser profits from seeing each motion from several places. Campaign and runs
stay in ``build/range-synthesis`` (or ``--folder``); what is there is not made again.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from sd2core.accuracy.cache import this_machine
from sd2core.files.atomic import atomic_write_text
from sd2core.pairs.store import read_pairs
from tools.documentation.places import BUILD, DOCS
from tools.documentation.runs import Job, campaign_of, settings, tables, train

PLACES = 3

PAGE = """\
# Range synthesis: does a denoiser profit from moved sensors?

Made by

```
make range-synthesis
```

here with `--minutes {minutes:g} --epochs {epochs} --seeds {seeds}`, on {machine}.

A **simulated** campaign of {minutes:g} minutes of six people (`sd2 simulate campaign
--sensors {places}`): every take is seen from beside the camera, and from two more sensors at
other ranges (1.5 to 4 m), up to 45° aside, 10° below to 25° above. Synthetic Doppler and simulated
radar are both those of the moved sensor.

An S4 (dropout 0.1) learns either from the first sensor of each take alone (`--placements first`)
or from all {places} (`--placements all`), {seeds} times each with other seeds. Both make the same
number of steps: {epochs} epochs of all sensors, or {places} times as many of the first ones. So
*all* means more to see of the same motions, not more time. Judged are takes of a person nobody has
learnt from.

## Judged beside the camera

As the first sensor sees them. Learnt from the first sensors:

{first_first}
Learnt from all sensors:

{all_first}
## Judged at all sensors

The same takes from all {places} sensors. Learnt from the first sensors:

{first_all}
Learnt from all sensors:

{all_all}"""


def main() -> None:
    """Make what is missing, measure and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--folder", type=Path, default=BUILD / "range-synthesis")
    parser.add_argument("--minutes", type=float, default=24.0, help="of all people")
    parser.add_argument("--epochs", type=int, default=80, help="of all sensors")
    parser.add_argument("--seeds", type=int, default=2)
    options = parser.parse_args()
    folder: Path = options.folder
    campaign = campaign_of(folder, options.minutes, "--seed", 3, "--sensors", PLACES)
    jobs = {
        which: [
            Job(
                f"s4-{which}-{seed}",
                campaign,
                (
                    *("--model", "s4", "--seed", str(seed), "--placements", which),
                    *("--epochs", str(epochs), *settings({"dropout": 0.1})),
                ),
            )
            for seed in range(options.seeds)
        ]
        for which, epochs in (("first", PLACES * options.epochs), ("all", options.epochs))
    }
    train(folder, [job for runs in jobs.values() for job in runs])
    runs = {which: [folder / job.name for job in those] for which, those in jobs.items()}
    pairs = read_pairs(campaign)
    page = PAGE.format(
        minutes=pairs.placements(first_only=True).frames / pairs.frame_rate_hz / 60.0,
        epochs=options.epochs,
        seeds=options.seeds,
        machine=this_machine(),
        places=PLACES,
        first_first=tables(folder, runs["first"], campaign),
        all_first=tables(folder, runs["all"], campaign),
        first_all=tables(folder, runs["first"], campaign, "--placements", "all"),
        all_all=tables(folder, runs["all"], campaign, "--placements", "all"),
    )
    atomic_write_text(DOCS / "range-synthesis.md", page)


if __name__ == "__main__":
    main()
