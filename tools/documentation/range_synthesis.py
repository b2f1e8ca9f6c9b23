"""Makes ``range-synthesis.md``: ``make range-synthesis``, about half an hour.

Whether a denoiser profits from seeing each motion from several places. Campaign and runs
stay in ``build/range-synthesis``; what is there is not made again.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import chain
from typing import Any

from sd2core.pairs.store import read_pairs
from tools.documentation.measured import BUILD, table, write_filled
from tools.documentation.runs import ERRORS, Job, campaign_of, errors_of, evaluated, settings, train

FOLDER = BUILD / "range-synthesis"
PLACES = 3
SEEDS, EPOCHS, MINUTES = 2, 80, 24.0
"""Trainings of each kind, epochs of all sensors, and minutes of all people."""


def main() -> None:
    """Make what is missing, measure and write the page."""
    campaign = campaign_of(FOLDER, MINUTES, "--seed", 3, "--sensors", PLACES)
    runs = {}
    for which, epochs in (("first", PLACES * EPOCHS), ("all", EPOCHS)):
        how = ("--model", "s4", *settings({"dropout": 0.1}), "--placements", which)
        runs[which] = train(FOLDER, Job(f"s4-{which}", campaign, how).seeds(SEEDS, epochs))
    evaluations = {
        (which, judged): evaluated(models, campaign, "--placements", judged)
        for which, models in runs.items()
        for judged in ("first", "all")
    }
    pairs = read_pairs(campaign)
    write_filled(
        "range-synthesis.md",
        minutes=pairs.placements(first_only=True).frames / pairs.frame_rate_hz / 60.0,
        epochs=EPOCHS,
        seeds=SEEDS,
        places=PLACES,
        **results(evaluations),
    )


def results(evaluations: Mapping[tuple[str, str], Mapping[str, Any]]) -> dict[str, Any]:
    """Table and numbers of the page, from evaluations by what was learnt from and judged."""
    groups = {
        key: {"s4" if one["trained"] else one["name"]: one for one in evaluation["groups"]}
        for key, evaluation in evaluations.items()
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
