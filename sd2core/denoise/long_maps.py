"""Denoising of maps that do not fit into memory."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from sd2core.denoise import resample_to_model as matching
from sd2core.denoise.live import CHUNK, TrainedDenoiser
from sd2core.pairs.segments import OVERLAP

Read = Callable[[int, int], NDArray[np.float32]]
"""Returns the energies of frames from one to another (exclusive), (n, bins)."""

Write = Callable[[int, NDArray[np.float32]], None]
"""Takes the first frame, and its denoised energies and those of the next ones, (n, bins)."""

_BLOCK = 16 * CHUNK


def denoise_long(
    trained: TrainedDenoiser,
    runs: list[tuple[int, int]],
    times_s: NDArray[np.float64],
    read: Read,
    write: Write,
) -> None:
    """Denoise a long map block by block, with the result of :meth:`TrainedDenoiser.denoise`.

    A causal model continues from its last state; one of fixed windows gets the windows that it
    would get in the whole map. So results are equal to the rounding of single precision.

    ``runs`` are half-open ranges of frames that are clips of their own, from
    :func:`~sd2core.denoise.resample_to_model.clips`; ``times_s`` are the times of all frames, and
    ``write`` is called for the frames of all runs, in their order.
    """
    rate_hz = trained.card.frame_rate_hz
    for start, stop in runs:
        own_s = times_s[start:stop]
        if matching.is_regular(own_s, rate_hz):
            for first, answers in _blocks(trained, stop - start, _from(start, read)):
                write(start + first, answers)
        else:
            _at_rate(trained, start, own_s, read, write)


def _from(start: int, read: Read) -> Read:
    """Reader with frames counted from ``start``."""
    return lambda low, high: read(start + low, start + high)


def _at_rate(
    trained: TrainedDenoiser, start: int, times_s: NDArray[np.float64], read: Read, write: Write
) -> None:
    """Denoise one run of another or uneven frame rate, as :func:`matching.at_rate` does."""
    even_s = matching.even_times(times_s, trained.card.frame_rate_hz)

    def between(low: int, high: int) -> NDArray[np.float32]:
        first = max(int(np.searchsorted(times_s, even_s[low])) - 1, 0)
        last = min(int(np.searchsorted(times_s, even_s[high - 1])) + 1, len(times_s))
        values = read(start + first, start + last)
        return matching.interpolated(values, times_s[first:last], even_s[low:high])

    written = 0
    before = np.zeros((0, trained.card.axis.bins), np.float32)
    for low, answers in _blocks(trained, len(even_s), between):
        high = low + len(answers)
        known_s = even_s[low - len(before) : high]
        known = np.concatenate([before, answers])
        # A frame lies between two even times; the last one of a block has its second later.
        ready = len(times_s) if high == len(even_s) else int(np.searchsorted(times_s, known_s[-1]))
        if ready > written:
            write(start + written, matching.interpolated(known, known_s, times_s[written:ready]))
            written = ready
        before = answers[-1:]


def _blocks(
    trained: TrainedDenoiser, count: int, read: Read
) -> Iterator[tuple[int, NDArray[np.float32]]]:
    """Denoise frames at the model's rate block by block; yields first frames and results."""
    window = trained.network.window
    if window is None:
        live = trained.live()
        for low in range(0, count, _BLOCK):
            yield low, live.advance(read(low, min(low + _BLOCK, count)))
        return
    # Windows begin every so many frames from the start of the run.
    step = window - OVERLAP
    for low in range(0, count, _BLOCK):
        high = min(low + _BLOCK, count)
        first = max((low - window) // step * step, 0)
        last = min(high + window, count)
        yield low, trained.denoise_values(read(first, last))[low - first : high - first]
