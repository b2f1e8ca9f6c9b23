"""The same systems as recurrences: one frame, or a block of frames, at a time.

A bilinear step of a normal matrix less one of rank one is again of that form, Ā = D − q sᵀ, so a
step costs as much as one of a diagonal system. Ā is never diagonalised: its eigenvectors are as
ill-conditioned as those of HiPPO itself. State and arithmetic are in double precision, without
which Δ A would be lost in I + Δ A at small steps.
"""

from __future__ import annotations

from typing import NamedTuple

import torch
from torch import Tensor

from sd2core.denoise.ssm import StateMatrix, expm1_ratio

BLOCK = 32


class Recurrence(NamedTuple):
    """x′ = D x + v·drive, y = x·watch₀ + v·direct with v = (u, −x·watch₁).

    Everything is real, pairs (Re, Im) interleaved; N is twice the number of pairs and k is 2 for
    a system with a loop, otherwise 1.

    Attributes
    ----------
    poles : (H, 1, N/2) complex128
        D.
    watch : (H, N, k) float64
        What the state adds to this output, and what it feeds around the loop.
    drive : (H, k, N) float64
    direct : (H, k, 1) float64
    """

    poles: Tensor
    watch: Tensor
    drive: Tensor
    direct: Tensor

    def initial_state(self, batch: int) -> Tensor:
        """(H, batch, N) float64 of zeros."""
        channels, states, _ = self.watch.shape
        return self.watch.new_zeros(channels, batch, states)

    def step(self, signal: Tensor, state: Tensor) -> tuple[Tensor, Tensor]:
        """One frame: (H, B, 1) and (H, B, N) → (H, B, 1), next state; float64."""
        seen = torch.bmm(state, self.watch)  # (H, B, k)
        into = signal if seen.shape[-1] == 1 else torch.cat((signal, -seen[..., 1:]), -1)
        out = torch.baddbmm(seen[..., :1], into, self.direct)
        turned = _interleaved(torch.view_as_complex(state.unflatten(-1, (-1, 2))) * self.poles)
        return out, torch.baddbmm(turned, into, self.drive)


class Block(NamedTuple):
    """`BLOCK` frames of a recurrence in one.

    Attributes
    ----------
    response : (H, m, m)
        [j, l]: input j on output l.
    watch : (H, N, m)
        State on outputs.
    drive : (H, m, N)
        Inputs on the state after the block.
    across : (H, N, N)
        State on the state after the block.
    """

    response: Tensor
    watch: Tensor
    drive: Tensor
    across: Tensor

    def step(self, signal: Tensor, state: Tensor) -> tuple[Tensor, Tensor]:
        """(H, B, m) and (H, B, N) → (H, B, m), next state; float64."""
        out = torch.baddbmm(torch.bmm(signal, self.response), state, self.watch)
        return out, torch.baddbmm(torch.bmm(signal, self.drive), state, self.across)


def _interleaved(values: Tensor) -> Tensor:
    """(…, n) complex → (…, 2n) real."""
    return torch.view_as_real(values).flatten(-2)


def _twice_real(values: Tensor) -> Tensor:
    """The row that gives 2 Re Σ values x from an interleaved x."""
    return 2.0 * _interleaved(values.conj().resolve_conj())


def low_rank_recurrence(matrix: StateMatrix, C: Tensor, dt: Tensor, skip: Tensor) -> Recurrence:
    """Bilinear; `skip` (H,) is added to what passes at once. Shapes as `low_rank_kernel`."""
    dt = dt.double()[..., None]
    half = 0.5 * dt
    inverse = 1.0 / (1.0 - half * matrix.poles)
    C = C.to(torch.complex128)
    looped = matrix.low_rank * inverse
    around = half * (2.0 * (matrix.low_rank * looped).real.sum(-1, keepdim=True))
    fed_back = dt / (1.0 + around) * looped
    driven = dt * inverse * matrix.inputs
    heard = 2.0 * (looped * dt * matrix.inputs).real.sum(-1, keepdim=True)
    inputs = driven - 0.5 * heard * fed_back
    poles = 2.0 * inverse - 1.0
    return _recurrence(poles, C, (inputs, fed_back), (looped,), skip)


def diagonal_recurrence(A: Tensor, B: Tensor, C: Tensor, dt: Tensor, skip: Tensor) -> Recurrence:
    """Zero-order hold; shapes as `diagonal_kernel`."""
    dt = dt.double()[..., None]
    exponent = dt * A.to(torch.complex128)
    inputs = B * (dt * expm1_ratio(exponent))
    return _recurrence(torch.exp(exponent), C.to(torch.complex128), (inputs,), (), skip)


def _recurrence(
    poles: Tensor, C: Tensor, drives: tuple[Tensor, ...], loops: tuple[Tensor, ...], skip: Tensor
) -> Recurrence:
    direct = torch.stack([2.0 * (C * drive).real.sum(-1) for drive in drives], -1)  # (H, k)
    direct[:, 0] += skip.double()
    return Recurrence(
        poles[:, None],
        torch.stack([_twice_real(row) for row in (C * poles, *loops)], -1).contiguous(),
        torch.stack([_interleaved(drive) for drive in drives], 1),
        direct[..., None],
    )


def block_of(recurrence: Recurrence) -> Block:
    """`BLOCK` frames in one, by doubling."""
    channels, states, _ = recurrence.watch.shape
    unit = torch.eye(states, dtype=torch.float64, device=recurrence.watch.device)
    silence = recurrence.watch.new_zeros(channels, states, 1)
    watch, across = recurrence.step(silence, unit.expand(channels, states, states))
    response, drive = recurrence.step(
        recurrence.watch.new_ones(channels, 1, 1), recurrence.initial_state(1)
    )
    frames = 1
    while frames < BLOCK:
        later = torch.bmm(drive, watch)  # first half's inputs on the second half's outputs
        upper = torch.cat((response, later), 2)
        lower = torch.cat((torch.zeros_like(response), response), 2)
        response = torch.cat((upper, lower), 1)
        watch = torch.cat((watch, torch.bmm(across, watch)), 2)
        drive = torch.cat((torch.bmm(drive, across), drive), 1)
        across = torch.bmm(across, across)
        frames *= 2
    return Block(response, watch, drive, across)
