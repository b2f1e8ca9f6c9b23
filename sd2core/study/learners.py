"""Classifiers of a study behind one call: scores of all classes in every frame of a map."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sd2core.classify.data import Clip, ClipSet, frame_counts
from sd2core.classify.training import TrainOptions, train
from sd2core.study.plan import Learner
from sd2core.study.windows import Features, Ridge, window_features

Scores = NDArray[np.floating]
"""(frames, classes)."""
Describe = Callable[[Clip], Features]


def describing(learner: Learner, known: ClipSet) -> Describe:
    """Return what ridge regression is shown of a clip; the caller may keep it."""

    def describe(clip: Clip) -> Features:
        return window_features(clip.energies, known.axis, known.frame_rate_hz, learner.window_s)

    return describe


def learnt(
    learner: Learner,
    known: ClipSet,
    real: Sequence[Clip],
    added: Sequence[Clip],
    added_weight: float,
    seed: int,
    describe: Describe,
) -> Callable[[Clip], Scores]:
    """Learn from real and added clips, and return what scores another one.

    Parameters
    ----------
    learner : Learner
    known : ClipSet
        Classes, axis and frame rate of the clips.
    real, added : sequence of Clip
    added_weight : float
        All added frames together weigh this many times as much as all real ones.
    seed : int
        Of a network's training; ridge regression has none.
    describe : callable
        Of :func:`describing`; only ridge regression is shown it.
    """
    clips = [*real, *added]
    counts = [int(frame_counts(part, len(known.classes)).sum()) for part in (real, added)]
    heavy = added_weight * counts[0] / max(counts[1], 1)
    weights = [1.0] * len(real) + [heavy] * len(added)
    if learner.model == "ridge":
        ridge = Ridge.fitted(clips, weights, len(known.classes), describe)
        return lambda clip: ridge.scores(describe(clip))
    options = TrainOptions(
        model=learner.model,
        features=learner.features,
        delay_s=learner.delay_s,
        options={"width": learner.width},
        seed=seed,
    )
    if learner.steps is not None:
        options = replace(options, steps=learner.steps)
    made = train(clips, (), known, options, weights=weights if added else None)
    return lambda clip: made.classifier.probabilities_of(clip.energies)
