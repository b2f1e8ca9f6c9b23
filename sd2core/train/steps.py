"""Batches of a training in their order, and the optimiser that takes the steps."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import torch

from sd2core.denoise.model import Denoiser
from sd2core.train.config import TrainingConfig
from sd2core.train.data import Order, Windows


class Step(NamedTuple):
    """One batch: which segments, where each is cut, and how much nearer it is."""

    index: torch.Tensor  # (segments,) int64
    start: torch.Tensor  # (segments,) int64
    gain: torch.Tensor  # (segments,) float32, of power
    epoch: int
    number: int


class Steps:
    """Endless batches from a position on, given by ``epoch`` and ``step``.

    With several processes (``ranks``) each takes its share of every batch.
    """

    def __init__(
        self,
        order: Order,
        windows: Windows,
        epoch: int = 0,
        step: int = 0,
        rank: int = 0,
        ranks: int = 1,
    ) -> None:
        self._order, self._windows = order, windows
        self._epoch, self._step = epoch, step
        self._rank, self._ranks = rank, ranks

    def __iter__(self) -> Iterator[Step]:
        epoch, first = self._epoch, self._step
        while True:
            indices, gains, shares = self._order.epoch(epoch)
            starts = self._windows.places(indices, shares)
            for step in range(first, self._order.steps):
                rows = np.arange(self._order.segments)[self._order.part(step)]
                if self._ranks > 1:
                    # All have as many, as a mean over processes wants it.
                    each = -(-len(rows) // self._ranks)
                    rows = rows[(np.arange(each) * self._ranks + self._rank) % len(rows)]
                index, start, gain = (
                    torch.from_numpy(part[rows]) for part in (indices, starts, gains)
                )
                yield Step(index, start, gain, epoch, step)
            epoch, first = epoch + 1, 0


def optimiser_of(model: Denoiser, config: TrainingConfig) -> torch.optim.AdamW:
    """AdamW (I. Loshchilov and F. Hutter, ICLR 2019) in three groups.

    Matrices decay; vectors (biases, norms, gains) do not; parameters of state spaces do
    not either, and have a rate of their own: decay would pull time constants to one
    value, and a large step moves poles far (A. Gu et al., ICLR 2022, appendix D).
    Every group keeps its highest rate as ``peak_lr``.
    """
    ssm = {id(parameter) for parameter in model.ssm_parameters()}
    matrices, vectors, spaces = [], [], []
    for parameter in model.parameters():
        if id(parameter) in ssm:
            spaces.append(parameter)
        elif parameter.ndim > 1:
            matrices.append(parameter)
        else:
            vectors.append(parameter)
    groups: list[dict[str, Any]] = [
        {"params": matrices, "lr": config.learning_rate, "weight_decay": config.weight_decay},
        {"params": vectors, "lr": config.learning_rate, "weight_decay": 0.0},
        {"params": spaces, "lr": config.ssm_learning_rate, "weight_decay": 0.0},
    ]
    groups = [{**group, "peak_lr": group["lr"]} for group in groups if group["params"]]
    fused = all(parameter.is_floating_point() for parameter in model.parameters())
    return torch.optim.AdamW(groups, fused=fused)


def set_rate(optimiser: torch.optim.Optimizer, factor: float) -> float:
    """Set every group to a share of its highest rate; return the rate of the first."""
    for group in optimiser.param_groups:
        group["lr"] = factor * group["peak_lr"]
    return float(optimiser.param_groups[0]["lr"])
