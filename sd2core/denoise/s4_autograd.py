"""Poles and weights of the four power series that a low-rank kernel is made of."""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor


class _LowRankTerms(torch.autograd.Function):
    @staticmethod
    def forward(
        ctx: Any, poles: Tensor, low_rank: Tensor, inputs: Tensor, outputs: Tensor, dt: Tensor
    ) -> tuple[Tensor, Tensor]:
        half = 0.5 * dt
        ahead = half * poles
        inverse = 1.0 / (1.0 - ahead)
        looped = low_rank * inverse
        driven = (dt * inputs) * inverse
        fed = half * low_rank
        weights = torch.empty(
            poles.shape[0], 4, poles.shape[1], dtype=poles.dtype, device=poles.device
        )
        for row, (left, right) in enumerate(
            ((outputs, driven), (outputs, looped), (fed, driven), (fed, looped))
        ):
            torch.mul(left, right, out=weights[:, row])
        ctx.save_for_backward(poles, low_rank, inputs, outputs, dt, inverse, looped, driven)
        return (1.0 + ahead) * inverse, weights

    @staticmethod
    def backward(ctx: Any, by_ratio: Tensor, by_weights: Tensor) -> tuple[Tensor, ...]:
        poles, low_rank, inputs, outputs, dt, inverse, looped, driven = ctx.saved_tensors
        half = 0.5 * dt
        fed = half * low_rank
        # All of it conjugated, and turned back at the end: autograd's convention is the conjugate.
        by_ratio = by_ratio.conj_physical()
        direct, leaving, entering, around = by_weights.conj_physical().unbind(1)
        # Through what is driven (Δ B R) and what is looped (p R), R being the inverse.
        by_outputs = direct * driven + leaving * looped
        by_driven = direct * outputs + entering * fed
        by_looped = leaving * outputs + around * fed
        by_fed = (entering * driven + around * looped).real
        by_given = by_driven * inverse  # by Δ B
        by_inverse = by_driven * (dt * inputs) + by_looped * low_rank
        # The ratio (1 + x) / (1 − x) changes as 2 R², and R as R².
        by_ahead = (2.0 * by_ratio + by_inverse) * (inverse * inverse)
        by_low_rank = (by_looped * inverse).real + half * by_fed
        by_half = (by_ahead * poles).real + low_rank * by_fed
        by_dt = (by_given * inputs).real + 0.5 * by_half
        return (
            (half * by_ahead).conj(),
            by_low_rank,
            (dt * by_given).conj(),
            by_outputs.conj(),
            by_dt.sum(-1, keepdim=True),
        )


def low_rank_terms(
    poles: Tensor, low_rank: Tensor, inputs: Tensor, outputs: Tensor, dt: Tensor
) -> tuple[Tensor, Tensor]:
    """Ratios (1 + Δ/2 λ) R, and C (Δ B R), C (p R), Δ/2 p (Δ B R), Δ/2 p (p R).

    R = 1 / (1 − Δ/2 λ). One step of autograd instead of some thirty.

    Parameters
    ----------
    poles, inputs, outputs : (H, n) complex128
        Λ, B, C.
    low_rank : (H, n) float64
        p.
    dt : (H, 1) float64
        Δ.

    Returns
    -------
    (H, n) and (H, 4, n) complex128
    """
    ratios, weights = _LowRankTerms.apply(poles, low_rank, inputs, outputs, dt)
    return ratios, weights
