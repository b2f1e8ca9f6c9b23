"""A word in the corner of a picture, drawn with round strokes: no font is needed."""

from __future__ import annotations

from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Singles = NDArray[np.float32]

_HEIGHT_PX = 11.0
_MARGIN_PX = 12.0
_STROKE_PX = 1.35

# Strokes of letters 1 unit high (capital), x right, y down from the cap line; an
# arc is (centre x, centre y, radius x, radius y, first angle, last angle) in
# degrees from the right, clockwise; a line is (x0, y0, x1, y1).
_X = 0.34
_LETTERS: dict[str, tuple[float, tuple[tuple[float, ...], ...]]] = {
    "S": (
        0.60,
        ((0.30, 0.26, 0.27, 0.26, 90, 330), (0.30, 0.75, 0.28, 0.25, -90, 150)),
    ),
    "i": (0.10, ((0.05, _X, 0.05, 1.0), (0.05, 0.08, 0.05, 0.09))),
    "m": (
        0.80,
        (
            (0.04, _X, 0.04, 1.0),
            (0.22, 0.54, 0.18, 0.20, 180, 360),
            (0.40, 0.54, 0.40, 1.0),
            (0.58, 0.54, 0.18, 0.20, 180, 360),
            (0.76, 0.54, 0.76, 1.0),
        ),
    ),
    "u": (
        0.48,
        (
            (0.04, _X, 0.04, 0.78),
            (0.24, 0.78, 0.20, 0.22, 0, 180),
            (0.44, _X, 0.44, 1.0),
        ),
    ),
    "l": (0.10, ((0.05, 0.0, 0.05, 1.0),)),
    "a": (0.52, ((0.25, 0.67, 0.23, 0.33, 0, 360), (0.48, _X, 0.48, 1.0))),
    "t": (
        0.36,
        ((0.14, 0.10, 0.14, 0.84), (0.30, 0.84, 0.16, 0.16, 90, 180), (0.0, _X, 0.34, _X)),
    ),
    "e": (0.50, ((0.25, 0.67, 0.23, 0.33, 40, 360), (0.02, 0.67, 0.48, 0.67))),
    "d": (0.52, ((0.25, 0.67, 0.23, 0.33, 0, 360), (0.48, 0.0, 0.48, 1.0))),
}
_SPACING = 0.21


def stamp(picture: Singles, word: str) -> Singles:
    """The picture (H, W, 3; sRGB 0 to 1) with a word in its lower right corner."""
    height, width = picture.shape[:2]
    ink = _ink(word)
    stamped = picture.copy()
    top = height - ink.shape[0]
    left = width - ink.shape[1]
    if top < 0 or left < 0:
        return stamped
    corner = stamped[top:, left:]
    shadow = np.roll(ink, (1, 1), axis=(0, 1))[..., None]
    corner *= 1.0 - 0.35 * shadow
    corner += 0.85 * ink[..., None] * (1.0 - corner)
    return stamped


@lru_cache(maxsize=4)
def _ink(word: str) -> Singles:
    """Coverage from 0 to 1 of a word's box with its margins."""
    strokes: list[NDArray[np.float64]] = []
    x = 0.0
    for letter in word:
        advance, parts = _LETTERS[letter]
        strokes += [_points(part) + np.array([x, 0.0]) for part in parts]
        x += advance + _SPACING
    width = round((x - _SPACING) * _HEIGHT_PX + 2 * _MARGIN_PX)
    height = round(_HEIGHT_PX + 2 * _MARGIN_PX)
    rows, columns = np.mgrid[:height, :width] + 0.5
    pixels = np.stack([columns, rows], axis=-1) - _MARGIN_PX
    distance = np.full((height, width), np.inf)
    for stroke in strokes:
        scaled = stroke * _HEIGHT_PX
        for start, end in pairwise(scaled):
            distance = np.minimum(distance, _distance(pixels, start, end))
    return np.clip(0.5 + 0.5 * _STROKE_PX - distance, 0.0, 1.0).astype(np.float32)


def _points(part: tuple[float, ...]) -> NDArray[np.float64]:
    if len(part) == 4:
        return np.array(part).reshape(2, 2)
    x, y, rx, ry, first, last = part
    angle = np.radians(np.linspace(first, last, 25))
    return np.stack([x + rx * np.cos(angle), y + ry * np.sin(angle)], axis=1)


def _distance(
    pixels: NDArray[np.float64], start: NDArray[np.float64], end: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Distance of pixels (H, W, 2) to a line segment."""
    line = end - start
    along = np.clip((pixels - start) @ line / max(float(line @ line), 1e-12), 0.0, 1.0)
    distance: NDArray[np.float64] = np.linalg.norm(
        pixels - start - along[..., None] * line, axis=-1
    )
    return distance
