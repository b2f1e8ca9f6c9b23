"""Small classifiers and maps for tests."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from sd2core.classify.card import ClassifierCard
from sd2core.classify.defaults import FeatureKind
from sd2core.classify.features import Features
from sd2core.classify.live import TrainedClassifier
from sd2core.classify.models import build
from sd2core.maps import DopplerMap, MapKind
from sd2core.sensor import VelocityAxis
from sd2core.timebase import Timebase

CLASSES = ("background", "horizontal", "vertical")
AXIS = VelocityAxis(32, 2.0)
NULLED = (14, 15, 16)
RATE_HZ = 30.0
MAPS = AXIS, NULLED, RATE_HZ


def features(kind: FeatureKind = "columns", null_bins: tuple[int, ...] = NULLED) -> Features:
    return Features(kind, AXIS, null_bins, RATE_HZ)


def classifier(
    model: str = "lstm", kind: FeatureKind = "columns", seed: int = 0, **card: Any
) -> TrainedClassifier:
    shown = features(kind)
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        network = build(model, shown.size, len(CLASSES))
    if network.closed_form:  # There is nothing in it before.
        values, _ = shown.of(energies(300, seed=5))
        label = torch.arange(300) // 10 % len(CLASSES)
        network.fit([torch.from_numpy(values)], [label], torch.ones(len(CLASSES)), [1.0], seed)
    return TrainedClassifier(
        network, ClassifierCard(model, {}, *MAPS, kind, CLASSES, ("simulated",), **card)
    )


def energies(frames: int, seed: int = 0) -> NDArray[np.float32]:
    """Noise with a target that sweeps over the axis, (frames, bins)."""
    rng = np.random.default_rng(seed)
    values = rng.exponential(1.0, (frames, AXIS.bins))
    place = 16 + 12 * np.sin(np.arange(frames) / 7.0)
    values[np.arange(frames), place.astype(int)] += 200.0
    values[:, list(NULLED)] = 0.0
    return values.astype(np.float32)


def doppler(
    values: NDArray[np.float32],
    *,
    rate_hz: float = RATE_HZ,
    kind: MapKind = "simulated",
    present: NDArray[np.bool_] | None = None,
) -> DopplerMap:
    return DopplerMap(
        values.T,
        AXIS,
        Timebase.regular(len(values), rate_hz),
        kind,
        null_bins=NULLED,
        present=present,
    )
