"""Networks of S4 layers: their kernels worked out together, their states side by side."""

from __future__ import annotations

from collections.abc import Iterator

from torch import Tensor, nn

from sd2core.denoise.s4_layer import State
from sd2core.denoise.s4_space import joint_kernels


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

    def ssm_parameters(self) -> Iterator[nn.Parameter]:
        """State-space parameters of all layers."""
        for layer in self.layers:
            yield from layer.ssm_parameters()
