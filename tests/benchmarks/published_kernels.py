"""Kernels of state spaces computed as published, to be compared with: complex64, as usual.

Written from the papers: S4 by its algorithm 1 (Cauchy products of nodes and poles), S4D by its
listing (a Vandermonde product). What depends on the length alone (nodes, C (I − Āᴸ)) is not
counted, as there it is worked out once.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn

from sd2core.denoise.s4_kernel import legs_state_matrix


def leaf(values: Tensor) -> nn.Parameter:
    """Complex numbers as two reals, which is what optimisers know."""
    real = torch.view_as_real(values.resolve_conj()) if values.is_complex() else values
    return nn.Parameter(real.detach().clone())


class PublishedLegs:
    """Normal plus low rank, bilinear: one row of poles per channel, everything learned."""

    def __init__(self, channels: int, state_size: int, length: int) -> None:
        first = legs_state_matrix(state_size)

        def rows(values: Tensor) -> Tensor:
            return leaf(values.to(torch.complex64).expand(channels, -1))

        self.log_decay = leaf(torch.full((channels, state_size // 2), 0.5).log())
        self.frequency = leaf(first.poles.imag.float().expand(channels, -1))
        self.P, self.B = rows(first.low_rank), rows(first.inputs)
        self.C = leaf(torch.randn(channels, state_size // 2, dtype=torch.complex64))
        self.log_dt = leaf(torch.empty(channels).uniform_(-6.9, -2.3))
        self.length = length
        omega = torch.exp(torch.arange(length // 2 + 1) * torch.tensor(-2j * torch.pi / length))
        self.nodes = (2 * (1 - omega) / (1 + omega)).to(torch.complex64)
        self.ahead = (2 / (1 + omega)).to(torch.complex64)
        self.learned = [self.log_decay, self.frequency, self.P, self.B, self.C, self.log_dt]

    def kernel(self) -> Tensor:
        dt = self.log_dt.exp()
        poles = torch.complex(-self.log_decay.exp(), self.frequency) * dt[:, None]
        P, B, C = (torch.view_as_complex(values) for values in (self.P, self.B, self.C))
        rows = torch.stack((C, P.conj()))
        columns = torch.stack((B, P))
        products = rows[:, None] * columns[None]  # (2, 2, H, N / 2)
        products = torch.cat((products, products.conj()), -1)
        poles = torch.cat((poles, poles.conj()), -1)
        cauchy = (products[..., None] / (self.nodes - poles[..., None])).sum(-2)
        cauchy = cauchy * dt[:, None]
        looped = cauchy[0, 1] * cauchy[1, 0] / (1 + cauchy[1, 1])
        return torch.fft.irfft((cauchy[0, 0] - looped) * self.ahead, n=self.length)


class PublishedDiagonal:
    """Diagonal, zero-order hold."""

    def __init__(self, channels: int, state_size: int, length: int) -> None:
        pairs = state_size // 2
        self.log_decay = leaf(torch.full((channels, pairs), 0.5).log())
        self.frequency = leaf((torch.pi * torch.arange(pairs)).expand(channels, -1))
        self.C = leaf(torch.randn(channels, pairs, dtype=torch.complex64))
        self.log_dt = leaf(torch.empty(channels).uniform_(-6.9, -2.3))
        self.lags = torch.arange(length)
        self.learned = [self.log_decay, self.frequency, self.C, self.log_dt]

    def kernel(self) -> Tensor:
        A = torch.complex(-self.log_decay.exp(), self.frequency)
        exponent = A * self.log_dt.exp()[:, None]
        held = torch.view_as_complex(self.C) * (torch.exp(exponent) - 1.0) / A
        powers = torch.exp(exponent[..., None] * self.lags)
        return 2 * torch.einsum("hn,hnl->hl", held, powers).real


class PublishedLayer(nn.Module):
    """Around a kernel what is usual: transforms, skip, activation, gated mixing, norm."""

    def __init__(self, kernel: PublishedLegs | PublishedDiagonal, channels: int) -> None:
        super().__init__()
        self.made = kernel.kernel
        self.learned = nn.ParameterList(kernel.learned)
        self.skip = nn.Parameter(torch.randn(channels))
        self.mixing = nn.Conv1d(channels, 2 * channels, 1)
        self.norm = nn.LayerNorm(channels)

    def forward(self, x: Tensor) -> Tensor:
        signal = x.transpose(1, 2)  # (B, H, L)
        length = signal.shape[-1]
        spectrum = torch.fft.rfft(signal, n=2 * length) * torch.fft.rfft(self.made(), n=2 * length)
        seen = torch.fft.irfft(spectrum, n=2 * length)[..., :length]
        seen = nn.functional.gelu(seen + self.skip[:, None] * signal)
        return self.norm(x + nn.functional.glu(self.mixing(seen), 1).transpose(1, 2))
