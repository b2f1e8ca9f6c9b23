"""Learned state spaces of an S4 layer, with their kernel and their recurrence."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any, Literal

import torch
from torch import Tensor, nn

from sd2core.denoise.s4_kernel import (
    StateMatrix,
    diagonal_kernel,
    legs_kernel,
    legs_state_matrix,
    to_normal_basis,
)
from sd2core.denoise.s4_recurrence import (
    Block,
    Recurrence,
    block_of,
    diagonal_recurrence,
    nplr_recurrence,
)
from sd2core.errors import Sd2Error

Kernel = Literal["legs", "diagonal"]

# Poles stay at least this far left of the imaginary axis, whatever is learned.
SLOWEST_DECAY = 1e-4
# exp(±100) and its square are still numbers in double precision.
LARGEST_LOG = 100.0
STEP_RANGE = (1e-7, 1e2)
DT_MIN, DT_MAX = 0.02, 1.0
# Of longer kernels all layers' intermediate results together would leave the processor's cache.
LONGEST_JOINED = 400
MAX_KEPT = 8


class Keeping(nn.Module):
    """Module that keeps what follows from its parameters alone, until one of them changes."""

    def __init__(self) -> None:
        super().__init__()
        self._kept: dict[int | str, Any] = {}
        self._made_of: list[Tensor] = []

    def learning(self) -> bool:
        """Whether the parameters may be about to change, so that nothing is kept."""
        return self.training or torch.is_grad_enabled()

    def keep(self, key: int | str, make: Callable[[], Any]) -> Any:
        """Give what was made under a key, or make it."""
        if self.learning():
            return make()
        now = [*self._parameters.values()]
        if len(self._kept) > MAX_KEPT or not _are_equal(self._made_of, now):
            self._kept, self._made_of = {}, [one.detach().clone() for one in now]
        if key not in self._kept:
            self._kept[key] = make()
        return self._kept[key]

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_kept": {}, "_made_of": []}


def _are_equal(some: Sequence[Tensor], others: Sequence[Tensor]) -> bool:
    """True for tensors of the same kind, place and numbers, none of which is NaN."""
    return len(some) == len(others) and all(
        one.dtype == other.dtype and one.device == other.device and torch.equal(one, other)
        for one, other in zip(some, others, strict=True)
    )


class StateSpace(Keeping):
    """Learned state spaces of H channels, with their kernel and their recurrence.

    Learned per channel: the step Δ (as its logarithm), the poles Λ (the decay as the logarithm of
    what exceeds `SLOWEST_DECAY`, and the frequency), the output C and the skip D; with "legs" also
    the low-rank vector p (real, without loss: the phases of the basis are free) and the input B.
    A = Λ − p pᵀ then has every eigenvalue left of −`SLOWEST_DECAY`, whatever is learned, because
    its Hermitian part has. "diagonal" has no p, and B = 1: only its product with C counts there.

    Parameters
    ----------
    channels : int
        H.
    state_size : int
        N, even.
    kernel : {"legs", "diagonal"}
        Starts as HiPPO-LegS with random C (real, in the dense basis), or as S4D-Lin, λ = −1/2 +
        i π n (Gu et al. 2022, S4D).
    dt_min, dt_max : float
        Between these the steps Δ of the channels start, drawn evenly in their logarithm. A
        channel looks back about 1 / Δ frames. With "legs" and Δ N far above 2 the bilinear
        rule turns poles that are faster than a frame into ringing: take a smaller N then.
    """

    def __init__(
        self,
        channels: int,
        state_size: int,
        kernel: Kernel,
        dt_min: float = DT_MIN,
        dt_max: float = DT_MAX,
    ) -> None:
        super().__init__()
        if kernel not in ("legs", "diagonal"):
            raise Sd2Error(
                found=f"the kernel {kernel!r}", expected='"legs" or "diagonal"', remedy=""
            )
        if not STEP_RANGE[0] <= dt_min <= dt_max <= STEP_RANGE[1]:
            raise Sd2Error(
                found=f"first steps from dt_min = {dt_min:g} to dt_max = {dt_max:g}",
                expected=f"dt_min ≤ dt_max, both from {STEP_RANGE[0]:g} to {STEP_RANGE[1]:g}",
                remedy="",
            )
        first = legs_state_matrix(state_size)
        self.kernel_name = kernel
        pairs = state_size // 2
        log_dt = torch.empty(channels).uniform_(math.log(dt_min), math.log(dt_max))
        self.log_dt = nn.Parameter(log_dt)
        self.log_decay = nn.Parameter(torch.full((channels, pairs), math.log(0.5 - SLOWEST_DECAY)))
        self.skip = nn.Parameter(torch.randn(channels))
        if kernel == "legs":
            self.frequency = _per_channel(first.poles.imag, channels)
            self.low_rank = _per_channel(first.low_rank, channels)
            self.inputs = _per_channel(torch.view_as_real(first.inputs), channels)
            self.outputs = nn.Parameter(torch.randn(channels, state_size))
        else:
            self.frequency = _per_channel(torch.pi * torch.arange(pairs), channels)
            self.outputs = nn.Parameter(torch.randn(channels, pairs, 2) * math.sqrt(0.5))

    def dt(self) -> Tensor:
        """Step size Δ per channel, (H,) float64, within `STEP_RANGE`.

        Kernel and recurrence begin with it: Sd2Error where the parameters are of half precision.
        """
        if self.log_dt.dtype not in (torch.float32, torch.float64):
            raise Sd2Error(
                f"The parameters of a state space are {self.log_dt.dtype}",
                "float32 or float64: half precision is too coarse for its poles",
                "Keep the network in float32 and run it under torch.autocast",
            )
        low, high = (math.log(step) for step in STEP_RANGE)
        return self.log_dt.double().clamp(low, high).exp()

    def poles(self) -> Tensor:
        """Poles Λ, (H, N/2) complex128."""
        decay = self.log_decay.double().clamp(-LARGEST_LOG, LARGEST_LOG).exp()
        return torch.complex(-(decay + SLOWEST_DECAY), self.frequency.double())

    def matrix(self) -> StateMatrix:
        """State matrix and input Λ, p and B of the kernel "legs"."""
        inputs = torch.view_as_complex(self.inputs.double())
        return StateMatrix(self.poles(), self.low_rank.double(), inputs)

    def forward(self, length: int) -> Tensor:
        """Work out the kernel anew: `kernel` without what is kept."""
        dt = self.dt()
        if self.kernel_name == "legs":
            kernel = legs_kernel(self.outputs, dt, length, self.matrix())
        else:
            outputs = torch.view_as_complex(self.outputs)
            ones = torch.ones_like(outputs)
            kernel = diagonal_kernel(self.poles(), ones, outputs, dt, length)
        return torch.cat((kernel[:, :1] + self.skip[:, None], kernel[:, 1:]), 1)

    # What follows from the parameters alone is kept while nothing is being learned.

    def kernel(self, length: int) -> Tensor:
        """Convolution kernel, (H, length), D included, of the parameters' type."""
        return self.keep(length, lambda: self(length))

    def recurrence(self) -> Recurrence:
        """Recurrence of the same systems, one frame at a time."""
        return self.keep("recurrence", self._made_recurrence)

    def block(self) -> Block:
        """Recurrence of the same systems, a block of frames at a time."""
        return self.keep("block", lambda: block_of(self.recurrence()))

    def ssm_parameters(self) -> Iterator[nn.Parameter]:
        """Parameters that shape the dynamics: all but C and D."""
        for name, parameter in self.named_parameters():
            if name not in ("outputs", "skip"):
                yield parameter

    def _made_recurrence(self) -> Recurrence:
        if self.kernel_name == "legs":
            outputs = to_normal_basis(self.outputs)
            return nplr_recurrence(self.matrix(), outputs, self.dt(), self.skip)
        outputs = torch.view_as_complex(self.outputs.double())
        ones = torch.ones_like(outputs)
        return diagonal_recurrence(self.poles(), ones, outputs, self.dt(), self.skip)


def _per_channel(values: Tensor, channels: int) -> nn.Parameter:
    """Parameter with the same initial values for all channels."""
    return nn.Parameter(values.float().expand(channels, *values.shape).clone())


def joint_kernels(spaces: Sequence[StateSpace], length: int) -> Sequence[Tensor]:
    """Kernels of spaces that are alike, each (H, length).

    While learning, short ones are worked out as one space with the channels of all: a kernel is
    some hundred small operations, and most of a small operation is calling it.
    """
    first = spaces[0]
    if length > LONGEST_JOINED or not first.learning():
        return [space.kernel(length) for space in spaces]
    joined = {
        name: torch.cat([getattr(space, name) for space in spaces])
        for name, _ in first.named_parameters()
    }
    kernels: Tensor = torch.func.functional_call(first, joined, (length,))
    return kernels.chunk(len(spaces))
