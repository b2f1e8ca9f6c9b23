"""Clips whose classes can be told at once: each class is at a velocity of its own."""

from __future__ import annotations

import numpy as np
from classifiers import AXIS, CLASSES, NULLED, RATE_HZ

from sd2core.classify.data import Clip, ClipSet
from sd2core.maps import MapKind

BINS = (None, 24, 6)
"""Of each class; background shows noise."""


def clip_set(
    subjects: int,
    each: int,
    *,
    frames: int = 90,
    kinds: tuple[MapKind, ...] = ("simulated",),
    placements: int = 1,
    one_class: bool = False,
) -> ClipSet:
    """Every subject's movements; with ``one_class`` each holds one class alone."""
    rng = np.random.default_rng(0)
    clips = []
    for person in range(subjects):
        for number in range(each):
            label = np.repeat(rng.integers(0, 3, -(-frames // 15)), 15)[:frames]
            if one_class:
                label[:] = number % 3
            clips += [
                Clip(
                    f"s{person + 1:02d}",
                    f"take-{number:04d}",
                    kind,
                    _energies(rng, label, kind),
                    label.astype(np.int8),
                    placement,
                )
                for kind in kinds
                for placement in range(placements)
            ]
    return ClipSet(AXIS, NULLED, RATE_HZ, CLASSES, tuple(clips))


def _energies(rng: np.random.Generator, label: np.ndarray, kind: MapKind) -> np.ndarray:
    values = rng.exponential(0.0 if kind == "synthetic" else 1.0, (len(label), AXIS.bins))
    for number, place in enumerate(BINS):
        if place is not None:
            values[label == number, place] += 100.0
    values[:, list(NULLED)] = 0.0
    return values.astype(np.float32)
