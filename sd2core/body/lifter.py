"""From a track of landmarks to depth and motion along the line of sight.

A small temporal convolutional network, trained on simulated people (decision 18,
:mod:`sd2core.simulate.people`); here it only runs, on NumPy.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.body.bundled_file import open_arrays
from sd2core.body.lifter_features import (
    Seen,
    features,
    mirrored,
    rate,
    scale_of,
    typical_size,
)
from sd2core.body.track import LANDMARKS, MIRRORED
from sd2core.files.resources import resource_path

Singles = NDArray[np.float32]
Floats = NDArray[np.float64]

FORMAT = "sd2-lifter"
VERSION = 1
POINTS = len(LANDMARKS)
OUTPUTS = 2 + 4 * POINTS
"""Root and its spread, depths and theirs, velocities and theirs; spreads as logarithms.

Velocities are whole, or what is to be added to the rate of the depths: see
:attr:`Network.beyond_rates`.
"""

_VELOCITIES = slice(2 + 2 * POINTS, 2 + 3 * POINTS)

LOG_SIGMA = (-6.0, 1.5)
"""Between these the network's logarithms of spreads are held."""

_WINDOW = 600
_FAR = 8.0


@dataclass(frozen=True, eq=False)
class Network:
    """A stack of dilated convolutions over time, as arrays.

    Every block adds to what comes in: norm, bend, convolution of three frames,
    bend, matrix. Beyond the ends of a stretch everything is zero.

    Parameters
    ----------
    dilations : tuple of int
        Of the blocks.
    arrays : mapping of str to float32 array
        ``mean``, ``spread`` (C,) of the features; ``enter`` (C, H), ``enter_bias``;
        ``gain`` (n, H), ``wide`` (n, 3, H, H), ``wide_bias`` (n, H), ``flat`` (n, H, H),
        ``flat_bias`` (n, H); ``last_gain`` (H,), ``leave`` (H, OUTPUTS), ``leave_bias``.
    beyond_rates : bool
        Whether its velocities are what is to be added to the rate of its depths.
    """

    dilations: tuple[int, ...]
    arrays: Mapping[str, Singles]
    beyond_rates: bool = False

    @cached_property
    def reach(self) -> int:
        """How many frames away something can matter."""
        return sum(self.dilations)

    def __call__(self, told: Singles) -> Singles:
        """Outputs (T, OUTPUTS) of features (T, C), computed in windows."""
        parts = []
        for start in range(0, len(told), _WINDOW):
            stop = min(start + _WINDOW, len(told))
            first, last = max(start - self.reach, 0), min(stop + self.reach, len(told))
            parts.append(self.whole(told[first:last])[start - first : stop - first])
        return np.concatenate(parts)

    def whole(self, told: Singles) -> Singles:
        """The same in one piece."""
        a = self.arrays
        x = np.clip((told - a["mean"]) / a["spread"], -_FAR, _FAR)
        state = x @ a["enter"] + a["enter_bias"]
        for n, dilation in enumerate(self.dilations):
            inner = _convolved(_bent(_normed(state, a["gain"][n])), a["wide"][n], dilation)
            state = state + _bent(inner + a["wide_bias"][n]) @ a["flat"][n] + a["flat_bias"][n]
        result: Singles = _bent(_normed(state, a["last_gain"])) @ a["leave"] + a["leave_bias"]
        return result


@dataclass(frozen=True, eq=False)
class Lifter:
    """A trained network and how its spreads are calibrated.

    Parameters
    ----------
    network : Network
    calibration : float32 array, shape (OUTPUTS,)
        Added to what comes out: 0 but at the logarithms of spreads.
    provenance : mapping
        What it was trained on and by which command.
    """

    network: Network
    calibration: Singles
    provenance: Mapping[str, Any]

    @classmethod
    def load(cls, path: Path | None = None) -> Lifter:
        """Read the bundled lifter, or another one.

        Raises
        ------
        Sd2Error
            When the file is missing, damaged or of a later version.
        """
        path = resource_path("lifter.npz") if path is None else Path(path)
        command = "sd2 simulate train-lifter"
        with open_arrays(path, FORMAT, VERSION, "a lifter", command) as (meta, data):
            arrays = {name: data[name].astype(np.float32) for name in meta["arrays"]}
            calibration = data["calibration"].astype(np.float32)
        network = Network(tuple(meta["dilations"]), arrays, meta.get("beyond_rates", False))
        return cls(network, calibration, meta["provenance"])

    def outputs(self, seen: Seen, sample: Seen | None = None) -> Singles:
        """Calibrated outputs (T, OUTPUTS) of one stretch, velocities in full.

        The mean of what the network says of the stretch, of its mirror image, and of
        both played backwards, so that it treats sides and directions of time alike.
        What a person measures is taken from ``sample``, by default the stretch itself.
        """
        return symmetric(self.network, seen, sample) + self.calibration


def symmetric(network: Network, seen: Seen, sample: Seen | None = None) -> Singles:
    """Mean of the outputs over a stretch's mirror image and reversal, velocities in full."""
    sample = seen if sample is None else sample
    size = float(typical_size(sample.slopes))
    total = np.zeros((len(seen.sure), OUTPUTS), np.float32)
    for view, known in ((seen, sample), (mirrored(seen), mirrored(sample))):
        scale = scale_of(known)
        told = features(view, scale)
        backwards = features(Seen(*(np.asarray(part)[::-1] for part in view)), scale)
        ahead, back = network(told), network(backwards)
        if network.beyond_rates:
            ahead, back = with_rates(ahead, size), with_rates(back, size)
        back = back[::-1].copy()
        back[:, _VELOCITIES] *= -1.0
        both = ahead + back
        if view is not seen:
            rest = both[:, 2:].reshape(-1, 4, POINTS)[..., list(MIRRORED)]
            both = np.concatenate([both[:, :2], rest.reshape(len(both), -1)], axis=1)
        total += both
    return np.asarray(total / 4.0, np.float32)


def with_rates(out: Singles, size: float) -> Singles:
    """Outputs (T, OUTPUTS) with the rates of centre and depths added to the velocities.

    ``size`` is that of :func:`~sd2core.body.lifter_features.typical_size`.
    """
    full = out.copy()
    centre = np.exp(out[:, :1]) / np.float32(size) * rate(out[:, :1], 0)
    full[:, _VELOCITIES] += rate(out[:, 2 : 2 + POINTS], 0) + centre
    return full


def spread(logarithm: NDArray[np.floating]) -> Floats:
    """Standard deviation of its logarithm."""
    return np.asarray(np.exp(np.clip(logarithm, *LOG_SIGMA)))


def _convolved(x: Singles, kernel: Singles, dilation: int) -> Singles:
    """Convolution over three frames that far apart; zero beyond the ends."""
    result: Singles = x @ kernel[1]
    if len(x) > dilation:
        result[dilation:] += x[:-dilation] @ kernel[0]
        result[:-dilation] += x[dilation:] @ kernel[2]
    return result


def _normed(x: Singles, gain: Singles) -> Singles:
    """Every frame brought to root mean square 1, times a gain per channel."""
    power = np.mean(x * x, axis=1, keepdims=True)
    return np.asarray(x * (gain / np.sqrt(power + np.float32(1e-5))))


def _bent(x: Singles) -> Singles:
    """Every value times its logistic function."""
    return np.asarray(x * (np.float32(0.5) + np.float32(0.5) * np.tanh(np.float32(0.5) * x)))
