"""Colour maps as tables that NumPy can index."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from sd2core.files.resources import resource_path

_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
_TINT = np.array([1.0, 0.72, 0.42])
"""Amber, relative per channel; scaled to the luminance of each colour."""


@cache
def uncertain_table(name: str) -> NDArray[np.uint32]:
    """Table of the same lightness in grey, or in amber where the map itself is grey."""
    table = lookup_table(name)
    rgb = np.stack([table >> 16 & 255, table >> 8 & 255, table & 255], axis=1).astype(float)
    light = rgb @ _LUMINANCE
    grey = np.repeat(light[:, None], 3, axis=1)
    if np.ptp(rgb, axis=1).max() < 8:
        grey = light[:, None] * _TINT / (_TINT @ _LUMINANCE)
    channels = np.clip(np.rint(grey), 0, 255).astype(np.uint32)
    packed = 0xFF000000 | channels[:, 0] << 16 | channels[:, 1] << 8 | channels[:, 2]
    return packed.astype(np.uint32)


@cache
def signed_table(negative: str, middle: str, positive: str) -> NDArray[np.uint32]:
    """255 opaque colours from one to another (``#rrggbb``), by way of a third at number 127."""
    ends = [np.array([int(name[at : at + 2], 16) for at in (1, 3, 5)]) for name in
            (negative, middle, positive)]  # fmt: skip
    # A little more than proportional near the middle, where differences are told apart.
    share = np.linspace(0.0, 1.0, 128)[:, None] ** 0.8
    down, up = (ends[1] + share * (end - ends[1]) for end in (ends[0], ends[2]))
    rgb = np.rint(np.concatenate([down[:0:-1], up])).astype(np.uint32)  # (255, 3)
    return (0xFF000000 | rgb[:, 0] << 16 | rgb[:, 1] << 8 | rgb[:, 2]).astype(np.uint32)


@cache
def lookup_table(name: str) -> NDArray[np.uint32]:
    """256 opaque colours of a map as 0xAARRGGBB, shape (256,)."""
    with np.load(resource_path("colour_maps.npz")) as tables:
        rgb = tables[name].astype(np.uint32)  # (256, 3)
    return (0xFF000000 | rgb[:, 0] << 16 | rgb[:, 1] << 8 | rgb[:, 2]).astype(np.uint32)
