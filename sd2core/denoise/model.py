"""Base class of denoiser networks: compressed synthetic values in, compressed radar values out."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain
from typing import Any

import torch
from torch import Tensor, nn

_MIN_DEVIATION = 0.01

DRAWN = 4
"""Maps as which kinematics are drawn, for networks of pictures."""

State = Any
"""Internal state of a causal model after the frames so far."""


class Denoiser(nn.Module):
    """Base class of all denoiser networks.

    A causal subclass implements :meth:`chunk` and :meth:`initial_state`, another one
    :meth:`forward`.
    """

    causal: bool = True  # True if a frame depends on itself and earlier frames only.
    window: int | None = None  # Frames that it looks at together; None for any number.
    longest: int = 8192  # Frames that are computed at once in use; longer clips in pieces.

    def __init__(self, bins: int, parts: int = 1, more: int = 0) -> None:
        super().__init__()
        self.bins = bins
        self.parts = parts  # Maps in the input, one per part of the body, or the map alone.
        self.more = more  # Numbers per frame after the maps.

    @property
    def features(self) -> int:
        """Numbers per frame of the input."""
        return self.parts * self.bins + self.more

    @property
    def live(self) -> Denoiser | None:
        """Causal network of the same use, for live frames; None if there is none."""
        return self if self.causal else None

    def forward(self, values: Tensor) -> Tensor:
        """Denoise (batch, frames, features); the answer is (batch, frames, bins)."""
        return self.chunk(values, self.initial_state(len(values)))[0]

    def chunk(self, values: Tensor, state: State) -> tuple[Tensor, State]:
        """Denoise the next frames, as :meth:`forward`; also returns the state after them."""
        raise NotImplementedError(f"{type(self).__name__} looks at later frames, too")

    def initial_state(self, batch: int = 1) -> State:
        """State before the first frame."""
        raise NotImplementedError(f"{type(self).__name__} looks at later frames, too")

    def lifting(self, channels: int) -> nn.Module:
        """Layer from the features of a frame to channels."""
        linear = nn.Linear(self.features, channels)
        return nn.Sequential(Standard(self.more), linear) if self.more else linear

    def prepare_pictures(self) -> int:
        """Prepare :meth:`pictures` in a constructor; returns the number of their channels."""
        if not self.more:
            return self.parts
        wide = 2 * self.bins
        self.draw = nn.Sequential(
            Standard(self.more),
            nn.Linear(self.more, wide),
            nn.SiLU(),
            nn.Linear(wide, DRAWN * self.bins),
        )
        return self.parts + DRAWN

    def pictures(self, values: Tensor) -> Tensor:
        """Maps of (batch, frames, features), (batch, channels, frames, bins).

        Kinematics are drawn as maps by two layers that learn.
        """
        maps = values[..., : self.parts * self.bins]
        if self.more:
            maps = torch.cat([maps, self.draw(values[..., self.parts * self.bins :])], dim=-1)
        return maps.unflatten(2, (-1, self.bins)).transpose(1, 2)

    def ssm_parameters(self) -> Iterator[nn.Parameter]:
        """Parameters of state spaces: no weight decay, and a learning rate of their own."""
        return iter(())


class Corrected(Denoiser):
    """A linear map of each frame's histogram, and a network that corrects it.

    So a network need not learn what the input already tells. One with kinematics sees those
    alone: beside a histogram it would learn less from them.
    """

    def __init__(self, network: Denoiser, parts: int) -> None:
        super().__init__(network.bins, parts, network.more)
        self.causal, self.window, self.longest = network.causal, network.window, network.longest
        self.network = network
        self._first = parts * self.bins if self.more else 0
        self.skip = nn.Linear(self.bins, self.bins)
        nn.init.eye_(self.skip.weight)
        nn.init.zeros_(self.skip.bias)

    def _of_frame(self, values: Tensor) -> Tensor:
        """Answer (…, bins) of each frame's histogram; of parts those of their sum, nearly."""
        maps = values[..., : self.parts * self.bins].unflatten(-1, (self.parts, self.bins))
        whole = maps[..., 0, :] if self.parts == 1 else torch.linalg.vector_norm(maps, dim=-2)
        return self.skip(whole)

    def forward(self, values: Tensor) -> Tensor:
        """Denoise (batch, frames, features)."""
        return self.network(values[..., self._first :]) + self._of_frame(values)

    def chunk(self, values: Tensor, state: State) -> tuple[Tensor, State]:
        """Denoise the next frames, as :meth:`forward`."""
        answer, state = self.network.chunk(values[..., self._first :], state)
        return answer + self._of_frame(values), state

    def initial_state(self, batch: int = 1) -> State:
        """State of the network before the first frame."""
        return self.network.initial_state(batch)

    def ssm_parameters(self) -> Iterator[nn.Parameter]:
        """State-space parameters of the network."""
        return self.network.ssm_parameters()


class TwoNetworks(Denoiser):
    """A network that looks both ways, for whole recordings, and a causal one for live frames.

    They learn at the same time and share nothing.
    """

    causal = False

    def __init__(self, whole: Denoiser, forwards: Denoiser) -> None:
        super().__init__(whole.bins, whole.parts, whole.more)
        self.window, self.longest = whole.window, whole.longest
        self.whole, self.forwards = whole, forwards

    @property
    def live(self) -> Denoiser:
        """The causal one."""
        return self.forwards

    def forward(self, values: Tensor) -> Tensor:
        """Denoise (batch, frames, features) both ways."""
        return self.whole(values)

    def ssm_parameters(self) -> Iterator[nn.Parameter]:
        """State-space parameters of both networks."""
        return chain(self.whole.ssm_parameters(), self.forwards.ssm_parameters())


class Standard(nn.Module):
    """Brings the last features to a mean of 0 and a deviation of 1, as in the training."""

    def __init__(self, count: int) -> None:
        super().__init__()
        self.count = count
        self.register_buffer("mean", torch.zeros(count))
        self.register_buffer("scale", torch.ones(count))

    def fit(self, values: Tensor) -> None:
        """Take mean and deviation from features (frames, …)."""
        last = values[:, values.shape[1] - self.count :]
        self.mean, deviation = last.mean(dim=0), last.std(dim=0)
        # What hardly ever changes is not blown up.
        self.scale = 1.0 / deviation.clamp(min=_MIN_DEVIATION)

    def forward(self, values: Tensor) -> Tensor:
        """Standardise (…, features)."""
        others, last = values.tensor_split([values.shape[-1] - self.count], dim=-1)
        return torch.cat([others, (last - self.mean) * self.scale], dim=-1)


def fit_standards(network: nn.Module, values: Tensor) -> None:
    """Fit all :class:`Standard` of a network to features to learn from, (frames, features)."""
    for module in network.modules():
        if isinstance(module, Standard):
            module.fit(values)


def parameter_count(model: nn.Module) -> int:
    """Number of learned parameters."""
    return sum(parameter.numel() for parameter in model.parameters())


def use_one_thread() -> None:
    """Leave the other cores to other processes, which work beside this one."""
    torch.set_num_threads(1)
