"""Statistics of how maps scatter about a model's answer: a radar's, and drawn ones."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sd2core.denoise.files import load_model
from sd2core.files.tables import markdown_table
from sd2core.pairs.store import read_pairs

Maps = list[NDArray[np.float32]]
_STRONG = 0.5
"""Quantile of the answers above which cells count."""


def texture_table(models: Mapping[str, tuple[Path, Path, str | None]]) -> str:
    """Statistics of a run's own radar and of maps drawn for it, of people it has not learnt from.

    ``models`` are a run, its pairs, and the subject judged; None: the run's test subjects.
    """
    rows = [["maps", "cells that show", "power over its mean", "neighbouring frames"]]
    for title, (run, data, judged) in models.items():
        model = load_model(run / "best.safetensors")
        texture = model.card.needed_texture()
        subjects = [judged] if judged else model.card.about["subjects"]["test"]
        takes = read_pairs(data).of(subjects).placements(first_only=True).takes
        counted = [n for n in range(model.card.axis.bins) if n not in model.card.null_bins]
        means = [model.denoise_values(take.inputs(model.card.parts)) for take in takes]
        drawn = [texture.drawn(mean, (0, number)) for number, mean in enumerate(means)]
        radar = [take.radar for take in takes]
        for name, maps in (("the radar's", radar), ("drawn", drawn), ("the mean", means)):
            found = _statistics(*([one[:, counted] for one in each] for each in (means, maps)))
            rows.append([f"{title}: {name}", *(f"{value:.2f}" for value in found)])
    return "\n".join(markdown_table(rows))


def _statistics(means: Maps, maps: Maps) -> tuple[float, float, float]:
    least = np.quantile(np.concatenate(means), _STRONG)
    off, pairs = [], []
    shown = cells = 0
    for mean, values in zip(means, maps, strict=True):
        strong = mean > max(least, 0.0)
        shown, cells = shown + int((values > 0)[strong].sum()), cells + int(strong.sum())
        ratio = np.divide(values, mean, out=np.zeros_like(mean), where=strong)
        off.append(ratio[strong & (values > 0)])
        both = strong[1:] & strong[:-1]
        pairs.append(np.sqrt(np.stack([ratio[1:][both], ratio[:-1][both]])))
    together = np.concatenate(pairs, axis=1)
    relative = np.concatenate(off)
    likeness = np.corrcoef(together)[0, 1] if together.std() > 1e-6 else 1.0
    return shown / max(cells, 1), float(relative.std() / relative.mean()), float(likeness)
