"""What every denoiser is: compressed synthetic values in, compressed radar values out."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import torch
from torch import Tensor, nn

State = Any
"""What a causal model remembers of the frames before."""


class Denoiser(nn.Module):
    """Base of all models.

    What a subclass works out is added to the input times one learnt gain per bin, and
    starts at zero: an untrained model changes nothing, and what it learns is how radar
    differs from synthesis. All models are treated alike in this (docs/decisions/0024).

    A causal subclass implements :meth:`correction_chunk` and :meth:`initial_state`,
    another one :meth:`correction`.

    Parameters
    ----------
    bins : int
        Velocity bins.
    residual : bool
        Whether the input is added.

    Attributes
    ----------
    causal : bool
        Whether a frame depends on itself and earlier frames only.
    window : int or None
        Frames that it looks at together; None for any length.
    """

    causal: bool = True
    window: int | None = None

    def __init__(self, bins: int, residual: bool = True) -> None:
        super().__init__()
        self.bins = bins
        self.gain = nn.Parameter(torch.ones(bins)) if residual else None

    def forward(self, values: Tensor) -> Tensor:
        """(batch, frames, bins) to the same shape."""
        return self._added(self.correction(values), values)

    def chunk(self, values: Tensor, state: State) -> tuple[Tensor, State]:
        """Go on with the next frames (batch, frames, bins); the state for those after."""
        correction, state = self.correction_chunk(values, state)
        return self._added(correction, values), state

    def step(self, frame: Tensor, state: State) -> tuple[Tensor, State]:
        """Go on with one frame (batch, bins)."""
        correction, state = self.correction_step(frame, state)
        return self._added(correction, frame), state

    def initial_state(self, batch: int = 1) -> State:
        """State before the first frame."""
        raise NotImplementedError(f"{type(self).__name__} looks at {self.window} frames together")

    def correction(self, values: Tensor) -> Tensor:
        """What is added to the input, (batch, frames, bins)."""
        return self.correction_chunk(values, self.initial_state(len(values)))[0]

    def correction_chunk(self, values: Tensor, state: State) -> tuple[Tensor, State]:
        """The same, with what is remembered."""
        raise NotImplementedError(f"{type(self).__name__} looks at {self.window} frames together")

    def correction_step(self, frame: Tensor, state: State) -> tuple[Tensor, State]:
        """The same, of one frame (batch, bins)."""
        correction, state = self.correction_chunk(frame[:, None], state)
        return correction[:, 0], state

    def ssm_parameters(self) -> Iterator[nn.Parameter]:
        """Parameters of state spaces: no weight decay, and a learning rate of their own."""
        return iter(())

    def _added(self, correction: Tensor, values: Tensor) -> Tensor:
        return correction if self.gain is None else correction + self.gain * values


def head(layer: Any, residual: bool) -> Any:
    """A last layer, silent at first where the input is added to what it says."""
    if residual:
        nn.init.zeros_(layer.weight)
        nn.init.zeros_(layer.bias)
    return layer


def parameter_count(model: nn.Module) -> int:
    """Numbers that are learnt."""
    return sum(parameter.numel() for parameter in model.parameters())
