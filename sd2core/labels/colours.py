"""Colours of labels: a palette, and pairs that are hard to tell apart.

Every label also has a name and a key, so colour is never the only sign.
"""

from __future__ import annotations

from functools import lru_cache
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sd2core.labels.label_set import Label

OFFERED: tuple[tuple[str, str], ...] = (
    ("blue", "#0072b2"),
    ("sky blue", "#56b4e9"),
    ("vermilion", "#d55e00"),
    ("orange", "#e69f00"),
    ("grey", "#999999"),
    ("yellow", "#f0e442"),
    ("wine", "#882255"),
    ("indigo", "#332288"),
)
"""Name and ``#rrggbb``. Any two are further apart than :data:`ALIKE` in every kind of vision."""

ALIKE = 0.06
"""Distance in OKLab below which two colours pass for one in a thin edge or a pale tint."""

_Matrix = NDArray[np.float64]

# Severity 1 of Machado, Oliveira and Fernandes (2009), on linear RGB.
_VISION: dict[str, _Matrix] = {
    "": np.eye(3),
    "without red cones": np.array(
        [
            [0.152286, 1.052583, -0.204868],
            [0.114503, 0.786281, 0.099216],
            [-0.003882, -0.048116, 1.051998],
        ]
    ),
    "without green cones": np.array(
        [
            [0.367322, 0.860646, -0.227968],
            [0.280085, 0.672501, 0.047413],
            [-0.011820, 0.042940, 0.968881],
        ]
    ),
    "without blue cones": np.array(
        [
            [1.255528, -0.076749, -0.178779],
            [-0.078411, 0.930809, 0.147602],
            [0.004733, 0.691367, 0.303900],
        ]
    ),
}
# Ottosson's OKLab: linear RGB to cone responses, and their cube roots to L, a, b.
_CONES = np.array(
    [
        [0.4122214708, 0.5363325363, 0.0514459929],
        [0.2119034982, 0.6806995451, 0.1073969566],
        [0.0883024619, 0.2817188376, 0.6299787005],
    ]
)
_LAB = np.array(
    [
        [0.2104542553, 0.7936177850, -0.0040720468],
        [1.9779984951, -2.4285922050, 0.4505937099],
        [0.0259040371, 0.7827717662, -0.8086757660],
    ]
)


class Alike(NamedTuple):
    """Two labels whose colours look alike, to all viewers or with a colour vision deficiency.

    ``vision`` is, for instance, "without red cones"; empty for normal colour vision.
    """

    one: str
    other: str
    vision: str

    def words(self) -> str:
        """Sentence without its full stop."""
        to_whom = f" to eyes {self.vision}" if self.vision else ""
        return f"{self.one} and {self.other} look alike{to_whom}"


@lru_cache(maxsize=4)  # 30 labels take 50 ms, and are the same at most edits
def alike(labels: tuple[Label, ...]) -> tuple[Alike, ...]:
    """Find pairs of labels whose colours look alike, each with the first vision that fails."""
    pairs = []
    for one, other in combinations(labels, 2):
        for vision in _VISION:
            if distance(one.colour, other.colour, vision) < ALIKE:
                pairs.append(Alike(one.name, other.name, vision))
                break
    return tuple(pairs)


def distance(one: str, other: str, vision: str = "") -> float:
    """Return the distance of two colours in OKLab, where black and white are 1 apart."""
    return float(np.linalg.norm(_lab(one, vision) - _lab(other, vision)))


def _lab(colour: str, vision: str) -> NDArray[np.float64]:
    stored = np.array([int(colour[at : at + 2], 16) for at in (1, 3, 5)]) / 255.0
    linear = np.where(stored <= 0.04045, stored / 12.92, ((stored + 0.055) / 1.055) ** 2.4)
    seen = np.clip(_VISION[vision] @ linear, 0.0, 1.0)
    return _LAB @ np.cbrt(_CONES @ seen)
