"""A classifier asked about labelled clips."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sd2core.classify.data import UNKNOWN, Clip, ClipSet
from sd2core.classify.live import TrainedClassifier
from sd2core.classify.metrics import Score, score
from sd2core.denoise import resample_to_model as matching
from sd2core.errors import Sd2Error


def judge(classifier: TrainedClassifier, clips: Sequence[Clip], known: ClipSet) -> Score:
    """Score a classifier on clips.

    Parameters
    ----------
    known : ClipSet
        What the clips are of.
    """
    card = classifier.card
    strange = [name for name in known.classes if name not in card.classes]
    if strange:
        raise Sd2Error(
            f"The data hold the class {', '.join(strange)}",
            f"classes that the classifier knows: {', '.join(card.classes)}",
        )
    if known.axis != card.axis or not set(known.null_bins) <= set(card.null_bins):
        raise Sd2Error(
            f"The maps have {known.axis.bins} bins up to ±{known.axis.v_max_mps:g} m/s, bins"
            f" {list(known.null_bins)} emptied",
            f"{card.axis.bins} bins up to ±{card.axis.v_max_mps:g} m/s, bins"
            f" {list(card.null_bins)} emptied, as the classifier knows them",
        )
    if abs(known.frame_rate_hz / card.frame_rate_hz - 1.0) > matching.SAME_RATE:
        raise Sd2Error(
            f"The maps have {known.frame_rate_hz:.4g} frames/s",
            f"{card.frame_rate_hz:.4g} frames/s, as the classifier knows them",
        )
    if not clips:
        raise Sd2Error("There is no clip to judge on", "at least one")
    table = np.array([*(card.classes.index(name) for name in known.classes), UNKNOWN])
    return score(
        [table[clip.label] for clip in clips],
        [classifier.probabilities_of(clip.energies).argmax(axis=1) for clip in clips],
        card.classes,
        known.frame_rate_hz,
        card.background,
        card.delay_s,
    )
