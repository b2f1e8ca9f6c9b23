"""Statistics of how maps scatter about a model's answer: a radar's, and drawn ones."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sd2core.denoise.files import load_model
from sd2core.denoise.live import TrainedDenoiser
from sd2core.denoise.texture import Texture
from sd2core.pairs.segments import LENGTH
from sd2core.pairs.store import Take, read_pairs
from tools.documentation.pages import table

Maps = list[NDArray[np.float32]]
_STRONG = 0.5
"""Quantile of the answers above which cells count."""


def texture_table(models: Mapping[str, tuple[Path, Path, str | None]]) -> str:
    """Statistics of a run's own radar and of maps drawn for it, of people it has not learnt from.

    ``models`` are a run, its pairs, and the subject judged; None: the run's test subjects. The law
    is fitted to the people that the run learnt from.
    """
    rows = [["maps", "cells that show", "dB from weak to strong", "change"]]
    for title, (run, data, judged) in models.items():
        model = load_model(run / "best.safetensors")
        known = model.card.about["subjects"]
        pairs = read_pairs(data)
        learnt = pairs.of(known["training"]).placements(first_only=True).takes
        answers = np.concatenate([_cut(_answer(model, take)) for take in learnt])
        texture = Texture.fitted(answers, np.concatenate([_cut(take.radar) for take in learnt]))
        assert texture is not None
        subjects = [judged] if judged else known["test"]
        takes = pairs.of(subjects).placements(first_only=True).takes
        counted = [n for n in range(model.card.axis.bins) if n not in model.card.null_bins]
        means = [_answer(model, take) for take in takes]
        drawn = [texture.drawn(mean, (0, number)) for number, mean in enumerate(means)]
        radar = [take.radar for take in takes]
        for name, maps in (("the radar's", radar), ("drawn", drawn), ("the mean", means)):
            statistics = _statistics(*([one[:, counted] for one in each] for each in (means, maps)))
            rows.append([f"{title}: {name}", *(f"{value:.2f}" for value in statistics)])
    return table(rows)


def _answer(model: TrainedDenoiser, take: Take) -> NDArray[np.float32]:
    return model.denoise_values(take.inputs(model.card.parts))


def _cut(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """Whole segments of 72 frames, (segments, 72, bins)."""
    whole = len(values) // LENGTH * LENGTH
    return values[:whole].reshape(-1, LENGTH, values.shape[1])


def _statistics(means: Maps, maps: Maps) -> tuple[float, float, float]:
    least = np.quantile(np.concatenate(means), _STRONG)
    ratios, changes = [], []
    shown = cells = 0
    for mean, values in zip(means, maps, strict=True):
        strong = mean > max(least, 0.0)
        shown, cells = shown + int((values > 0)[strong].sum()), cells + int(strong.sum())
        known = strong & (values > 0)
        ratios.append(values[known] / mean[known])
        both = known[1:] & known[:-1]
        one, other = values[1:][both], values[:-1][both]
        changes.append(np.abs(one - other) / (one + other))
    low, high = np.quantile(np.concatenate(ratios), [0.1, 0.9])
    change = float(np.concatenate(changes).mean())
    return shown / max(cells, 1), float(10.0 * np.log10(high / low)), change
