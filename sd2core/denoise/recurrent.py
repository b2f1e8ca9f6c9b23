"""A gated recurrent network, the baseline that a state space must beat."""

from __future__ import annotations

from torch import Tensor, nn

from sd2core.denoise.model import Denoiser, State


class GruDenoiser(Denoiser):
    """Linear layer, GRU layers (K. Cho et al., EMNLP 2014), linear layer; causal.

    Parameters
    ----------
    bins : int
    channels : int
        Width of all layers.
    depth : int
        Number of GRU layers.
    dropout : float
        Between layers, while training.
    """

    def __init__(
        self,
        bins: int,
        *,
        channels: int = 144,
        depth: int = 2,
        dropout: float = 0.0,
    ) -> None:
        super().__init__(bins)
        self.lift = nn.Linear(bins, channels)
        self.recurrent = nn.GRU(
            channels,
            channels,
            depth,
            batch_first=True,
            dropout=dropout if depth > 1 else 0.0,
        )
        self.head = nn.Linear(channels, bins)

    def initial_state(self, batch: int = 1) -> State:
        """Zeros, (layers, batch, channels)."""
        weight = self.lift.weight
        return weight.new_zeros(self.recurrent.num_layers, batch, self.recurrent.hidden_size)

    def chunk(self, values: Tensor, state: State) -> tuple[Tensor, State]:
        """Continue with the layers' last outputs."""
        hidden, state = self.recurrent(self.lift(values), state)
        return self.head(hidden), state
