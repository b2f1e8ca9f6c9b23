"""Causal networks: the paper's S4 denoiser, its serial form, and a GRU as the baseline."""

from __future__ import annotations

from typing import Any, Literal

from torch import Tensor, nn

from sd2core.denoise.model import Denoiser, State
from sd2core.denoise.s4_layer import S4Layer
from sd2core.denoise.s4_space import DT_MAX, DT_MIN
from sd2core.denoise.s4_stack import S4Stack


class S4Denoiser(S4Stack, Denoiser):
    """The paper's denoiser: a linear layer per frame, S4 layers along time, a linear layer.

    Parameters
    ----------
    parts, more : int
        Maps in the input, and numbers per frame after them.
    channels : int
        Width H of the layers.
    depth : int
        Number of S4 layers.
    state_size : int
        Numbers N that each channel remembers.
    kernel : {"legs", "diagonal"}
    bidirectional : bool
        Also backwards in time: no longer causal, so not for live use.
    dt_min, dt_max : float
        A channel begins with a memory of between about 1 / ``dt_max`` and 1 / ``dt_min`` frames.
    """

    def __init__(
        self,
        bins: int,
        *,
        parts: int = 1,
        more: int = 0,
        channels: int = 128,
        depth: int = 4,
        state_size: int = 64,
        kernel: Literal["legs", "diagonal"] = "legs",
        bidirectional: bool = False,
        dropout: float = 0.0,
        dt_min: float = DT_MIN,
        dt_max: float = DT_MAX,
    ) -> None:
        super().__init__(bins, parts, more)
        self.causal = not bidirectional
        self.lift = self.lifting(channels)
        self.layers = nn.ModuleList(
            S4Layer(
                channels,
                state_size,
                kernel=kernel,
                bidirectional=bidirectional,
                dropout=dropout,
                dt_min=dt_min,
                dt_max=dt_max,
            )
            for _ in range(depth)
        )
        self.head = nn.Linear(channels, bins)


class SerialS4Denoiser(S4Denoiser):
    """The paper's literal form: 72 frames of 32 bins as 2,304 samples of one channel.

    Cells come one after another, bin by bin and frame by frame; each is lifted to the
    width of the layers by itself. A cell knows the bins below it in its own frame and
    all earlier frames. Parameters as for :class:`S4Denoiser`.
    """

    longest = 512

    def __init__(self, bins: int, *, channels: int = 128, **layers: Any):
        super().__init__(bins, channels=channels, **layers)
        self.lift = nn.Linear(self.prepare_pictures(), channels)
        self.head = nn.Linear(channels, 1)

    def forward(self, values: Tensor) -> Tensor:
        """Denoise whole sequences, (batch, frames, features), as rows of cells."""
        return super().forward(self._cells(values)).view(*values.shape[:2], self.bins)

    def chunk(self, values: Tensor, state: State) -> tuple[Tensor, State]:
        """Advance by whole frames, so that the state lies between two frames."""
        cells, state = super().chunk(self._cells(values), state)
        return cells.view(*values.shape[:2], self.bins), state

    def _cells(self, values: Tensor) -> Tensor:
        """Values of every cell, (batch, frames · bins, channels)."""
        return self.pictures(values).flatten(2).transpose(1, 2)


class GruDenoiser(Denoiser):
    """Baseline: linear layer, GRU layers (K. Cho et al., EMNLP 2014), linear layer; causal.

    The input has ``parts`` maps and ``more`` numbers per frame. All layers have ``channels``
    units; ``dropout`` is between layers, while training.
    """

    def __init__(
        self,
        bins: int,
        *,
        parts: int = 1,
        more: int = 0,
        channels: int = 144,
        depth: int = 2,
        dropout: float = 0.0,
    ) -> None:
        super().__init__(bins, parts, more)
        self.lift = self.lifting(channels)
        self.recurrent = nn.GRU(
            channels, channels, depth, batch_first=True, dropout=dropout if depth > 1 else 0.0
        )
        self.head = nn.Linear(channels, bins)

    def initial_state(self, batch: int = 1) -> State:
        """Zero state, (layers, batch, channels)."""
        weight = self.head.weight
        return weight.new_zeros(self.recurrent.num_layers, batch, self.recurrent.hidden_size)

    def chunk(self, values: Tensor, state: State) -> tuple[Tensor, State]:
        """Advance by some frames."""
        hidden, state = self.recurrent(self.lift(values), state)
        return self.head(hidden), state
