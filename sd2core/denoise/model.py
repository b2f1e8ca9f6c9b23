"""Base class of denoiser networks: compressed synthetic values in, compressed radar values out."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import torch
from torch import Tensor, nn

State = Any
"""Internal state of a causal model after the frames so far."""


class Denoiser(nn.Module):
    """Base class of all denoiser networks.

    A causal subclass implements :meth:`chunk` and :meth:`initial_state`, another one
    :meth:`forward`.
    """

    causal: bool = True  # True if a frame depends on itself and earlier frames only.
    window: int | None = None  # Frames that it looks at together; None for any length.
    longest: int = 8192  # Frames that are computed at once in use; longer clips in pieces.

    def __init__(self, bins: int, parts: int = 1) -> None:
        super().__init__()
        self.bins = bins
        self.parts = parts  # Maps in the input, one per part of the body, or the map alone.

    def forward(self, values: Tensor) -> Tensor:
        """Denoise (batch, frames, parts · bins); the answer is (batch, frames, bins)."""
        return self.chunk(values, self.initial_state(len(values)))[0]

    def chunk(self, values: Tensor, state: State) -> tuple[Tensor, State]:
        """Denoise the next frames, as :meth:`forward`; also returns the state after them."""
        raise NotImplementedError(f"{type(self).__name__} looks at {self.window} frames together")

    def step(self, frame: Tensor, state: State) -> tuple[Tensor, State]:
        """Denoise the next frame (batch, parts · bins)."""
        answer, state = self.chunk(frame[:, None], state)
        return answer[:, 0], state

    def initial_state(self, batch: int = 1) -> State:
        """State before the first frame."""
        raise NotImplementedError(f"{type(self).__name__} looks at {self.window} frames together")

    def pictures(self, values: Tensor) -> Tensor:
        """Maps of (batch, frames, parts · bins) as channels, (batch, parts, frames, bins)."""
        return values.unflatten(2, (self.parts, self.bins)).transpose(1, 2)

    def ssm_parameters(self) -> Iterator[nn.Parameter]:
        """Parameters of state spaces: no weight decay, and a learning rate of their own."""
        return iter(())


def parameter_count(model: nn.Module) -> int:
    """Number of learned parameters."""
    return sum(parameter.numel() for parameter in model.parameters())


def use_one_thread() -> None:
    """Leave the other cores to other processes, which work beside this one."""
    torch.set_num_threads(1)
