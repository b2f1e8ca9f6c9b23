"""Colour maps as tables that NumPy can index."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray


@cache
def lookup_table(name: str) -> NDArray[np.uint32]:
    """256 opaque colours of a matplotlib map as 0xAARRGGBB, shape (256,)."""
    from matplotlib import colormaps

    rgb = colormaps[name](np.arange(256), bytes=True).astype(np.uint32)  # (256, 4)
    return (0xFF000000 | rgb[:, 0] << 16 | rgb[:, 1] << 8 | rgb[:, 2]).astype(np.uint32)
