"""A layer of structured state spaces: convolution while learning, recurrence while live."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, Literal, TypeAlias

import torch
from torch import Tensor, nn
from torch.nn import functional

from sd2core.denoise.convolution import causal_convolution
from sd2core.denoise.recurrence import (
    BLOCK,
    Block,
    Recurrence,
    block_of,
    diagonal_recurrence,
    low_rank_recurrence,
)
from sd2core.denoise.ssm import (
    StateMatrix,
    diagonal_kernel,
    legs_kernel,
    legs_state_matrix,
    to_normal_basis,
)
from sd2core.errors import Sd2Error

Kernel = Literal["legs", "diagonal"]
State: TypeAlias = Tensor
"""(H, B, N) float64: what a layer remembers of the frames so far."""

# Poles stay at least this far left of the imaginary axis, whatever is learned.
SLOWEST_DECAY = 1e-4
# exp(±100) and its square are still numbers in double precision.
LARGEST_LOG = 100.0
STEP_RANGE = (1e-7, 1e2)
FIRST_STEPS = (1e-3, 1e-1)


class StateSpace(nn.Module):
    """H systems of one input and one output, their parameters, and what follows from them.

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
        i π n (Gu et al. 2022, S4D, section 4).
    """

    def __init__(self, channels: int, state_size: int, kernel: Kernel) -> None:
        super().__init__()
        if kernel not in ("legs", "diagonal"):
            raise Sd2Error(
                found=f"the kernel {kernel!r}", expected='"legs" or "diagonal"', remedy=""
            )
        first = legs_state_matrix(state_size)
        self.kernel_name = kernel
        pairs = state_size // 2
        low, high = (math.log(step) for step in FIRST_STEPS)
        self.log_dt = nn.Parameter(torch.empty(channels).uniform_(low, high))
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

    def ssm_parameters(self) -> Iterator[nn.Parameter]:
        """Those that shape the dynamics: all but C and D."""
        for name, parameter in self.named_parameters():
            if name not in ("outputs", "skip"):
                yield parameter

    def dt(self) -> Tensor:
        """Δ, (H,) float64, within `STEP_RANGE`."""
        low, high = (math.log(step) for step in STEP_RANGE)
        return self.log_dt.double().clamp(low, high).exp()

    def poles(self) -> Tensor:
        """Λ, (H, N/2) complex128."""
        decay = self.log_decay.double().clamp(-LARGEST_LOG, LARGEST_LOG).exp()
        return torch.complex(-(decay + SLOWEST_DECAY), self.frequency.double())

    def matrix(self) -> StateMatrix:
        """Λ, p and B of "legs"."""
        inputs = torch.view_as_complex(self.inputs.double())
        return StateMatrix(self.poles(), self.low_rank.double(), inputs)

    def kernel(self, length: int) -> Tensor:
        """(H, length), D included, of the parameters' type."""
        if self.kernel_name == "legs":
            kernel = legs_kernel(self.outputs, self.dt(), length, self.matrix())
        else:
            outputs = torch.view_as_complex(self.outputs)
            kernel = diagonal_kernel(
                self.poles(), torch.ones_like(outputs), outputs, self.dt(), length
            )
        return torch.cat((kernel[:, :1] + self.skip[:, None], kernel[:, 1:]), 1)

    def recurrence(self) -> Recurrence:
        """The same systems, one frame at a time."""
        if self.kernel_name == "legs":
            outputs = to_normal_basis(self.outputs)
            return low_rank_recurrence(self.matrix(), outputs, self.dt(), self.skip)
        outputs = torch.view_as_complex(self.outputs.double())
        ones = torch.ones_like(outputs)
        return diagonal_recurrence(self.poles(), ones, outputs, self.dt(), self.skip)


class S4Layer(nn.Module):
    """x + mix(gelu(k ∗ norm(x) + D norm(x))), one state space per channel.

    The norm is over the channels of one frame and has no gain of its own (C and D have it); the
    mixing is a gated linear unit over channels. So nothing but the state space looks at other
    frames, and a stack of such layers can run live.

    Parameters
    ----------
    channels : int
        H.
    state_size : int
        N, even.
    kernel : {"legs", "diagonal"}
    bidirectional : bool
        A second kernel looks ahead; such a layer cannot run live.
    dropout : float
        Share of channels that a training step leaves out, the same ones for all frames.
    """

    def __init__(
        self,
        channels: int,
        state_size: int = 64,
        kernel: Kernel = "legs",
        bidirectional: bool = False,
        dropout: float = 0.0,
    ) -> None:
        super().__init__()
        self.channels = channels
        self.past = StateSpace(channels, state_size, kernel)
        self.future = StateSpace(channels, state_size, kernel) if bidirectional else None
        self.mixing = nn.Linear(channels, 2 * channels)
        self.dropout = dropout
        self._kept: dict[Any, Any] = {}

    def ssm_parameters(self) -> Iterator[nn.Parameter]:
        """Those that get no weight decay and a lower learning rate of their own."""
        for part in (self.past, self.future):
            if part is not None:
                yield from part.ssm_parameters()

    def forward(self, x: Tensor) -> Tensor:
        """(B, L, H) → (B, L, H).

        In memory channels come first, as convolution and mixing want them: what comes out is a
        view of an (H, B, L) array, and a stack of layers moves nothing.
        """
        batch, length, channels = x.shape
        signal = x.permute(2, 0, 1).contiguous()  # (H, B, L)
        normed = normalise(signal)
        mixed = causal_convolution(normed, self._kernel("past", length))
        if self.future is not None:
            ahead = causal_convolution(normed.flip(-1), self._kernel("future", length))
            mixed = mixed + ahead.flip(-1)
        out = self._mix(mixed.reshape(channels, -1)).view(channels, batch, length)
        if self.training and self.dropout > 0.0:
            ones = out.new_ones(channels, batch, 1)
            out = out * functional.dropout(ones, self.dropout)
        return (signal + out).permute(1, 2, 0)

    def initial_state(self, batch: int) -> State:
        """Silence so far."""
        return self._recurrence().initial_state(batch)

    def step(self, frame: Tensor, state: State) -> tuple[Tensor, State]:
        """One frame, (B, H), and what was remembered; gives the frame and what to remember."""
        signal = frame.t().contiguous()  # (H, B)
        normed = normalise(signal).double()[..., None]
        seen, state = self._recurrence().step(normed, state)
        out = self._mix(seen[..., 0].to(signal.dtype))
        return (signal + out).t(), state

    def chunk(self, x: Tensor, state: State) -> tuple[Tensor, State]:
        """Some frames, (B, l, H), of any number: the same as so many steps."""
        signal = x.permute(2, 0, 1).contiguous()
        batch, length = signal.shape[1:]
        normed = normalise(signal).double()
        recurrence = self._recurrence()
        whole = length - length % BLOCK
        parts = []
        if whole:
            block = self._block()
            for frames in normed[..., :whole].split(BLOCK, -1):
                seen, state = block.step(frames, state)
                parts.append(seen)
        for frame in range(whole, length):
            seen, state = recurrence.step(normed[..., frame : frame + 1], state)
            parts.append(seen)
        if not parts:
            return x, state
        mixed = torch.cat(parts, -1).to(signal.dtype).reshape(self.channels, -1)
        out = self._mix(mixed).view(self.channels, batch, length)
        return (signal + out).permute(1, 2, 0), state

    def _mix(self, values: Tensor) -> Tensor:
        """(H, M) → (H, M): activation, then a gated linear unit over channels."""
        active = functional.gelu(values)
        both = torch.addmm(self.mixing.bias[:, None], self.mixing.weight, active)
        return functional.glu(both, 0)

    # What follows from the parameters alone is kept while nothing is being learned.

    def _kernel(self, name: str, length: int) -> Tensor:
        space = getattr(self, name)
        kernel: Tensor = self._keep((name, length), lambda: space.kernel(length))
        return kernel

    def _recurrence(self) -> Recurrence:
        if self.future is not None:
            raise Sd2Error(
                found="a denoiser that looks ahead",
                expected="one that needs only the past, to run frame by frame",
                remedy="Take a causal model.",
            )
        recurrence: Recurrence = self._keep("recurrence", self.past.recurrence)
        return recurrence

    def _block(self) -> Block:
        block: Block = self._keep("block", lambda: block_of(self._recurrence()))
        return block

    def _keep(self, key: Any, make: Any) -> Any:
        if self.training or torch.is_grad_enabled():
            return make()
        stamp = tuple((id(p), p.data_ptr(), p._version) for p in self.parameters())
        if self._kept.get("stamp") != stamp:
            self._kept = {"stamp": stamp}
        if key not in self._kept:
            self._kept[key] = make()
        return self._kept[key]

    def _forget(self) -> None:
        self._kept = {}

    def train(self, mode: bool = True) -> S4Layer:
        """As of `nn.Module`."""
        self._forget()
        super().train(mode)
        return self

    def _apply(self, *args: Any, **options: Any) -> Any:
        self._forget()
        return super()._apply(*args, **options)

    def _load_from_state_dict(self, *args: Any, **options: Any) -> None:
        self._forget()
        super()._load_from_state_dict(*args, **options)

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_kept": {}}


def _per_channel(values: Tensor, channels: int) -> nn.Parameter:
    """The same start for all channels, each free to leave it."""
    return nn.Parameter(values.float().expand(channels, *values.shape).clone())


def normalise(signal: Tensor) -> Tensor:
    """Mean 0 and variance 1 over the channels, (H, …) → (H, …)."""
    centred = signal - signal.mean(0)
    return centred * torch.rsqrt(centred.square().mean(0) + 1e-5)
