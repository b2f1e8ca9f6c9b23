"""Validation of a model on segments that it does not learn from."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import torch
from numpy.typing import NDArray

from sd2core.denoise.metrics import velocity_error
from sd2core.denoise.model import Denoiser
from sd2core.denoise.scaling import Scaling
from sd2core.maps import peak_velocity_mps
from sd2core.sensor import VelocityAxis
from sd2core.train.data import Segments

_BATCH = 256


@dataclass(frozen=True)
class Validation:
    """Errors on segments."""

    rmse: float  # of compressed values, over bins that are not nulled; equals the loss
    mae_mps: float
    """Of the peak velocity per frame, as :mod:`sd2core.denoise.metrics` defines it, in frames in
    which something moves. A model begins each segment without a state; ``sd2 eval``, which
    gives it whole takes, finds less."""
    answers: NDArray[np.float32]  # energies, (segments, length, bins), 0 in nulled bins


@dataclass(frozen=True, eq=False)
class Validator:
    """Segments that a model is validated on."""

    inputs: torch.Tensor  # compressed, (segments, length, features)
    targets: torch.Tensor  # compressed, (segments, length, bins)
    peaks_mps: NDArray[np.float64]
    """Of the targets, (segments · length,); NaN in frames in which nothing moves."""
    scaling: Scaling
    axis: VelocityAxis
    counted: tuple[int, ...]  # bins that are not nulled

    def on(self, device: torch.device) -> Validator:
        """Copy on a device."""
        return replace(self, inputs=self.inputs.to(device), targets=self.targets.to(device))

    @classmethod
    def of(
        cls, segments: Segments, scaling: Scaling, axis: VelocityAxis, null_bins: tuple[int, ...]
    ) -> Validator:
        """Build it from segments of energies.

        Parameters
        ----------
        segments : Segments
        scaling : Scaling
            Compresses inputs and targets.
        axis : VelocityAxis
        null_bins : tuple of int
            Not counted, in error or peak.
        """
        energies = segments.targets.reshape(-1, axis.bins).copy()
        energies[:, list(null_bins)] = 0.0
        return cls(
            torch.from_numpy(scaling.compress_input(segments.inputs)),
            torch.from_numpy(scaling.target.compress(segments.targets)),
            np.where(segments.moving.ravel(), peak_velocity_mps(energies, axis), np.nan),
            scaling,
            axis,
            tuple(number for number in range(axis.bins) if number not in null_bins),
        )


def validate(model: Denoiser, validator: Validator) -> Validation:
    """Measure a model."""
    training = model.training
    model.eval()
    squares, cells = 0.0, 0
    batches = []
    bins = validator.axis.bins
    nulled = [number for number in range(bins) if number not in validator.counted]
    try:
        with torch.no_grad():
            for start in range(0, len(validator.inputs), _BATCH):
                batch = slice(start, start + _BATCH)
                answer = model(validator.inputs[batch]).float()
                difference = (answer - validator.targets[batch])[..., list(validator.counted)]
                squares += float(difference.double().square().sum())
                cells += difference.numel()
                energies = validator.scaling.target.expand(answer.cpu().numpy())
                energies[..., nulled] = 0.0
                batches.append(energies)
    finally:
        model.train(training)
    answers = np.concatenate(batches)
    peaks_mps = peak_velocity_mps(answers.reshape(-1, bins), validator.axis)
    error = velocity_error(peaks_mps, validator.peaks_mps)
    return Validation((squares / cells) ** 0.5, error.mae_mps, answers)
