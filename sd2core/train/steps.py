"""Batches of a training in their order, and the optimiser that takes the steps."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray

from sd2core.denoise.model import Denoiser
from sd2core.options.training import TrainingConfig
from sd2core.train.data import Windows

_RANGE_LAW = 4.0
"""Echo power falls with the fourth power of the range (radar equation)."""


class Batch(NamedTuple):
    """Starts of the segments of one batch, and how much nearer each is."""

    start: torch.Tensor  # (segments,) int64
    gain: torch.Tensor  # (segments,) float32, of power

    def on(self, device: torch.device) -> Batch:
        """Copy on a device."""
        return Batch(*(each.to(device, non_blocking=True) for each in self))


class Batches:
    """Batches of every epoch, each in an order that depends on seed and epoch alone.

    Parameters
    ----------
    windows : Windows
    size : int
        Segments of a batch; the last one of an epoch may be smaller.
    seed : int
    range_factor : float
        Gains are drawn for ranges up to this factor nearer or farther.
    rank, ranks : int
        Number of this process, and of all, each of which takes its share of every batch.
    """

    def __init__(
        self, windows: Windows, size: int, seed: int, range_factor: float = 1.0,
        rank: int = 0, ranks: int = 1,
    ) -> None:  # fmt: skip
        self.steps = -(-len(windows) // size)  # of an epoch
        self._windows, self._size, self._seed, self._factor = windows, size, seed, range_factor
        self._rank, self._ranks = rank, ranks
        self._epoch, self._drawn = -1, (np.zeros(0, np.int64), np.zeros(0, np.float32))

    def at(self, epoch: int, step: int) -> Batch:
        """Batch of a step of an epoch, both from 0."""
        if epoch != self._epoch:
            self._epoch, self._drawn = epoch, self._draw(epoch)
        begin = step * self._size
        parts = [each[begin : begin + self._size] for each in self._drawn]
        if self._ranks > 1:
            # All have as many, as a mean over processes wants it.
            count = len(parts[0])
            own = np.arange(-(-count // self._ranks)) * self._ranks + self._rank
            parts = [part[own % count] for part in parts]
        return Batch(*map(torch.from_numpy, parts))

    def _draw(self, epoch: int) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
        """Starts and gains of all segments, in the order of an epoch."""
        rng, count = np.random.default_rng([self._seed, epoch]), len(self._windows)
        indices = rng.permutation(count)
        gains = self._factor ** (-_RANGE_LAW * rng.uniform(-1.0, 1.0, count))
        starts = self._windows.places(indices, rng.uniform(0.0, 1.0, count))
        return starts, gains.astype(np.float32)


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


def rate_factor(done: float, warm_up: float, final: float) -> float:
    """Share of the highest learning rate when the share ``done`` (0 to 1) of the run is done.

    It rises linearly from zero during the share ``warm_up`` and falls to ``final`` at the
    end, with half a cosine.
    """
    if done < warm_up:
        return done / warm_up
    angle = math.pi * min(1.0, (done - warm_up) / max(1.0 - warm_up, 1e-9))
    return final + (1.0 - final) * 0.5 * (1.0 + math.cos(angle))
