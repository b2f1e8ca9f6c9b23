"""S4 layer: learned state spaces along time, a convolution in training and a recurrence live.

The layer itself is :meth:`S4Layer.forward`: norm, convolution, mixing, residual::

    x  ──►  norm  ──►  k ∗  + D  ──►  gelu  ──►  gated linear  ──►  + x

Every channel h has a state space of its own (:class:`~sd2core.denoise.s4_space.StateSpace`),
x′ = A x + B u, y = C x + D u, sampled with the step Δ. As a convolution it is the kernel
k[l] = C Āˡ B̄ (`s4_kernel`, which has the derivation), computed for all frames at once; as a
recurrence x[t] = Ā x[t − 1] + B̄ u[t] it runs frame by frame (`s4_recurrence`). Both give the same.
`s4_functions` has the steps that are worth derivatives of their own.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TypeAlias

import torch
from torch import Tensor, nn
from torch.nn import functional

from sd2core.denoise.s4_functions import SMALLEST_VARIANCE, causal_convolution, mix_gated, normalise
from sd2core.denoise.s4_recurrence import BLOCK
from sd2core.denoise.s4_space import DT_MAX, DT_MIN, Kernel, StateSpace, joint_kernels
from sd2core.errors import Sd2Error

State: TypeAlias = Tensor
"""State x of a layer after the frames so far, (H, B, N) float64."""


class S4Layer(nn.Module):
    """Residual S4 layer x + mix(gelu(k ∗ norm(x) + D norm(x))), one state space per channel.

    The norm is over the channels of one frame and has no gain of its own (C and D have it); the
    mixing is a gated linear unit over channels. So nothing but the state space looks at other
    frames, and a stack of such layers can run live.

    With ``bidirectional`` a second kernel looks ahead; such a layer cannot run live. ``dropout`` is
    the share of channels that a training step leaves out, the same ones for all frames. The other
    arguments are those of :class:`StateSpace`.
    """

    def __init__(
        self,
        channels: int,
        state_size: int = 64,
        kernel: Kernel = "legs",
        bidirectional: bool = False,
        dropout: float = 0.0,
        dt_min: float = DT_MIN,
        dt_max: float = DT_MAX,
    ) -> None:
        super().__init__()
        self.channels = channels
        space = (channels, state_size, kernel, dt_min, dt_max)
        self.past = StateSpace(*space)
        self.future = StateSpace(*space) if bidirectional else None
        self.mixing = nn.Linear(channels, 2 * channels)
        self.dropout = dropout

    def ssm_parameters(self) -> Iterator[nn.Parameter]:
        """Parameters that get no weight decay and a lower learning rate of their own."""
        for space in self.spaces():
            yield from space.ssm_parameters()

    def spaces(self) -> list[StateSpace]:
        """State spaces: of the past, and if `bidirectional` of the future."""
        return [self.past] if self.future is None else [self.past, self.future]

    def forward(self, x: Tensor, kernels: Sequence[Tensor] | None = None) -> Tensor:
        """Apply the layer to whole sequences by convolution, (B, L, H) → (B, L, H).

        ``kernels`` are those of `spaces`, where a stack has worked them out for all its layers.

        Channels come first in memory, as convolution and mixing need them: the result is a view
        of an (H, B, L) array, and a stack of layers copies nothing.
        """
        if torch.is_autocast_enabled(x.device.type):
            # Half precision would cost the kernel its tail and save little: products are small.
            with torch.autocast(x.device.type, enabled=False):
                return self(x.to(self.mixing.weight.dtype), kernels)
        batch, length, channels = x.shape
        if kernels is None:
            kernels = joint_kernels(self.spaces(), length)
        signal = x.permute(2, 0, 1).contiguous()  # (H, B, L)
        normed, signal = normalise(signal)
        mixed = causal_convolution(normed, kernels[0])
        if self.future is not None:
            mixed = mixed + causal_convolution(normed.flip(-1), kernels[1]).flip(-1)
        share = None
        if self.training and self.dropout > 0.0:
            share = functional.dropout(mixed.new_ones(channels, batch, 1), self.dropout)
        return self._mix(mixed, signal, share).permute(1, 2, 0)

    def initial_state(self, batch: int) -> State:
        """Zero state before the first frame."""
        return self._live().recurrence().initial_state(batch)

    def step(self, frame: Tensor, state: State) -> tuple[Tensor, State]:
        """Advance by one frame (B, H); returns its result and the next state."""
        normed = functional.layer_norm(frame, (self.channels,), eps=SMALLEST_VARIANCE)
        seen, state = self._live().recurrence().step(normed.t().double(), state)
        both = self.mixing(functional.gelu(seen.t().to(frame.dtype)))
        return frame + functional.glu(both), state

    def chunk(self, x: Tensor, state: State) -> tuple[Tensor, State]:
        """Advance by any number of frames (B, l, H), as so many steps would."""
        signal = x.permute(2, 0, 1).contiguous()
        length = signal.shape[-1]
        normed = normalise(signal)[0].double()
        recurrence = self._live().recurrence()
        whole = length - length % BLOCK
        parts = []
        if whole:
            seen, state = self.past.block().run(normed[..., :whole], state)
            parts.append(seen)
        for frame in range(whole, length):
            seen, state = recurrence.step(normed[..., frame], state)
            parts.append(seen[..., None])
        if not parts:
            return x, state
        mixed = torch.cat(parts, -1).to(signal.dtype)
        return self._mix(mixed, signal).permute(1, 2, 0), state

    def _mix(self, seen: Tensor, signal: Tensor, share: Tensor | None = None) -> Tensor:
        return mix_gated(seen, signal, self.mixing.weight, self.mixing.bias, share)

    def _live(self) -> StateSpace:
        if self.future is not None:
            raise Sd2Error(
                found="a denoiser that looks ahead",
                expected="one that needs only the past, to run frame by frame",
                remedy="Take a causal model.",
            )
        return self.past


class S4Stack(nn.Module):
    """Base of networks of S4 layers: ``lift`` per frame, ``layers`` along time, ``head`` per frame.

    The state is a list of one state per layer.
    """

    lift: nn.Module
    layers: nn.ModuleList
    head: nn.Module

    def initial_state(self, batch: int = 1) -> list[State]:
        """Zero states before the first frame."""
        return [layer.initial_state(batch) for layer in self.layers]

    def forward(self, values: Tensor) -> Tensor:
        """Process whole sequences (B, L, …) by convolution."""
        hidden = self.lift(values)
        spaces = [layer.spaces() for layer in self.layers]
        kernels = iter(joint_kernels([space for each in spaces for space in each], hidden.shape[1]))
        for layer, each in zip(self.layers, spaces, strict=True):
            hidden = layer(hidden, [next(kernels) for _ in each])
        return self.head(hidden)

    def chunk(self, values: Tensor, state: list[State]) -> tuple[Tensor, list[State]]:
        """Advance by some frames (B, l, …), by recurrence."""
        hidden, after = self.lift(values), []
        for layer, one in zip(self.layers, state, strict=True):
            hidden, one = layer.chunk(hidden, one)
            after.append(one)
        return self.head(hidden), after

    def step(self, frame: Tensor, state: list[State]) -> tuple[Tensor, list[State]]:
        """Advance by one frame (B, …)."""
        hidden, after = self.lift(frame), []
        for layer, one in zip(self.layers, state, strict=True):
            hidden, one = layer.step(hidden, one)
            after.append(one)
        return self.head(hidden), after

    def ssm_parameters(self) -> Iterator[nn.Parameter]:
        """State-space parameters of all layers."""
        for layer in self.layers:
            yield from layer.ssm_parameters()
