"""Sums of powers, which every kernel is made of: k[l] = 2 Re Σₙ w[n] z[n]ˡ.

A plain Vandermonde product needs a power of every pole for every lag. Here l = i + m j, so that
zˡ = zⁱ (zᵐ)ʲ: some 2√L powers (baby steps i and giant steps j) and one real matrix product do
the same. Powers come from repeated squaring, which needs no logarithm and so allows z = 0.
"""

from __future__ import annotations

import math
from typing import Any

import torch
from torch import Tensor


def powers(base: Tensor, count: int) -> Tensor:
    """base⁰ … base^(count − 1) along a new axis before the last: (H, n) → (H, count, n)."""
    out = torch.empty(base.shape[0], count, base.shape[1], dtype=base.dtype, device=base.device)
    out[:, 0] = 1.0
    done, top = 1, base
    while done < count:
        more = min(done, count - done)
        torch.mul(out[:, :more], top[:, None], out=out[:, done : done + more])
        top = top * top
        done += more
    return out


def _steps(rows: int, length: int) -> tuple[int, int]:
    """Baby and giant steps: (rows + 1) products are made per giant step and one per baby step."""
    baby = min(length, max(1, round(math.sqrt((rows + 1) * length))))
    giant = -(-length // baby)
    return -(-length // giant), giant


def _real(values: Tensor) -> Tensor:
    """(…, n) complex → (…, 2n) real, without a copy."""
    return torch.view_as_real(values).flatten(-2)


class _PowerSums(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, poles: Tensor, weights: Tensor, length: int) -> Tensor:
        channels, rows, states = weights.shape
        baby, giant = _steps(rows, length)
        babies = powers(poles, baby)  # (H, m, n)
        giants = powers(babies[:, -1] * poles, giant)  # (H, J, n)
        scaled = (2.0 * weights)[:, :, None] * giants[:, None]  # (H, q, J, n)
        sums = torch.bmm(
            _real(scaled).view(channels, rows * giant, 2 * states),
            # Conjugated, so that a product of reals is the real part of the product.
            _real(babies.conj_physical()).transpose(1, 2),
        )
        ctx.save_for_backward(babies, giants, scaled)
        ctx.length = length
        return sums.view(channels, rows, giant * baby)[..., :length]

    @staticmethod
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor | None, Tensor | None, None]:
        babies, giants, scaled = ctx.saved_tensors
        channels, rows, giant, states = scaled.shape
        baby, length = babies.shape[1], ctx.length
        # The derivative by z needs Σ l g[l] zˡ⁻¹ = Σ (l + 1) g[l + 1] zˡ.
        both = gradient.new_zeros(channels, 2, rows, giant * baby)
        both[:, 0, :, :length] = gradient
        lags = torch.arange(1, length, dtype=gradient.dtype, device=gradient.device)
        torch.mul(gradient[..., 1:], lags, out=both[:, 1, :, : length - 1])
        left = both.view(channels, 2 * rows * giant, baby)
        folded = torch.bmm(left, _real(babies)).view(channels, 2, rows, giant, states, 2)
        folded = torch.view_as_complex(folded)  # sums of g zⁱ
        by_weights = 2.0 * (folded[:, 0] * giants[:, None]).sum(2)
        by_poles = (folded[:, 1] * scaled).sum((1, 2))
        return by_poles.conj(), by_weights.conj(), None


def power_sums(poles: Tensor, weights: Tensor, length: int) -> Tensor:
    """2 Re Σₙ weights[n] poles[n]ˡ for l = 0 … length − 1.

    Parameters
    ----------
    poles : (H, n) complex128
    weights : (H, q, n) complex128
        q sums share the powers of their poles.

    Returns
    -------
    (H, q, length) float64
    """
    sums: Tensor = _PowerSums.apply(poles, weights, length)
    return sums
