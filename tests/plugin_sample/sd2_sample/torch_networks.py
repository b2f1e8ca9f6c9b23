"""A denoiser and a classifier."""

from typing import Any

from torch import Tensor, nn

from sd2core.classify.models import Classifier
from sd2core.denoise.model import Denoiser


class Blur(Denoiser):
    def __init__(self, bins: int, parts: int = 1, more: int = 0, *, width: int) -> None:
        super().__init__(bins, parts, more)
        self.layer = nn.Sequential(nn.Linear(self.features, width), nn.Linear(width, bins))

    def initial_state(self, batch: int = 1) -> Any:
        return ()

    def chunk(self, values: Tensor, state: Any) -> tuple[Tensor, Any]:
        return self.layer(values), state


class Dense(Classifier):
    def __init__(self, size: int, classes: int, *, width: int) -> None:
        super().__init__(width, classes, dropout=0.0)
        self.lift = nn.Linear(size, width)

    def initial_state(self, batch: int = 1) -> Any:
        return ()

    def chunk(self, features: Tensor, state: Any) -> tuple[Tensor, Any]:
        return self.head(self.lift(features)), state
