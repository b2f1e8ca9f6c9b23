"""Where two people who labelled the same recording disagree, and what numbers of it mean."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sd2core.labels.agreement import Answer, held_labels
from sd2core.labels.spans import Span
from sd2core.mesh.presence import runs
from sd2core.timebase import Timebase

_WORDS = (
    (0.0, "less than by chance"),
    (0.2, "slight"),
    (0.4, "fair"),
    (0.6, "moderate"),
    (0.8, "substantial"),
)
"""J. R. Landis and G. G. Koch, "The measurement of observer agreement for categorical data",
Biometrics 33(1), 1977: upper ends, and what they call it. The steps are custom, not theory."""


@dataclass(frozen=True)
class Disagreement:
    """A stretch of frames in which two people say different things throughout.

    Parameters
    ----------
    start_s, end_s : float
    frames : int
    a, b : tuple of str
        What each says in most of its frames.
    """

    start_s: float
    end_s: float
    frames: int
    a: Answer
    b: Answer


def disagreements(
    a: Sequence[Span], b: Sequence[Span], timebase: Timebase
) -> tuple[Disagreement, ...]:
    """Stretches in which the labels of every frame differ, in order.

    Frames have the labels that hold when they appear, as in
    :func:`sd2core.labels.agreement.frame_agreement`.
    """
    labels = sorted({span.label for span in (*a, *b)})
    held = np.stack([held_labels(spans, labels, timebase) for spans in (a, b)])  # (2, labels, T)
    differs = (held[0] != held[1]).any(axis=0)
    found = []
    for start, stop in runs(differs):
        both = held[:, :, start:stop].reshape(-1, stop - start)
        answers, counts = np.unique(both, axis=1, return_counts=True)
        usual = answers[:, int(np.argmax(counts))].reshape(2, -1)
        said = [
            tuple(label for label, there in zip(labels, row, strict=True) if there) for row in usual
        ]
        end_s = timebase.time_of(stop) if stop < len(timebase) else timebase.end_s
        found.append(Disagreement(timebase.time_of(start), end_s, stop - start, said[0], said[1]))
    return tuple(found)


def kappa_words(kappa: float | None) -> str:
    """What a kappa is usually called."""
    if kappa is None:
        return "not defined: both say one and the same throughout"
    return next((words for high, words in _WORDS if kappa < high), "almost perfect")
