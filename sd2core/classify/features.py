"""Causal, gain-free features of the frames of a Doppler map.

All is causal and free of gain: a frame's features depend on it and on earlier frames,
and a map times any number gives the same ones. So live equals batch, and a classifier
that learnt from one radar's maps can be asked about a denoised map.

**Noise level.** The median over the last 5 s of the frames' own medians, over the bins that
are not nulled; but at least 40 dB below the loudest cell so far, which is forgotten with a
time constant of 20 s. A radar's noise fills most cells, so this is the noise; a synthetic
map is empty but for the movement, and there the second part is. (The median over a whole
take, as :func:`sd2core.denoise.metrics.stands_out` has it, is not known while live.)

**Target.** A frame has one where its strongest cell is more than 10 dB above that level.

``peak``
    The paper's feature, the Doppler bin of maximum intensity: its velocity as a share of
    the axis' end, and 1 where the frame has a target. Both are 0 where it has none.
``columns``
    The whole column: log10(1 + x / (10 noise)) of every bin. What is at the noise level is
    about 0, and 40 dB above it is 3. Most cells are near 0, so the whole is about as large
    as a network's numbers should be.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray

from sd2core.classify.defaults import FeatureKind
from sd2core.errors import Sd2Error
from sd2core.sensor import VelocityAxis

KINDS: tuple[FeatureKind, ...] = get_args(FeatureKind)

STANDS_OUT = 10.0
"""How far above the noise a target is, as a ratio of energies."""
NOISE_S = 5.0
"""For so long the noise level is remembered."""
LOUDEST_S = 20.0
"""Time constant with which the loudest cell is forgotten."""
RANGE = 1e4
"""The noise level is no further below the loudest cell than this ratio of energies."""

_BLOCK = 4096


class Heard(NamedTuple):
    """State of the features after some frames."""

    medians: NDArray[np.float64]  # of the last frames (up to 5 s), the newest at the end
    loudest_log: float
    """Logarithm of the loudest cell so far; minus infinity where there was no energy."""


SILENCE = Heard(np.zeros(0), -np.inf)
"""Before the first frame."""


@dataclass(frozen=True)
class Features:
    """Conversion of frames to features."""

    kind: FeatureKind
    axis: VelocityAxis
    null_bins: tuple[int, ...]  # ignored
    frame_rate_hz: float

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise Sd2Error(f"The features are {self.kind!r}", f"one of {', '.join(KINDS)}")
        if len(self.axis.checked_bins(self.null_bins, "null_bins")) >= self.axis.bins:
            raise Sd2Error(
                f"All {self.axis.bins} bins are nulled", "bins in which a movement can be seen"
            )

    @property
    def size(self) -> int:
        """Number of features per frame."""
        return 2 if self.kind == "peak" else self.axis.bins

    def of(
        self, energies: NDArray[np.floating], heard: Heard = SILENCE
    ) -> tuple[NDArray[np.float32], Heard]:
        """Compute the features of the next frames: float32, shape (frames, :attr:`size`).

        ``energies`` (frames, bins) are not negative. ``heard`` is the state that the
        previous call returned; the default begins a clip.
        """
        if energies.ndim != 2 or energies.shape[1] != self.axis.bins:
            raise Sd2Error(
                f"The values are of shape {energies.shape}", f"(frames, {self.axis.bins})"
            )
        values = np.array(energies, np.float64)
        values[:, list(self.null_bins)] = 0.0
        noise, heard = self._noise(values, heard)
        if self.kind == "peak":
            return self._peak(values, noise), heard
        scale = np.where(noise > 0, STANDS_OUT * noise, 1.0)[:, None]
        shown = np.log10(1.0 + values / scale)
        return shown.astype(np.float32), heard

    def _peak(self, values: NDArray[np.float64], noise: NDArray[np.float64]) -> NDArray[np.float32]:
        target = values.max(axis=1) > STANDS_OUT * noise
        velocity = self.axis.centres_mps[values.argmax(axis=1)] / self.axis.v_max_mps
        return np.stack([np.where(target, velocity, 0.0), target], axis=1).astype(np.float32)

    def _noise(
        self, values: NDArray[np.float64], heard: Heard
    ) -> tuple[NDArray[np.float64], Heard]:
        """Compute the noise level of every frame, (frames,), and the next state."""
        if not len(values):
            return np.zeros(0), heard
        window = max(round(NOISE_S * self.frame_rate_hz), 1)
        medians = np.median(np.delete(values, list(self.null_bins), axis=1), axis=1)
        known = np.concatenate([heard.medians, medians])
        loudest_log = self._loudest_log(values.max(axis=1), heard.loudest_log)
        noise = np.maximum(
            _running_median(known, window)[len(heard.medians) :], np.exp(loudest_log) / RANGE
        )
        return noise, Heard(known[-window:], float(loudest_log[-1]))

    def _loudest_log(self, loudest: NDArray[np.float64], before: float) -> NDArray[np.float64]:
        """Compute the decaying running maximum, as logarithms, (frames,)."""
        with np.errstate(divide="ignore"):
            level = np.log(loudest)
        fallen = np.arange(1, len(level) + 1) / (LOUDEST_S * self.frame_rate_hz)
        highest = np.maximum.accumulate(np.append(before, level + fallen))[1:]
        return np.asarray(highest - fallen)


def _running_median(values: NDArray[np.float64], window: int) -> NDArray[np.float64]:
    """Running median over a window that ends at every value."""
    medians = np.empty(len(values))
    early = min(window - 1, len(values))
    for last in range(early):
        medians[last] = np.median(values[: last + 1])
    if len(values) >= window:
        rows = np.lib.stride_tricks.sliding_window_view(values, window)
        # In blocks: a long recording's windows would not fit into memory at once.
        for start in range(0, len(rows), _BLOCK):
            block = rows[start : start + _BLOCK]
            medians[early + start : early + start + len(block)] = np.median(block, axis=1)
    return medians
