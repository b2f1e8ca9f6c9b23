"""What every denoiser is: compressed synthetic values in, compressed radar values out."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from torch import Tensor, nn

State = Any
"""What a causal model remembers of the frames before."""


class Denoiser(nn.Module):
    """Base of all models.

    A causal subclass implements :meth:`chunk` and :meth:`initial_state`, another one
    :meth:`forward`.

    Parameters
    ----------
    bins : int
        Velocity bins.

    Attributes
    ----------
    causal : bool
        Whether a frame depends on itself and earlier frames only.
    window : int or None
        Frames that it looks at together; None for any length.
    longest : int
        Frames that are worked out at once when it is used; longer clips in pieces.
    """

    causal: bool = True
    window: int | None = None
    longest: int = 8192

    def __init__(self, bins: int) -> None:
        super().__init__()
        self.bins = bins

    def forward(self, values: Tensor) -> Tensor:
        """(batch, frames, bins) to the same shape."""
        return self.chunk(values, self.initial_state(len(values)))[0]

    def chunk(self, values: Tensor, state: State) -> tuple[Tensor, State]:
        """Go on with the next frames (batch, frames, bins); the state for those after."""
        raise NotImplementedError(f"{type(self).__name__} looks at {self.window} frames together")

    def step(self, frame: Tensor, state: State) -> tuple[Tensor, State]:
        """Go on with one frame (batch, bins)."""
        answer, state = self.chunk(frame[:, None], state)
        return answer[:, 0], state

    def initial_state(self, batch: int = 1) -> State:
        """State before the first frame."""
        raise NotImplementedError(f"{type(self).__name__} looks at {self.window} frames together")

    def ssm_parameters(self) -> Iterator[nn.Parameter]:
        """Parameters of state spaces: no weight decay, and a learning rate of their own."""
        return iter(())


def parameter_count(model: nn.Module) -> int:
    """Numbers that are learnt."""
    return sum(parameter.numel() for parameter in model.parameters())
