"""Filters without training, the baselines of the networks.

All are causal. They work on compressed values, as the networks do.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from sd2core.denoise.model import Denoiser, State

_MEDIANS = ((3, 1), (3, 3), (5, 1), (5, 3), (7, 1), (7, 3))
"""Sizes of the median to choose from, in frames and bins."""

_RIDGES = (1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1.0)
"""Ridges to choose from, as shares of the features' mean variance."""

_MEDIAN_FRAMES = 50_000
"""Number of frames from which a median and its gain are chosen."""


class NoDenoiser(Denoiser):
    """No denoising: synthetic energy, only scaled to the level of the radar's."""

    def initial_state(self, batch: int = 1) -> State:
        """No state."""
        return None

    def chunk(self, values: Tensor, state: State) -> tuple[Tensor, State]:
        """Return the values."""
        return values, state


class _Neighbourhood(Denoiser):
    """Base of filters over the frames before a cell and the bins beside it."""

    def __init__(self, bins: int, frames: int, width: int) -> None:
        super().__init__(bins)
        self.frames = frames
        self.width = width

    def initial_state(self, batch: int = 1) -> State:
        """No state: the first frame of a clip also stands for those before it."""
        return None

    def neighbours(self, values: Tensor, state: State) -> tuple[Tensor, State]:
        """Neighbours of (B, L, bins), (B, L, bins, frames · width), oldest and lowest first."""
        if state is None:
            state = values[:, :1].expand(-1, self.frames - 1, -1)
        known = torch.cat([state, values], 1)  # (B, frames − 1 + L, bins)
        side = self.width // 2
        padded = nn.functional.pad(known, (side, side), "replicate")
        around = padded.unfold(1, self.frames, 1).unfold(2, self.width, 1)
        return around.flatten(3), known[:, known.shape[1] - self.frames + 1 :]


class MedianDenoiser(_Neighbourhood):
    """Median over the last frames and the neighbouring bins, times one number.

    ``frames`` and ``width`` are odd.
    """

    def __init__(self, bins: int, *, frames: int = 5, width: int = 3) -> None:
        super().__init__(bins, frames, width)
        self.level = nn.Parameter(torch.ones(()), requires_grad=False)

    def chunk(self, values: Tensor, state: State) -> tuple[Tensor, State]:
        """Compute the median of the neighbours."""
        around, state = self.neighbours(values, state)
        return self.level * around.median(-1).values, state


class WienerDenoiser(_Neighbourhood):
    """Causal linear filter of least squared error (N. Wiener, 1949), and a mean per bin.

    The same weights for all bins; they solve the Wiener–Hopf equations of the training takes. The
    filter spans ``frames`` by ``width`` cells; the width is odd.
    """

    def __init__(self, bins: int, *, frames: int = 9, width: int = 5) -> None:
        super().__init__(bins, frames, width)
        here = torch.zeros(frames, width)
        here[-1, width // 2] = 1.0
        self.weight = nn.Parameter(here.flatten(), requires_grad=False)
        self.mean = nn.Parameter(torch.zeros(bins), requires_grad=False)

    def chunk(self, values: Tensor, state: State) -> tuple[Tensor, State]:
        """Compute the weighted sum of the neighbours."""
        around, state = self.neighbours(values, state)
        return around @ self.weight + self.mean, state


class RidgeDenoiser(_Neighbourhood):
    """Linear map of all bins of the last frames to all bins, and a mean per bin."""

    def __init__(self, bins: int, *, frames: int = 9) -> None:
        super().__init__(bins, frames, 1)
        here = torch.zeros(bins, frames, bins)
        here[:, -1] = torch.eye(bins)
        self.weight = nn.Parameter(here.flatten(0, 1), requires_grad=False)
        self.mean = nn.Parameter(torch.zeros(bins), requires_grad=False)

    def chunk(self, values: Tensor, state: State) -> tuple[Tensor, State]:
        """Compute the weighted sums of the last frames."""
        around, state = self.neighbours(values, state)
        return around.flatten(2) @ self.weight + self.mean, state


def fit_median(
    inputs: Sequence[NDArray[np.float32]],
    targets: Sequence[NDArray[np.float32]],
    null_bins: Sequence[int] = (),
) -> MedianDenoiser:
    """Choose the median filter, and its gain, of least squared error.

    Inputs and targets are compressed, (frames, bins), one per take; only some of many takes are
    used. ``null_bins`` do not count.
    """
    stride = max(1, sum(map(len, inputs)) // _MEDIAN_FRAMES)
    bins = inputs[0].shape[1]
    counted = _counted(bins, null_bins)
    best: tuple[float, MedianDenoiser] | None = None
    for frames, width in _MEDIANS:
        candidate = MedianDenoiser(bins, frames=frames, width=width)
        cross, power = 0.0, 0.0
        for one, target in zip(inputs[::stride], targets[::stride], strict=True):
            clean = candidate(torch.from_numpy(one)[None])[0].numpy()[:, counted].astype(np.float64)
            cross += float((clean * target[:, counted]).sum())
            power += float((clean**2).sum())
        # With the best factor cross / power the squared error falls by cross² / power.
        gained = cross**2 / power if power > 0 else 0.0
        if best is None or gained > best[0]:
            candidate.level.fill_(cross / power if power > 0 else 1.0)
            best = gained, candidate
    assert best is not None
    return best[1]


def fit_wiener(
    inputs: Sequence[NDArray[np.float32]],
    targets: Sequence[NDArray[np.float32]],
    null_bins: Sequence[int] = (),
) -> WienerDenoiser:
    """Fit a Wiener filter in closed form; what is given is as for :func:`fit_median`."""
    bins = inputs[0].shape[1]
    counted = _counted(bins, null_bins)
    wiener = WienerDenoiser(bins)
    taps, rows = len(wiener.weight), sum(map(len, inputs))
    first_x, first_y = np.zeros((len(counted), taps)), np.zeros(len(counted))
    gram, cross = np.zeros((taps, taps)), np.zeros(taps)
    for one, target in zip(inputs, targets, strict=True):
        around = wiener.neighbours(torch.from_numpy(one)[None], None)[0][0]
        x = around.numpy()[:, counted].astype(np.float64)  # (L, counted, taps)
        y = target[:, counted].astype(np.float64)
        first_x += x.sum(0)
        first_y += y.sum(0)
        flat = x.reshape(-1, taps)
        gram += flat.T @ flat
        cross += flat.T @ y.ravel()
    mean_x, mean_y = first_x / rows, first_y / rows
    # Deviations from the means per bin, which are added again at the end.
    gram -= rows * mean_x.T @ mean_x
    cross -= rows * mean_x.T @ mean_y
    # Neighbouring cells of smoothed maps are nearly alike.
    gram += 1e-7 * np.trace(gram) / taps * np.eye(taps)
    weight = np.linalg.lstsq(gram, cross, rcond=None)[0]
    wiener.weight.copy_(torch.from_numpy(weight))
    wiener.mean[counted] = torch.from_numpy(mean_y - mean_x @ weight).float()
    return wiener


def fit_ridge(
    inputs: Sequence[NDArray[np.float32]],
    targets: Sequence[NDArray[np.float32]],
    null_bins: Sequence[int] = (),
) -> RidgeDenoiser:
    """Fit a ridge regression (A. E. Hoerl and R. W. Kennard, 1970) in closed form.

    The ridge is the one of :data:`_RIDGES` that does best on every fifth take, fitted to the
    others; of fewer than five takes it is the largest. What is given is as for :func:`fit_median`;
    the answer is 0 in bins that do not count.
    """
    bins = inputs[0].shape[1]
    ridge = RidgeDenoiser(bins)
    counted = _counted(bins, null_bins)
    sums = [
        _Sums.of(ridge, one, target[:, counted])
        for one, target in zip(inputs, targets, strict=True)
    ]
    chosen = max(_RIDGES)
    if len(sums) >= 5:
        known = _Sums.added([one for number, one in enumerate(sums) if number % 5])
        held_out = _Sums.added(sums[::5])
        chosen = min(_RIDGES, key=lambda size: held_out.squared_error(*known.solution(size)))
    weight, mean = _Sums.added(sums).solution(chosen)
    ridge.weight.zero_()[:, counted] = torch.from_numpy(weight).float()
    ridge.mean[counted] = torch.from_numpy(mean).float()
    return ridge


class _Sums(NamedTuple):
    """Sums over frames that a linear regression is made of; features end with a one."""

    gram: NDArray[np.float64]  # (n + 1, n + 1)
    cross: NDArray[np.float64]  # (n + 1, bins)
    power: float

    @classmethod
    def of(
        cls, ridge: RidgeDenoiser, values: NDArray[np.float32], target: NDArray[np.float32]
    ) -> _Sums:
        around = ridge.neighbours(torch.from_numpy(values)[None], None)[0][0].flatten(1).numpy()
        x = np.column_stack([around, np.ones(len(around))]).astype(np.float64)
        y = target.astype(np.float64)
        return cls(x.T @ x, x.T @ y, float((y**2).sum()))

    @classmethod
    def added(cls, several: Sequence[_Sums]) -> _Sums:
        gram, cross, power = (sum(parts) for parts in zip(*several, strict=True))
        return cls(gram, cross, power)

    def solution(self, ridge: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Weights (n, bins) and means (bins,); the ridge is a share of the features' variance."""
        middle = self.gram[:-1, -1] / self.gram[-1, -1]
        average = self.cross[-1] / self.gram[-1, -1]
        gram = self.gram[:-1, :-1] - self.gram[-1, -1] * np.outer(middle, middle)
        cross = self.cross[:-1] - self.gram[-1, -1] * np.outer(middle, average)
        # Bins that are always empty have no variance.
        size = max(float(np.trace(gram)) / len(gram), 1e-30)
        weight = np.linalg.solve(gram + ridge * size * np.eye(len(gram)), cross)
        return weight, average - middle @ weight

    def squared_error(self, weight: NDArray[np.float64], mean: NDArray[np.float64]) -> float:
        whole = np.vstack([weight, mean])
        return self.power - float((whole * (2.0 * self.cross - self.gram @ whole)).sum())


def _counted(bins: int, null_bins: Sequence[int]) -> list[int]:
    return [number for number in range(bins) if number not in set(null_bins)]
