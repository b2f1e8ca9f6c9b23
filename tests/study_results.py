"""Results of studies with known worth."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from sd2core.classify.metrics import Score
from sd2core.study.folds import Fold
from sd2core.study.plan import Learner, StudyPlan
from sd2core.study.run import Results
from sd2core.study.trial import REAL, Run, Task

CLASSES = ("background", "horizontal", "vertical")
FULL: Mapping[str, int] = {REAL: 80, "synthetic": 82, "denoised": 85}
FEW: Mapping[str, int] = {REAL: 60, "synthetic": 60, "denoised": 70}
"""Per cent of frames found, with all and with few real data."""
S4 = Learner(model="s4", delay_s=0.0)


def a_score(seed: int, right: int) -> Score:
    """As many frames of each class as `right` per cent are right, the rest drawn."""
    rng = np.random.default_rng(seed)
    wrong = rng.multinomial(100 - right, [0.4, 0.6], 3)
    frames = np.array([
        [right, *wrong[0]], [wrong[1][0], right, wrong[1][1]], [*wrong[2], right],
    ])  # fmt: skip
    return Score(CLASSES, frames, frames // 10, np.array([0.3]), 1)


def some_results(out: Path, seeds: int = 3, kind: str = "simulated") -> Results:
    """Two people, two shares, three seeds; each seed finds one per cent more."""
    plan = StudyPlan(
        title="Swipes", out=str(out), data=("x.zarr",), shares=(0.1, 1.0), seeds=seeds,
        added=("synthetic", "denoised"), classifiers=(Learner(), S4), turns="once",
    )  # fmt: skip
    runs = []
    for share, worth in ((0.1, FEW), (1.0, FULL)):
        own = {**worth, S4.title: 95} if share == 1.0 else worth
        for judged, other in (("anna", "ben"), ("ben", "anna")):
            for seed in range(seeds):
                task = Task(Fold(judged, "", (other,)), share, seed)
                scores = {name: a_score(seed, right + seed) for name, right in own.items()}
                takes = {
                    name: {f"{judged}/t{take}": ((right + seed) / 100.0, right / 100.0)
                           for take in range(4)}
                    for name, right in own.items()
                }  # fmt: skip
                runs.append(Run(task, round(1000 * share), takes, scores, {}))
    subject_of = {f"{who}/t{take}": who for who in ("anna", "ben") for take in range(4)}
    return Results(plan, kind, CLASSES, subject_of, 0, tuple(runs))
