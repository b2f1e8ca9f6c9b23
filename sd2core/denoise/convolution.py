"""Causal convolution of many channels, each with its own kernel, by the cheaper of two ways."""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor

from sd2core.denoise.feedback import fast_length

# A matrix product does L² work per channel and signal but at the machine's full speed; measured
# in tests/benchmarks/test_state_space_speed.py.
_LONGEST_PRODUCT = 144
_FEWEST_SIGNALS = 16


def toeplitz(kernel: Tensor) -> Tensor:
    """(H, L) → (H, L, L): from lag l at [j, j + l], 0 below the diagonal."""
    channels, length = kernel.shape
    padded = torch.nn.functional.pad(kernel, (length - 1, 0))
    rising = padded.as_strided((channels, length, length), (2 * length - 1, 1, 1))
    return rising.flip(1)


def diagonal_sums(matrix: Tensor) -> Tensor:
    """The adjoint of `toeplitz`: (H, L, L) → (H, L), sums over [j, j + l]."""
    channels, length, _ = matrix.shape
    padded = torch.nn.functional.pad(matrix, (0, length))
    # One more in the row's stride turns diagonals into columns.
    skewed = padded.as_strided((channels, length, length), (2 * length * length, 2 * length + 1, 1))
    return skewed.sum(1)


class _ByProduct(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, signal: Tensor, kernel: Tensor) -> Tensor:
        matrix = toeplitz(kernel)
        ctx.save_for_backward(signal, matrix)
        return torch.bmm(signal, matrix)

    @staticmethod
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor, Tensor]:
        signal, matrix = ctx.saved_tensors
        by_signal = torch.bmm(gradient, matrix.transpose(1, 2))
        by_kernel = diagonal_sums(torch.bmm(signal.transpose(1, 2), gradient))
        return by_signal, by_kernel


class _ByTransform(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, signal: Tensor, kernel: Tensor) -> Tensor:
        length = signal.shape[-1]
        points = fast_length(2 * length - 1)
        signal_spectrum = torch.fft.rfft(signal, n=points)
        kernel_spectrum = torch.fft.rfft(kernel, n=points)
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
        by_kernel = torch.fft.irfft(product, n=ctx.points)
        return by_signal[..., :length], by_kernel[..., :length]


def by_product(signal: Tensor, kernel: Tensor) -> Tensor:
    """As `causal_convolution`, by one matrix product per channel."""
    convolved: Tensor = _ByProduct.apply(signal, kernel)
    return convolved


def by_transform(signal: Tensor, kernel: Tensor) -> Tensor:
    """As `causal_convolution`, by Fourier transforms padded so that nothing wraps around."""
    convolved: Tensor = _ByTransform.apply(signal, kernel)
    return convolved


def causal_convolution(signal: Tensor, kernel: Tensor) -> Tensor:
    """y[h, b, t] = Σ kernel[h, l] signal[h, b, t − l] for l = 0 … t.

    Parameters
    ----------
    signal : (H, B, L) float32 or float64
    kernel : (H, L), of the same type

    Returns
    -------
    (H, B, L)
    """
    _, signals, length = signal.shape
    short = length < _LONGEST_PRODUCT and signals >= _FEWEST_SIGNALS
    return by_product(signal, kernel) if short else by_transform(signal, kernel)
