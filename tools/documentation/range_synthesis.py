"""Makes ``range-synthesis.md``: ``make range-synthesis``, about half an hour.

Whether a denoiser profits from seeing each motion from several places. Campaign and runs
stay in ``build/range-synthesis`` (or ``--folder``); what is there is not made again.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import chain
from typing import Any

from sd2core.pairs.store import read_pairs
from tools.documentation.pages import page_parser, table, write_filled
from tools.documentation.runs import ERRORS, Job, campaign_of, errors_of, evaluated, settings, train

PLACES = 3


def main() -> None:
    """Make what is missing, measure and write the page."""
    parser = page_parser(__doc__, "range-synthesis")
    parser.add_argument("--minutes", type=float, default=24.0, help="of all people")
    parser.add_argument("--epochs", type=int, default=80, help="of all sensors")
    parser.add_argument("--seeds", type=int, default=2)
    options = parser.parse_args()
    folder = options.folder
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
    write_filled(
        "range-synthesis.md",
        minutes=pairs.placements(first_only=True).frames / pairs.frame_rate_hz / 60.0,
        epochs=options.epochs,
        seeds=options.seeds,
        places=PLACES,
        **results(evaluations),
    )


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
        "table": table(rows),
        "first_moving": evaluations["first", "first"]["moving_frames"],
        "all_moving": evaluations["first", "all"]["moving_frames"],
    }


if __name__ == "__main__":
    main()
