"""State spaces as recurrences: one frame, or a block of frames, at a time.

A bilinear step of a normal matrix less one of rank one is again of that form, Ā = D − q sᵀ, so a
step costs as much as one of a diagonal system. Ā is never diagonalised: its eigenvectors are as
ill-conditioned as those of HiPPO itself. State and arithmetic are in double precision, without
which Δ A would be lost in I + Δ A at small steps.
"""

from __future__ import annotations

from typing import NamedTuple

import torch
from torch import Tensor

from sd2core.denoise.s4_functions import held_exponential
from sd2core.denoise.s4_kernel import StateMatrix

BLOCK = 64


class Recurrence(NamedTuple):
    """Discretised state spaces that advance by one frame.

    y = x·w + D u, x′ = Λ̄ x + (u, −x·s) (B̄, q).

    Everything but the poles is real, pairs (Re, Im) interleaved; N is twice the number of pairs and
    k is 2 for a system with a loop, otherwise 1.
    """

    poles: Tensor  # Λ̄, the diagonal of Ā; (H, 1, N/2) complex128.
    # w, what the state adds to this output (C Ā), and −s, what it feeds around the loop; (H, N, k).
    watch: Tensor
    drive: Tensor  # B̄ and q; (H, k, N).
    direct: Tensor  # D and what passes the state at once, C B̄; (H, 1).

    def initial_state(self, batch: int) -> Tensor:
        """Zero state, (H, batch, N) float64."""
        channels, states, _ = self.watch.shape
        return self.watch.new_zeros(channels, batch, states)

    def step(self, signal: Tensor, state: Tensor) -> tuple[Tensor, Tensor]:
        """Advance by one frame: (H, B) and (H, B, N) → (H, B), next state; all float64."""
        seen = torch.bmm(state, self.watch)  # (H, B, k)
        out = torch.addcmul(seen[..., 0], signal, self.direct)
        into = signal[..., None]
        if seen.shape[-1] > 1:
            into = torch.cat((into, seen[..., 1:]), -1)
        turned = torch.view_as_complex(state.view(*state.shape[:2], -1, 2)) * self.poles
        return out, torch.baddbmm(torch.view_as_real(turned).flatten(2), into, self.drive)


class Block(NamedTuple):
    """Recurrence that advances by `BLOCK` frames at once."""

    response: Tensor  # [j, l]: input j on output l; (H, m, m).
    watch: Tensor  # State on outputs; (H, N, m).
    drive: Tensor  # Inputs on the state after the block; (H, m, N).
    across: Tensor  # State on the state after the block; (H, N, N).

    def run(self, signal: Tensor, state: Tensor) -> tuple[Tensor, Tensor]:
        """Advance by whole blocks: (H, B, n m) and (H, B, N) → (H, B, n m), next state; float64.

        Only the states follow one from the other; the rest is computed for all blocks at once.
        """
        channels, batch, frames = signal.shape
        states = state.shape[-1]
        blocks = signal.reshape(channels, -1, BLOCK)  # (H, B n, m)
        into = torch.bmm(blocks, self.drive).view(channels, batch, -1, states)
        before = []
        for added in into.unbind(2):
            before.append(state)
            state = torch.baddbmm(added, state, self.across)
        seen = torch.stack(before, 2).view(channels, -1, states)
        out = torch.baddbmm(torch.bmm(blocks, self.response), seen, self.watch)
        return out.view(channels, batch, frames), state


def nplr_recurrence(matrix: StateMatrix, C: Tensor, dt: Tensor, skip: Tensor) -> Recurrence:
    """Bilinear recurrence of an NPLR matrix, see :func:`~sd2core.denoise.s4_kernel.nplr_kernel`.

    Parameters
    ----------
    matrix : StateMatrix
        Learned, or HiPPO-LegS; (H, N/2), or (N/2,) for all channels.
    C : (H, N/2) complex64 or complex128
        In the basis of ``matrix``.
    dt : (H,) float
        Δ.
    skip : (H,) float
        D.
    """
    dt = dt.double()[..., None]
    half = 0.5 * dt
    inverse = 1.0 / (1.0 - half * matrix.poles)
    C = C.to(torch.complex128)
    looped = matrix.low_rank * inverse
    fed_back = dt / (1.0 + half * _sum(matrix.low_rank * looped)) * looped
    inputs = dt * inverse * matrix.inputs - half * _sum(looped * matrix.inputs) * fed_back
    poles = (1.0 + half * matrix.poles) * inverse
    return _recurrence(poles, C, inputs, skip, (looped, fed_back))


def diagonal_recurrence(A: Tensor, B: Tensor, C: Tensor, dt: Tensor, skip: Tensor) -> Recurrence:
    """Zero-order-hold recurrence of a diagonal matrix.

    Parameters
    ----------
    A, B, C : (H, N/2) complex64 or complex128
        As for :func:`~sd2core.denoise.s4_kernel.diagonal_kernel`.
    dt : (H,) float
        Δ.
    skip : (H,) float
        D.
    """
    dt = dt.double()[..., None]
    grown, held = held_exponential(dt * A.to(torch.complex128))
    inputs = B * (dt * held)
    return _recurrence(grown, C.to(torch.complex128), inputs, skip, None)


def _recurrence(
    poles: Tensor, C: Tensor, inputs: Tensor, skip: Tensor, loop: tuple[Tensor, Tensor] | None
) -> Recurrence:
    # `loop` holds s and q.
    direct = skip.double()[:, None] + _sum(C * inputs)
    onwards = C * poles
    watch, drive = [onwards], [inputs]
    if loop is not None:
        heard, fed_back = loop
        watch = [onwards - _sum(C * fed_back) * heard, -heard]
        drive = [inputs, fed_back]
    return Recurrence(
        poles[:, None],
        torch.stack([2.0 * _interleaved(row.conj().resolve_conj()) for row in watch], -1),
        torch.stack([_interleaved(row) for row in drive], 1),
        direct,
    )


def _sum(values: Tensor) -> Tensor:
    """Sum over conjugate pairs, (H, N/2) → (H, 1) real."""
    return 2.0 * values.real.sum(-1, keepdim=True)


def _interleaved(values: Tensor) -> Tensor:
    """Interleave real and imaginary parts, (…, n) → (…, 2n)."""
    return torch.view_as_real(values).flatten(-2)


def block_of(recurrence: Recurrence) -> Block:
    """Combine `BLOCK` frames of a recurrence into one step, by doubling."""
    channels, states, _ = recurrence.watch.shape
    unit = torch.eye(states, dtype=torch.float64, device=recurrence.watch.device)
    silence = recurrence.watch.new_zeros(channels, states)
    watch, across = recurrence.step(silence, unit.expand(channels, -1, -1).contiguous())
    pulse = recurrence.watch.new_ones(channels, 1)
    response, drive = recurrence.step(pulse, recurrence.initial_state(1))
    watch, response = watch[..., None], response[..., None]  # (H, N, 1), (H, 1, 1)
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
