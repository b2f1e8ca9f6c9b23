"""Operations of the S4 layers with derivatives of their own, each one step of autograd."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

import torch
from scipy.fft import next_fast_len
from torch import Tensor
from torch.nn import functional

_SMALLEST_VARIANCE = 1e-5


def normalise(signal: Tensor) -> tuple[Tensor, Tensor]:
    """Scale the channels of each frame to mean 0 and variance 1: (H, …) → (H, …).

    The signal is handed on beside the result: where it is used again, as a residual, both
    derivatives are then summed without another copy.
    """
    normalised, signal = _Normalise.apply(signal)
    return normalised, signal


class _Normalise(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, signal: Tensor) -> tuple[Tensor, Tensor]:
        normalised = signal - signal.mean(0)
        scale = normalised.square().mean(0).add_(_SMALLEST_VARIANCE).rsqrt_()
        normalised *= scale
        ctx.save_for_backward(normalised, scale)
        return normalised, signal.view_as(signal)

    @staticmethod
    def backward(ctx: Any, gradient: Tensor, passed: Tensor) -> Tensor:
        normalised, scale = ctx.saved_tensors
        back = gradient * normalised
        along = back.mean(0)
        torch.addcmul(gradient, normalised, along, value=-1.0, out=back)
        back -= gradient.mean(0)
        return torch.addcmul(passed, back, scale, out=back)


def convolution(signal: Tensor, kernel: Tensor, ahead: Tensor | None = None) -> Tensor:
    """Convolve every channel with its own kernel, by the cheaper of two methods.

    y[h, b, t] = Σ kernel[h, l] signal[h, b, t − l] for l = 0 … t, and with a kernel that looks
    ahead Σ ahead[h, l] signal[h, b, t + l] for l = 0 … L − 1 − t more.

    The signal and the result are (H, B, L), the kernels (H, L), all float32 or all float64.
    """
    _, signals, length = signal.shape
    short = length < _LONGEST_PRODUCT and signals >= _MIN_SIGNALS
    return (by_product if short else by_transform)(signal, kernel, ahead)


def by_product(signal: Tensor, kernel: Tensor, ahead: Tensor | None = None) -> Tensor:
    """Compute `convolution` by one matrix product per channel."""
    return _ByProduct.apply(signal, kernel, ahead)


def by_transform(signal: Tensor, kernel: Tensor, ahead: Tensor | None = None) -> Tensor:
    """Compute `convolution` by Fourier transforms padded so that nothing wraps around."""
    length = signal.shape[-1]
    points = next_fast_len(2 * length - 1, real=True)
    around = functional.pad(kernel, (0, points - length))
    if ahead is not None:  # lag −l is at the end
        lags = (ahead[:, :1], ahead.new_zeros(len(ahead), points - length), ahead[:, 1:].flip(-1))
        around = around + torch.cat(lags, -1)
    return _ByTransform.apply(signal, around)


# A matrix product does L² work per channel and signal but at the machine's full speed; measured
# in tests/benchmarks/test_state_space_speed.py.
_LONGEST_PRODUCT = 144
_MIN_SIGNALS = 16


def toeplitz(kernel: Tensor) -> Tensor:
    """Toeplitz matrices of kernels, (H, L) → (H, L, L): lag l at [j, j + l], 0 below."""
    channels, length = kernel.shape
    padded = functional.pad(kernel, (length - 1, 0))
    rising = padded.as_strided((channels, length, length), (2 * length - 1, 1, 1))
    return rising.flip(1)


def diagonal_sums(matrix: Tensor) -> Tensor:
    """Adjoint of `toeplitz`: (H, L, L) → (H, L), sums over [j, j + l]."""
    channels, length, _ = matrix.shape
    upper = (matrix * matrix.new_ones(length, length).triu()).contiguous()
    # One more in the row's stride turns diagonals into columns, which run on into the zeros of the
    # next row; the last row, which has none below it, adds its corner only.
    shape, stride = (channels, length - 1, length), (length * length, length + 1, 1)
    sums = upper.as_strided(shape, stride).sum(1)
    sums[:, 0] += upper[:, -1, -1]
    return sums


class _ByProduct(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, signal: Tensor, kernel: Tensor, ahead: Tensor | None) -> Tensor:
        matrix = toeplitz(kernel)
        if ahead is not None:
            matrix += toeplitz(ahead).transpose(1, 2)
        ctx.save_for_backward(signal, matrix)
        ctx.looks_ahead = ahead is not None
        return torch.bmm(signal, matrix)

    @staticmethod
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor, Tensor, Tensor | None]:
        signal, matrix = ctx.saved_tensors
        by_signal = torch.bmm(gradient, matrix.transpose(1, 2))
        by_matrix = torch.bmm(signal.transpose(1, 2), gradient)
        by_ahead = diagonal_sums(by_matrix.transpose(1, 2)) if ctx.looks_ahead else None
        return by_signal, diagonal_sums(by_matrix), by_ahead


class _ByTransform(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, signal: Tensor, around: Tensor) -> Tensor:
        length, points = signal.shape[-1], around.shape[-1]
        signal_spectrum = torch.fft.rfft(signal, n=points)
        kernel_spectrum = torch.fft.rfft(around)
        ctx.save_for_backward(signal_spectrum, kernel_spectrum)
        ctx.points = points
        return torch.fft.irfft(signal_spectrum * kernel_spectrum[:, None], n=points)[..., :length]

    @staticmethod
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor, Tensor]:
        signal_spectrum, kernel_spectrum = ctx.saved_tensors
        length = gradient.shape[-1]
        spectrum = torch.fft.rfft(gradient, n=ctx.points)
        by_signal = torch.fft.irfft(spectrum * kernel_spectrum.conj()[:, None], n=ctx.points)
        product = (spectrum * signal_spectrum.conj()).sum(1)
        return by_signal[..., :length], torch.fft.irfft(product, n=ctx.points)


def mix_gated(
    signal: Tensor, residual: Tensor, weight: Tensor, bias: Tensor, share: Tensor | None = None
) -> Tensor:
    """Gated linear unit with a residual, across the channels of each frame.

    Residual + a · sigmoid(b), where (a, b) = weight · gelu(signal) + bias. One step of autograd
    instead of six, and no copy made only to be differentiated.

    Parameters
    ----------
    signal, residual : (H, …)
        Contiguous; of one shape, which the result has.
    weight, bias : (2H, H) and (2H,)
        Rows of a, then those of b.
    share : optional
        Broadcast to the signal; multiplies what the activation lets through (dropout).
    """
    return _MixGated.apply(signal, residual, weight, bias, share)


class _MixGated(torch.autograd.Function):
    @staticmethod
    def forward(
        ctx: Any,
        signal: Tensor,
        residual: Tensor,
        weight: Tensor,
        bias: Tensor,
        share: Tensor | None,
    ) -> Tensor:
        channels = signal.shape[0]
        active = functional.gelu(signal)
        if share is not None:
            active *= share
        both = torch.addmm(bias[:, None], weight, active.view(channels, -1))
        values, gate = both[:channels], both[channels:].sigmoid_()
        ctx.save_for_backward(signal, active, weight, both, share)
        return torch.addcmul(residual, values.view_as(residual), gate.view_as(residual))

    @staticmethod
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor | None, ...]:
        signal, active, weight, both, share = ctx.saved_tensors
        channels = signal.shape[0]
        gradient = gradient.contiguous()
        values, gate = both[:channels], both[channels:]
        back = torch.empty_like(both)
        by_values = torch.mul(gradient.view_as(values), gate, out=back[:channels])
        by_gate = torch.mul(by_values, values, out=back[channels:])
        by_gate.addcmul_(by_gate, gate, value=-1.0)
        by_active = torch.mm(weight.t(), back).view_as(signal)
        if share is not None:
            by_active *= share
        torch.ops.aten.gelu_backward.grad_input(by_active, signal, grad_input=by_active)
        by_weight = torch.mm(back, active.view(channels, -1).t())
        return by_active, gradient, by_weight, back.sum(1), None


def nplr_terms(
    poles: Tensor, low_rank: Tensor, inputs: Tensor, outputs: Tensor, dt: Tensor
) -> tuple[Tensor, Tensor]:
    """Poles and weights of the four power series that the kernel of an NPLR matrix is made of.

    With R = 1 / (1 − Δ/2 λ), the poles are (1 + Δ/2 λ) R and the weights C (Δ B R), C (p R),
    Δ/2 p (Δ B R), Δ/2 p (p R). One step of autograd instead of some thirty.

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
    ratios, weights = _NplrTerms.apply(poles, low_rank, inputs, outputs, dt)
    return ratios, weights


class _NplrTerms(torch.autograd.Function):
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


def vandermonde_product(poles: Tensor, weights: Tensor, length: int) -> Tensor:
    """Product with a Vandermonde matrix, 2 Re Σₙ weights[n] poles[n]ˡ for l = 0 … length − 1.

    The plain product needs a power of every pole for every lag. Here l = i + m j, so that
    zˡ = zⁱ (zᵐ)ʲ: some 2√L powers (baby steps i and giant steps j) and one real matrix product do
    the same.

    Poles, (H, n), are shared by q sums with the weights (H, q, n), both complex128; the result is
    (H, q, length) float64.
    """
    return _VandermondeProduct.apply(poles, weights, length)


class _VandermondeProduct(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, poles: Tensor, weights: Tensor, length: int) -> Tensor:
        channels, rows, states = weights.shape
        baby, giant = _steps(rows, length)
        babies = powers(poles, baby)  # (H, m, n)
        giants = powers(babies[:, -1] * poles, giant)  # (H, J, n)
        scaled = (2.0 * weights)[:, :, None] * giants[:, None]  # (H, q, J, n)
        sums = torch.bmm(
            # Conjugated, so that a product of reals is the real part of the product.
            _real(scaled.conj_physical()).view(channels, rows * giant, 2 * states),
            _real(babies).transpose(1, 2),
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


# Products of small matrices are faster in whole tiles of a processor's registers.
_TILE = 12


def _steps(rows: int, length: int) -> tuple[int, int]:
    """Baby and giant steps: (rows + 1) products are made per giant step and one per baby step."""
    baby = min(length, max(1, round(math.sqrt((rows + 1) * length))))
    if baby > _TILE:
        baby = round(baby / _TILE) * _TILE
    return baby, -(-length // baby)


def powers(base: Tensor, count: int) -> Tensor:
    """Powers base⁰ … base^(count − 1) on a new axis before the last: (H, n) → (H, count, n).

    By repeated squaring, which needs no logarithm and so allows a base of 0.
    """
    out = torch.empty(base.shape[0], count, base.shape[1], dtype=base.dtype, device=base.device)
    out[:, 0] = 1.0
    done, top = 1, base
    while done < count:
        more = min(done, count - done)
        torch.mul(out[:, :more], top[:, None], out=out[:, done : done + more])
        top = top * top
        done += more
    return out


def _real(values: Tensor) -> Tensor:
    """(…, n) complex → (…, 2n) real, without a copy."""
    return torch.view_as_real(values).flatten(-2)


def woodbury_quotient(series: Tensor, points: int, radius: float) -> Tensor:
    """Power series of a − (1 + z) b c / (1 + (1 + z) d), from those of a, b, c, d.

    This is Woodbury's identity for the low-rank part of a state matrix. Dividing power series term
    by term takes L² steps, and on the unit circle the quotient wraps around. On a circle |z| =
    radius < 1 with a few points more than terms, what wraps around is damped to nothing. The
    division itself is harmless when d is positive real (Re d ≥ 0 for |z| ≤ 1), as it is when the
    loop comes from P (…)⁻¹ P*: then |1 + (1 + z) d| has no zero there.

    ``series``, (H, 4, L) float64, holds a, b, c, d already damped: term l times radiusˡ. Points and
    radius are those of `damping_circle`. The result, (H, L) float64, is not damped.
    """
    return _WoodburyQuotient.apply(series, points, radius)


# A series is divided on a circle of this many points per term, of a radius that damps what
# wraps around by `_WRAPPED`; what is left over of 53 bits after undoing the damping is then
# 1e-16 / 1e-8 (single) and 1e-16 / 1e-4.3 (double).
_POINTS = {torch.float32: 1.25, torch.float64: 3.0}
_WRAPPED = {torch.float32: 1e-9, torch.float64: 1e-13}


def damping_circle(length: int, precision: torch.dtype) -> tuple[int, float]:
    """Points and radius with which `woodbury_quotient` is right to `precision`."""
    points = next_fast_len(int(_POINTS[precision] * length) + 1, real=True)
    return points, float(_WRAPPED[precision] ** (1.0 / points))


@lru_cache(maxsize=32)
def _constants(
    points: int, radius: float, length: int, device: torch.device
) -> tuple[Tensor, Tensor]:
    # 1 + z on the upper half of the circle, complex128, and radius⁻ˡ, float64.
    with torch.inference_mode(False):
        angle = torch.arange(points // 2 + 1, dtype=torch.float64, device=device)
        angle = angle * (-2.0 * torch.pi / points)
        ahead = torch.complex(1.0 + radius * torch.cos(angle), radius * torch.sin(angle))
        lags = torch.arange(length, dtype=torch.float64, device=device)
        return ahead, torch.pow(radius, -lags)


class _WoodburyQuotient(torch.autograd.Function):
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


def held_exponential(exponent: Tensor) -> tuple[Tensor, Tensor]:
    """Compute exp(x), and (exp(x) − 1) / x, which is 1 at x = 0; complex128."""
    grown, held = _HeldExponential.apply(exponent)
    return grown, held


# Below this a quotient that cancels gives way to its series; above, two digits are lost at most,
# and four of the derivative.
_SERIES_BELOW = 1e-2


class _HeldExponential(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, x: Tensor) -> tuple[Tensor, Tensor]:
        grown = torch.exp(x)
        small = x.abs() < _SERIES_BELOW
        series = 1.0 + x / 2 * (1.0 + x / 3 * (1.0 + x / 4 * (1.0 + x / 5 * (1.0 + x / 6))))
        held = torch.where(small, series, (grown - 1.0) / x)
        ctx.save_for_backward(x, grown, held, small)
        return grown, held

    @staticmethod
    def backward(ctx: Any, by_grown: Tensor, by_held: Tensor) -> Tensor:
        x, grown, held, small = ctx.saved_tensors
        series = 1 / 2 + x * (1 / 3 + x * (1 / 8 + x * (1 / 30 + x / 144)))
        steeper = torch.where(small, series, (grown - held) / x)
        return by_grown * grown.conj() + by_held * steeper.conj()
