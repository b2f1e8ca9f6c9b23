"""Labels of frames, from labelled spans."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sd2core.labels.spans import Labels
from sd2core.timebase import frames_that_begin

BACKGROUND = "background"
"""Label of frames in which nothing is labelled; always label 0."""


def plain_name(label: str) -> str:
    """Return the label, or :data:`BACKGROUND` for other spellings of it (``Background``)."""
    return BACKGROUND if label.casefold() == BACKGROUND else label


def label_per_frame(
    labels: Labels, names: tuple[str, ...], times_s: NDArray[np.float64]
) -> NDArray[np.int16]:
    """Return the label of every frame: that of the span when it begins, 0 where there is none.

    Later spans lie over earlier ones; suggestions are left out. The first of the names is
    :data:`BACKGROUND`.
    """
    label = np.zeros(len(times_s), np.int16)
    for span in labels.decided:
        during = frames_that_begin(times_s, span.start_s, span.end_s)
        label[during] = names.index(plain_name(span.label))
    return label
