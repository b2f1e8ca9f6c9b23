"""Colours of radial velocities and of ranges, the same in every figure and in the window."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Rgb = NDArray[np.uint8]
"""Colours, shape (..., 3)."""

# Both ends differ in hue and lightness for every kind of colour vision; the
# colour rises quickly from the grey middle because a body mostly moves slowly.
_DIVERGING = (
    (0.00, "#123f86"),
    (0.15, "#2065b8"),
    (0.32, "#5a9ede"),
    (0.43, "#aacbea"),
    (0.50, "#e8e6e3"),
    (0.57, "#f1bd9e"),
    (0.68, "#e2794f"),
    (0.85, "#c0391f"),
    (1.00, "#84170d"),
)
# Near is bright, far is dark, as seen from the sensor; viridis (CC0), its ends cut.
_SEQUENTIAL = (
    (0.000, "#f2e51d"),
    (0.125, "#b5de2b"),
    (0.250, "#6ece58"),
    (0.375, "#35b779"),
    (0.500, "#1f9e89"),
    (0.625, "#26828e"),
    (0.750, "#31688e"),
    (0.875, "#3e4989"),
    (1.000, "#443a83"),
)


def rgb(colour: str) -> Rgb:
    """``#rrggbb`` as three bytes."""
    return np.frombuffer(bytes.fromhex(colour.removeprefix("#")), np.uint8)


def colour_table(anchors: tuple[tuple[float, str], ...]) -> Rgb:
    """256 colours between anchors from 0 to 1, shape (256, 3)."""
    positions = [position for position, _ in anchors]
    colours = np.array([rgb(colour) for _, colour in anchors], float)  # (anchors, 3)
    grid = np.linspace(0.0, 1.0, 256)
    channels = [np.interp(grid, positions, colours[:, channel]) for channel in range(3)]
    return np.rint(np.stack(channels, axis=1)).astype(np.uint8)


SEQUENTIAL = colour_table(_SEQUENTIAL)
"""Near to far, shape (256, 3)."""
DIVERGING = colour_table(_DIVERGING)
"""Receding to approaching, shape (256, 3)."""


def look_up(table: Rgb, values: NDArray[np.floating], low: float, high: float) -> Rgb:
    """Colours of values between two limits, held at both ends; shape (..., 3).

    Parameters
    ----------
    table : uint8 array, shape (256, 3)
        As :func:`colour_table` makes it.
    values : float array, shape (...)
        NaN has the first colour.
    low, high : float
        Values of the first and the last colour; ``low < high``.
    """
    share = (np.asarray(values, np.float32) - low) * (256.0 / (high - low))
    index = np.nan_to_num(np.clip(share, 0.0, 255.0), nan=0.0).astype(np.uint8)
    return table[index]


def velocity_colours(velocity_mps: NDArray[np.floating], v_max_mps: float) -> Rgb:
    """Diverging colours of radial velocities, fixed at ±``v_max_mps``; (V, 3)."""
    return look_up(DIVERGING, velocity_mps, -v_max_mps, v_max_mps)
