"""A layer of structured state spaces: convolution while learning, recurrence while live."""

from __future__ import annotations

from collections.abc import Iterator

import torch
from torch import Tensor, nn
from torch.nn import functional

from sd2core.denoise.channels import SMALLEST_VARIANCE, mix_gated, normalise
from sd2core.denoise.convolution import causal_convolution
from sd2core.denoise.recurrence import BLOCK
from sd2core.denoise.state_space_layer import DT_MAX, DT_MIN, Kernel, State, StateSpace
from sd2core.errors import Sd2Error

__all__ = ["Kernel", "S4Layer", "State"]


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
    dt_min, dt_max : float
        Range of the state spaces' first steps, see
        :class:`~sd2core.denoise.state_space_layer.StateSpace`.
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
        """Those that get no weight decay and a lower learning rate of their own."""
        for part in (self.past, self.future):
            if part is not None:
                yield from part.ssm_parameters()

    def forward(self, x: Tensor) -> Tensor:
        """(B, L, H) → (B, L, H).

        In memory channels come first, as convolution and mixing want them: what comes out is a
        view of an (H, B, L) array, and a stack of layers moves nothing.
        """
        if torch.is_autocast_enabled(x.device.type):
            # Half precision would cost the kernel its tail and save little: products are small.
            with torch.autocast(x.device.type, enabled=False):
                return self(x.to(self.mixing.weight.dtype))
        batch, length, channels = x.shape
        signal = x.permute(2, 0, 1).contiguous()  # (H, B, L)
        normed = normalise(signal)
        mixed = causal_convolution(normed, self.past.kernel(length))
        if self.future is not None:
            ahead = causal_convolution(normed.flip(-1), self.future.kernel(length))
            mixed = mixed + ahead.flip(-1)
        share = None
        if self.training and self.dropout > 0.0:
            share = functional.dropout(mixed.new_ones(channels, batch, 1), self.dropout)
        return self._mix(mixed, signal, share).permute(1, 2, 0)

    def initial_state(self, batch: int) -> State:
        """Silence so far."""
        return self._live().recurrence().initial_state(batch)

    def step(self, frame: Tensor, state: State) -> tuple[Tensor, State]:
        """One frame, (B, H), and what was remembered; gives the frame and what to remember."""
        normed = functional.layer_norm(frame, (self.channels,), eps=SMALLEST_VARIANCE)
        seen, state = self._live().recurrence().step(normed.t().double(), state)
        both = self.mixing(functional.gelu(seen.t().to(frame.dtype)))
        return frame + functional.glu(both), state

    def chunk(self, x: Tensor, state: State) -> tuple[Tensor, State]:
        """Some frames, (B, l, H), of any number: the same as so many steps."""
        signal = x.permute(2, 0, 1).contiguous()
        length = signal.shape[-1]
        normed = normalise(signal).double()
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
