"""Makes ``range-synthesis.md``: ``make range-synthesis``, about half an hour.

Whether a denoiser profits from seeing each motion from several places. Campaign and runs
stay in ``build/range-synthesis`` (or ``--folder``); what is there is not made again.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from itertools import chain
from pathlib import Path
from typing import Any

from sd2core.accuracy.cache import this_machine
from sd2core.files.tables import markdown_table
from sd2core.pairs.store import read_pairs
from tools.documentation.measured import write_page
from tools.documentation.places import BUILD
from tools.documentation.runs import ERRORS, Job, campaign_of, errors_of, evaluated, settings, train

PLACES = 3

PAGE = """\
# Range synthesis: does a denoiser profit from moved sensors?

Does it help to learn from the same motions as seen from several places? On a **simulated** radar.
Made by

```sh
make range-synthesis
```

with `--minutes {minutes:g} --epochs {epochs} --seeds {seeds}`, on {machine}.

A campaign of {minutes:g} minutes of six people (`sd2 simulate campaign --sensors {places}`): every
take is seen from beside the camera, and from two more sensors 1.5 to 4 m away, up to 45° aside, 10°
below to 25° above; both maps are those of the moved sensor. An S4 (dropout 0.1) learns either from
the first sensor of each take (`--placements first`) or from all {places} (`--placements all`), with
{seeds} seeds and equally many steps ({epochs} epochs of all, {places} times as many of the first):
more to see of the same motions, not more time.

Judged where one person, of whom nothing was learnt, moves: {first_moving:,} frames beside the
camera, {all_moving:,} from all sensors. *None* is the synthetic map, *ridge* a linear filter;
*peak* is the velocity of the strongest bin, *mean* that of the whole column, *map* all cells. What
the last two rows differ by is to be held against ±, the standard deviation over seeds.

{table}

## What this cannot say

- Whether moved sensors help a real radar: the
  [simulation](decisions/0026-the-simulated-campaign.md) knows nothing of rooms or antennas.
- {seeds} seeds and one person: differences that small may be chance.
- What they do for a classifier is in [the gesture classifier](classifier.md).
"""


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
    evaluations = {
        (which, judged): evaluated(models, campaign, "--placements", judged)
        for which, models in runs.items()
        for judged in ("first", "all")
    }
    pairs = read_pairs(campaign)
    page = PAGE.format(
        minutes=pairs.placements(first_only=True).frames / pairs.frame_rate_hz / 60.0,
        epochs=options.epochs,
        seeds=options.seeds,
        machine=this_machine(),
        places=PLACES,
        **results(evaluations),
    )
    write_page("range-synthesis.md", page)


def results(evaluations: Mapping[tuple[str, str], Mapping[str, Any]]) -> dict[str, Any]:
    """Table and numbers of the page, from evaluations by what was learnt from and judged."""
    groups = {
        key: {"s4" if one["trained"] else one["name"]: one for one in told["groups"]}
        for key, told in evaluations.items()
    }
    head = [f"{place}: {name}" for place in ("beside", "all") for name in ERRORS.values()]
    rows = [["denoiser", *head]]
    for title, learnt, name in (
        ("none", "first", "none"),
        ("ridge", "first", "ridge"),
        ("S4, learnt from the first", "first", "s4"),
        ("S4, learnt from all", "all", "s4"),
    ):
        cells = (errors_of(groups[learnt, judged][name]) for judged in ("first", "all"))
        rows.append([title, *chain.from_iterable(cells)])
    return {
        "table": "\n".join(markdown_table(rows)),
        "first_moving": evaluations["first", "first"]["moving_frames"],
        "all_moving": evaluations["first", "all"]["moving_frames"],
    }


if __name__ == "__main__":
    main()
