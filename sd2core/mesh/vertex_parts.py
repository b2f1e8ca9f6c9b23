"""Parts of the body that the vertices of a mesh belong to."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error

PARTS: tuple[str, ...] = (
    "trunk",
    "upper_arm.L",
    "upper_arm.R",
    "forearm.L",
    "forearm.R",
    "thigh.L",
    "thigh.R",
    "lower_leg.L",
    "lower_leg.R",
)
"""Parts of the body in the order of limb maps; L and R are the person's own sides. The trunk has
the head, forearms have the hands, lower legs the feet."""


@dataclass(frozen=True, eq=False)
class VertexParts:
    """Part of the body of every vertex."""

    names: tuple[str, ...]
    numbers: NDArray[np.uint8]  # (V,), into names

    def __post_init__(self) -> None:
        numbers = np.ascontiguousarray(self.numbers, np.uint8)
        most = int(numbers.max(initial=0))
        if numbers.ndim != 1 or most >= len(self.names):
            raise Sd2Error(
                f"Parts of shape {numbers.shape}, numbers up to {most}",
                f"one number per vertex, below {len(self.names)}",
            )
        object.__setattr__(self, "numbers", numbers)
