"""Convolutional network over time, on NumPy; trained by ``python -m tools.train_lifter``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

Singles = NDArray[np.float32]

_WINDOW_FRAMES = 600
_FAR = 8.0


@dataclass(frozen=True, eq=False)
class Network:
    """A stack of dilated convolutions over time, as arrays.

    Every block adds to its input: norm, SiLU, convolution of three frames, SiLU, matrix. Beyond the
    ends of a stretch everything is zero. ``arrays`` holds ``mean``, ``spread`` (C,) of the
    features; ``enter`` (C, H), ``enter_bias``; ``gain`` (n, H), ``wide`` (n, 3, H, H),
    ``wide_bias`` (n, H), ``flat`` (n, H, H), ``flat_bias`` (n, H); ``last_gain`` (H,), ``leave``
    (H, M) and ``leave_bias``, for M outputs.
    """

    dilations: tuple[int, ...]
    arrays: Mapping[str, Singles]

    @cached_property
    def reach(self) -> int:
        """Receptive field: frames to either side that can matter."""
        return sum(self.dilations)

    def __call__(self, features: Singles) -> Singles:
        """Outputs (T, M) of features (T, C), computed in windows."""
        parts = []
        for start in range(0, len(features), _WINDOW_FRAMES):
            stop = min(start + _WINDOW_FRAMES, len(features))
            first, last = max(start - self.reach, 0), min(stop + self.reach, len(features))
            parts.append(self.whole(features[first:last])[start - first : stop - first])
        return np.concatenate(parts)

    def whole(self, features: Singles) -> Singles:
        """Outputs of features, computed in one piece."""
        a = self.arrays
        x = np.clip((features - a["mean"]) / a["spread"], -_FAR, _FAR)
        state = x @ a["enter"] + a["enter_bias"]
        for n, dilation in enumerate(self.dilations):
            inner = _convolved(_silu(_rms_norm(state, a["gain"][n])), a["wide"][n], dilation)
            state = state + _silu(inner + a["wide_bias"][n]) @ a["flat"][n] + a["flat_bias"][n]
        return _silu(_rms_norm(state, a["last_gain"])) @ a["leave"] + a["leave_bias"]


def network_of(meta: Mapping[str, Any], data: Mapping[str, NDArray[Any]]) -> Network:
    """The network in a bundled file."""
    arrays = {name: data[name].astype(np.float32) for name in meta["arrays"]}
    return Network(tuple(meta["dilations"]), arrays)


def _convolved(x: Singles, kernel: Singles, dilation: int) -> Singles:
    """Convolution over three frames ``dilation`` apart; zero beyond the ends."""
    result: Singles = x @ kernel[1]
    if len(x) > dilation:
        result[dilation:] += x[:-dilation] @ kernel[0]
        result[:-dilation] += x[dilation:] @ kernel[2]
    return result


def _rms_norm(x: Singles, gain: Singles) -> Singles:
    """Root-mean-square norm of every frame, times a gain per channel."""
    power = np.mean(x * x, axis=1, keepdims=True)
    return np.asarray(x * (gain / np.sqrt(power + np.float32(1e-5))))


def _silu(x: Singles) -> Singles:
    """SiLU: every value times its logistic function."""
    return np.asarray(x * (np.float32(0.5) + np.float32(0.5) * np.tanh(np.float32(0.5) * x)))
