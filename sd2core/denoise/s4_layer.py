"""S4 layer: a learned state space along time in every channel, a gated unit across channels.

In each of the H channels the input u drives a state x of N numbers, which gives the output y
(Gu et al. 2022, S4)::

    x′ = A x + B u,   y = C x + D u                     A (N, N), B and C (N,), D a number

Sampled bilinearly with a step Δ, all of which is learned, it can be worked out in two ways, with
the same result::

    Ā = (I − Δ/2 A)⁻¹ (I + Δ/2 A),   B̄ = (I − Δ/2 A)⁻¹ Δ B

    live, frame by frame     x[t] = Ā x[t − 1] + B̄ u[t],   y[t] = C x[t] + D u[t]
    all L frames at once     y = k ∗ u,   k[l] = C Āˡ B̄,   and D more at l = 0

With the kernel "diagonal", A is diagonal and Ā = exp(Δ A), as in S4D.

Around that the layer has a norm, a mixing of channels and a residual, all frame by frame::

    (B, L, H)  ──►  norm over H  ──►  k ∗ along L  ──►  gelu  ──►  gated linear over H  ──►  +

What is learned: `s4_space`. The kernel and its derivation: `s4_kernel`. The recurrence:
`s4_recurrence`. Steps with derivatives of their own: `s4_functions`. Networks: `s4_stack`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TypeAlias

import torch
from torch import Tensor, nn
from torch.nn import functional

from sd2core.denoise.s4_functions import convolution, mix_gated, normalise
from sd2core.denoise.s4_recurrence import BLOCK
from sd2core.denoise.s4_space import DT_MAX, DT_MIN, Kernel, StateSpace, joint_kernels
from sd2core.errors import Sd2Error

State: TypeAlias = Tensor
"""State x of a layer after the frames so far, (H, B, N) float64."""


class S4Layer(nn.Module):
    """Residual S4 layer: signal + mix(gelu(k ∗ norm(signal))), one state space per channel.

    Nothing but the state space looks at other frames, so that a stack of such layers can run live;
    the norm has no gain of its own, as C and D have it. With ``bidirectional`` a second kernel
    looks ahead; such a layer cannot run live. ``dropout`` is the share of channels that a training
    step leaves out, the same ones for all frames. The others are those of :class:`StateSpace`.
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
        space = (channels, state_size, kernel, dt_min, dt_max)
        self.channels, self.dropout = channels, dropout
        self.past = StateSpace(*space)
        self.future = StateSpace(*space) if bidirectional else None
        self.mixing = nn.Linear(channels, 2 * channels)

    def forward(self, signal: Tensor, kernels: Sequence[Tensor] | None = None) -> Tensor:
        """Apply the layer to whole sequences by convolution, (B, L, H) → (B, L, H).

        ``kernels`` are those of `spaces`, where a stack has worked them out for all its layers.
        """
        if torch.is_autocast_enabled(signal.device.type):
            return self._in_full_precision(signal, kernels)
        if kernels is None:
            kernels = joint_kernels(self.spaces(), signal.shape[1])  # each (H, L)
        u, signal = normalise(_channels_first(signal))  # (H, B, L) both
        y = convolution(u, *kernels)
        return self._mixed(y, signal, self._dropped(y))

    def initial_state(self, batch: int) -> State:
        """Zero state before the first frame."""
        return self._live().recurrence().initial_state(batch)

    def chunk(self, signal: Tensor, state: State) -> tuple[Tensor, State]:
        """Advance by any number of frames (B, l, H), by the recurrence."""
        first = _channels_first(signal)
        length = first.shape[-1]
        u = normalise(first)[0].double()
        recurrence = self._live().recurrence()
        whole = length - length % BLOCK
        parts = []
        if whole:
            y, state = self.past.block().run(u[..., :whole], state)
            parts.append(y)
        for frame in range(whole, length):
            y, state = recurrence.step(u[..., frame], state)
            parts.append(y[..., None])
        if not parts:
            return signal, state
        return self._mixed(torch.cat(parts, -1).to(first.dtype), first), state

    def spaces(self) -> list[StateSpace]:
        """State spaces: of the past, and if `bidirectional` of the future."""
        return [self.past] if self.future is None else [self.past, self.future]

    def ssm_parameters(self) -> Iterator[nn.Parameter]:
        """Parameters that get no weight decay and a lower learning rate of their own."""
        for space in self.spaces():
            yield from space.ssm_parameters()

    def _mixed(self, y: Tensor, signal: Tensor, share: Tensor | None = None) -> Tensor:
        """Mix the channels and add the signal, (H, B, L) both → (B, L, H)."""
        return mix_gated(y, signal, self.mixing.weight, self.mixing.bias, share).permute(1, 2, 0)

    def _dropped(self, y: Tensor) -> Tensor | None:
        """Factors of dropout, (H, B, 1): 0 for a channel that is left out."""
        if not (self.training and self.dropout > 0.0):
            return None
        return functional.dropout(y.new_ones(*y.shape[:2], 1), self.dropout)

    def _in_full_precision(self, signal: Tensor, kernels: Sequence[Tensor] | None) -> Tensor:
        # Half precision would cost the kernel its tail and save little: products are small.
        with torch.autocast(signal.device.type, enabled=False):
            return self(signal.to(self.mixing.weight.dtype), kernels)

    def _live(self) -> StateSpace:
        if self.future is not None:
            raise Sd2Error(
                found="a denoiser that looks ahead",
                expected="one that needs only the past, to run frame by frame",
                remedy="Take a causal model.",
            )
        return self.past


def _channels_first(signal: Tensor) -> Tensor:
    """Put channels first in memory, (B, L, H) → (H, B, L), as convolution and mixing need them.

    A layer's result is a view of such an array: a stack of layers copies nothing.
    """
    return signal.permute(2, 0, 1).contiguous()
