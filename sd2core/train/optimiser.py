"""AdamW in groups, and a learning rate that warms up and falls with the cosine."""

from __future__ import annotations

import math
from typing import Any

import torch

from sd2core.denoise.model import Denoiser
from sd2core.train.config import TrainingConfig


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
