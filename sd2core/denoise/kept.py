"""What follows from a module's parameters, kept while nothing is being learned."""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any, Self

import torch
from torch import Tensor, nn

MAX_KEPT = 8


class Keeping(nn.Module):
    """Module that keeps what follows from its parameters alone, until one of them changes."""

    def __init__(self) -> None:
        super().__init__()
        self._kept: dict[int | str, Any] = {}
        self._held: tuple[Tensor, ...] = ()
        self._counts: tuple[int, ...] = ()

    def learning(self) -> bool:
        """Whether the parameters may be about to change, so that nothing is kept."""
        return self.training or torch.is_grad_enabled()

    def keep(self, key: int | str, make: Callable[[], Any]) -> Any:
        """Give what was made under a key, or make it."""
        if self.learning():
            return make()
        # Parameters count what is done to them in place; all else that can change them goes
        # through the methods below.
        held = tuple(self._parameters.values())
        counts = tuple(0 if p.is_inference() else p._version for p in held)
        same = counts == self._counts and all(map(operator.is_, held, self._held))
        if not same or len(self._kept) > MAX_KEPT:
            self._forget()
            self._held, self._counts = held, counts
        if key not in self._kept:
            self._kept[key] = make()
        return self._kept[key]

    def _forget(self) -> None:
        self._kept, self._held, self._counts = {}, (), ()

    def train(self, mode: bool = True) -> Self:
        """Set the mode as `nn.Module.train` does, and drop what was derived from the weights."""
        self._forget()
        return super().train(mode)

    def _apply(self, *args: Any, **options: Any) -> Any:
        self._forget()
        return super()._apply(*args, **options)

    def _load_from_state_dict(self, *args: Any, **options: Any) -> None:
        self._forget()
        super()._load_from_state_dict(*args, **options)

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_kept": {}, "_held": (), "_counts": ()}
