"""Tables of trainings with known worth, as `sd2 classify table` makes them."""

from __future__ import annotations

import numpy as np

from sd2core.classify.comparison import Run, Table, TableOptions
from sd2core.classify.experiment import Condition, Network
from sd2core.classify.metrics import Score

CLASSES = ("background", "horizontal", "vertical")


def a_score(seed: int, right: int) -> Score:
    """As many frames of each class as `right` per cent are right, the rest drawn."""
    rng = np.random.default_rng(seed)
    wrong = rng.multinomial(100 - right, [0.4, 0.6], 3)
    frames = np.array([
        [right, *wrong[0]], [wrong[1][0], right, wrong[1][1]], [*wrong[2], right],
    ])  # fmt: skip
    return Score(CLASSES, frames, frames // 10, np.array([0.3]), 1)


def a_table(seeds: int = 3) -> Table:
    conditions = [
        Condition(network=Network("s4")),
        Condition(),
        Condition(added="synthetic"),
        Condition(added="denoised"),
        Condition(share=0.1),
        Condition(share=0.1, added="denoised"),
    ]
    worth = (95, 80, 82, 85, 60, 70)
    runs = tuple(
        Run(one, seed, ("s1",), {"horizontal": 10}, {}, a_score(seed, right + seed), None, 5, 0.1)
        for one, right in zip(conditions, worth, strict=True)
        for seed in range(seeds)
    )
    return Table(CLASSES, "simulated", TableOptions(seeds=seeds), runs, by_movement=False)
