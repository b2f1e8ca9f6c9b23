"""One loop closed around power series: what the low-rank part of a state matrix does."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import torch
from torch import Tensor

# A series is divided on a circle of this many points per term, of a radius that damps what
# wraps around by `_WRAPPED`; what is left over of 53 bits after undoing the damping is then
# 1e-16 / 1e-8 (single) and 1e-16 / 1e-4.3 (double).
_POINTS = {torch.float32: 1.25, torch.float64: 3.0}
_WRAPPED = {torch.float32: 1e-9, torch.float64: 1e-13}


def fast_length(least: int) -> int:
    """The next number with no prime factor above 5, where FFTs are fast."""
    number = least
    while True:
        rest = number
        for prime in (2, 3, 5):
            while rest % prime == 0:
                rest //= prime
        if rest == 1:
            return number
        number += 1


def circle(length: int, precision: torch.dtype) -> tuple[int, float]:
    """Points and radius with which `close_loop` is right to `precision`."""
    points = fast_length(int(_POINTS[precision] * length) + 1)
    return points, float(_WRAPPED[precision] ** (1.0 / points))


@lru_cache(maxsize=32)
def _constants(
    points: int, radius: float, length: int, device: torch.device
) -> tuple[Tensor, Tensor]:
    """1 + z on the upper half of the circle, complex128, and radius⁻ˡ, float64."""
    with torch.inference_mode(False):
        angle = torch.arange(points // 2 + 1, dtype=torch.float64, device=device)
        angle = angle * (-2.0 * torch.pi / points)
        ahead = torch.complex(1.0 + radius * torch.cos(angle), radius * torch.sin(angle))
        lags = torch.arange(length, dtype=torch.float64, device=device)
        return ahead, torch.pow(radius, -lags)


class _CloseLoop(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, series: Tensor, points: int, radius: float) -> Tensor:
        length = series.shape[-1]
        outer = torch.fft.rfft(series[:, 1:], n=points)  # (H, 3, M/2 + 1)
        leaving, entering, around = outer.unbind(1)
        ahead, growth = _constants(points, radius, length, series.device)
        gain = ahead / (1.0 + ahead * around)
        gained = entering * gain
        closed = torch.fft.irfft(leaving * gained, n=points)[:, :length]
        ctx.save_for_backward(leaving, gained, gain, growth)
        ctx.points = points
        return (series[:, 0] - closed) * growth

    @staticmethod
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor, None, None]:
        leaving, gained, gain, growth = ctx.saved_tensors
        length = gradient.shape[-1]
        direct = gradient * growth
        spectrum = torch.fft.rfft(direct, n=ctx.points)
        left = leaving * gain
        back = torch.stack((-gained, -left, left * gained), 1).conj() * spectrum[:, None]
        loops = torch.fft.irfft(back, n=ctx.points)[..., :length]
        return torch.cat((direct[:, None], loops), 1), None, None


def close_loop(series: Tensor, points: int, radius: float) -> Tensor:
    """The power series a − (1 + z) b c / (1 + (1 + z) d), from those of a, b, c, d.

    Dividing power series term by term takes L² steps, and on the unit circle the quotient wraps
    around. On a circle |z| = radius < 1 with a few points more than terms, what wraps around is
    damped to nothing. The division itself is harmless when d is positive real (Re d ≥ 0 for
    |z| ≤ 1), as it is when the loop comes from P (…)⁻¹ P*: then |1 + (1 + z) d| has no zero there.

    Parameters
    ----------
    series : (H, 4, L) float64
        a, b, c, d, already damped: term l times radiusˡ.
    points, radius
        From `circle`.

    Returns
    -------
    (H, L) float64, not damped.
    """
    closed: Tensor = _CloseLoop.apply(series, points, radius)
    return closed
