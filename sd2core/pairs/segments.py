"""Cutting of clips into windows of equal length, and joining them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error

LENGTH = 72
OVERLAP = 10
"""Frames, as the paper cuts them."""


def segment_starts(frames: int, length: int = LENGTH, overlap: int = OVERLAP) -> NDArray[np.int64]:
    """Return the first frames of the windows that cover a clip.

    Neighbours share ``overlap`` frames; the last window ends with the stretch and may
    share more. A stretch shorter than a window has none.
    """
    if not 0 <= overlap < length:
        raise Sd2Error(
            f"Windows of {length} frames overlap by {overlap}", f"an overlap of 0 to {length - 1}"
        )
    if frames < length:
        return np.zeros(0, np.int64)
    starts = np.arange(0, frames - length + 1, length - overlap)
    if starts[-1] + length < frames:
        starts = np.append(starts, frames - length)
    return starts


def cut(
    values: NDArray[np.float32], starts: NDArray[np.int64], length: int = LENGTH
) -> NDArray[np.float32]:
    """Cut a clip into windows: (frames, …, bins) → (windows, length, …, bins)."""
    cut_out: NDArray[np.float32] = values[starts[:, None] + np.arange(length)]
    return cut_out


def join(
    windows: NDArray[np.float32], starts: NDArray[np.int64], frames: int
) -> NDArray[np.float32]:
    """Join windows, blended linearly where they overlap, to an array of shape (frames, bins).

    ``starts`` are first frames, one per window; together the windows cover every frame.
    """
    length = windows.shape[1]
    # Towards its ends a window knows less of what is around a frame.
    ramp = np.minimum(np.arange(1, length + 1), np.arange(length, 0, -1)).astype(np.float64)
    joined = np.zeros((frames, windows.shape[2]))
    weight = np.zeros(frames)
    for window, start in zip(windows, starts, strict=True):
        joined[start : start + length] += ramp[:, None] * window
        weight[start : start + length] += ramp
    if not weight.all():
        raise ValueError(f"frame {int(np.argmin(weight))} is in no window")
    return (joined / weight[:, None]).astype(np.float32)
