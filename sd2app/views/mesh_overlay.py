"""The mesh blended over the picture it was fitted to."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def blend(
    picture: NDArray[np.uint8],
    light: NDArray[np.float32],
    colour: tuple[int, ...],
    opacity: float,
) -> NDArray[np.uint8]:
    """A copy of the picture with the mesh over it."""
    covered = light > 0
    paint = light[covered][:, None] * np.array(colour, np.float32)  # (N, 3)
    result = picture.copy()
    kept = picture[covered] * np.float32(1.0 - opacity)
    result[covered] = (kept + np.float32(opacity) * paint).astype(np.uint8)
    return result
