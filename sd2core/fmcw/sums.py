"""Sum of many echoes to one frame of an FMCW signal: directly, or by a non-uniform FFT.

An echo at range R that grows at rate r has, at time t_m of chirp m and t_n of
sample n from the middles of frame and chirp, the phase
2 pi (2 / c) (f_c (R + r (t_m + t_n)) + S (R + r t_m) t_n) after M. A. Richards,
*Fundamentals of Radar Signal Processing*. It is bilinear in m and n. Without the
product m n, the migration through range, it is a two-dimensional Fourier sum.
"""

from __future__ import annotations

import itertools
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sd2core.fmcw.kernels import direct_sum
from sd2core.radar_config import SPEED_OF_LIGHT_MPS, RadarConfig

NUFFT_TOLERANCE = 1e-9
"""Relative to the norm of the amplitudes; 1e-6 would save a tenth of the time."""

_MAX_PLANS = 8


class _Plans(threading.local):
    """Prepared finufft plans of this thread: preparing takes a third as long as using."""

    def __init__(self) -> None:
        self.made: dict[tuple[tuple[int, int], int], Any] = {}


_plans = _Plans()

_TERMS_PER_STEP = 3_000_000
"""Some 10 ms, after which a direct sum asks whether it is still wanted."""


@dataclass(frozen=True, eq=False)
class Echoes:
    """Echoes at one receiver."""

    range_m: NDArray[np.float64]  # Half the path at the frame's middle, (n,).
    rate_mps: NDArray[np.float64]  # Rate of growth of the range, (n,).
    # (n,) or (terms, n): constant, or a polynomial in the time from the frame's middle over half
    # the radar's frame: constant, linear, quadratic.
    amplitude: NDArray[np.complex128]

    @property
    def terms(self) -> NDArray[np.complex128]:
        """Amplitudes with their terms, (terms, n)."""
        return np.atleast_2d(self.amplitude)


class Turns(NamedTuple):
    """Phase in turns: start + m chirp + n sample + m n migration, (k,) each."""

    start: NDArray[np.float64]
    chirp: NDArray[np.float64]
    sample: NDArray[np.float64]
    migration: NDArray[np.float64]


def direct(
    echoes: Echoes,
    config: RadarConfig,
    chirps: int | None = None,
    go_on: Callable[[], None] | None = None,
) -> NDArray[np.complex128]:
    """Sum every echo at every sample directly, (chirps, samples); the reference.

    Nothing is left out; rounding adds some 1e-14 times the samples of a chirp.

    Parameters
    ----------
    echoes : Echoes
    config : RadarConfig
    chirps : int, optional
        Number around the frame's middle; by default the radar's own.
    go_on : callable, optional
        Called every few ten milliseconds; may raise to stop.
    """
    turns, amplitude = turns_of(echoes, config), echoes.terms
    shape = (config.samples_per_chirp, chirps or config.chirps_per_frame)
    real, imaginary = np.zeros(shape), np.zeros(shape)
    step = max(1, _TERMS_PER_STEP // real.size)
    for start in range(0, len(echoes.range_m), step):
        if go_on is not None:
            go_on()
        some = slice(start, start + step)
        direct_sum(
            *Turns(*(each[some] for each in turns)),
            np.ascontiguousarray(amplitude[:, some]),
            -0.5 * (shape[1] - 1),
            -0.5 * shape[0],
            0.5 * config.chirps_per_frame,
            real,
            imaginary,
        )
    return (real + 1j * imaginary).T


def nufft(
    echoes: Echoes, config: RadarConfig, blocks: int = 1, chirps: int | None = None
) -> NDArray[np.complex128]:
    """Compute the same sum by type-1 non-uniform FFTs on one thread, (chirps, samples).

    Parameters
    ----------
    echoes : Echoes
    config : RadarConfig
    blocks : int
        Each, no more than there are chirps, has beat frequencies of its own. One block leaves
        2 pi (2 / c) S r t_m t_n out of the phase at its ends.
    chirps : int, optional
        Number around the frame's middle; by default the radar's own.
    """
    turns = turns_of(echoes, config)
    chirps = chirps or config.chirps_per_frame
    samples = config.samples_per_chirp
    total = np.zeros((chirps, samples), np.complex128)
    if not len(echoes.range_m):
        return total
    along_chirps = _angle(turns.chirp)
    terms = echoes.terms
    # Most facets turn too little within a frame to change.
    changing = np.flatnonzero(terms[1:].any(axis=0))
    times = (np.arange(chirps) - 0.5 * (chirps - 1)) / (0.5 * config.chirps_per_frame)
    edges = np.linspace(0, chirps, min(blocks, chirps) + 1).round().astype(int)
    for first, last in itertools.pairwise(edges):
        length = int(last - first)
        middle = 0.5 * (first + last - 1) - 0.5 * (chirps - 1)
        sample = turns.sample + middle * turns.migration
        # Modes count from -(length // 2); chirps from -(length - 1) / 2, samples from
        # -samples / 2.
        start = turns.start + (middle + length // 2 - 0.5 * (length - 1)) * turns.chirp
        start += (samples // 2 - 0.5 * samples) * sample
        along_samples, phasor = _angle(sample), np.exp(1j * _angle(start))
        shape = (length, samples)
        total[first:last] = _transform(along_chirps, along_samples, terms[:1] * phasor, shape)[0]
        if not len(changing):
            continue
        parts = _transform(
            along_chirps[changing],
            along_samples[changing],
            terms[1:, changing] * phasor[changing],
            shape,
        )
        for power, part in enumerate(parts, start=1):
            total[first:last] += times[first:last, None] ** power * part
    return total


def _transform(
    along_chirps: NDArray[np.float64],
    along_samples: NDArray[np.float64],
    strengths: NDArray[np.complex128],
    shape: tuple[int, int],
) -> NDArray[np.complex128]:
    """Type-1 transforms of several strengths at the same points, (terms, chirps, samples)."""
    import finufft

    plans = _plans.made
    key = (shape, len(strengths))
    if key not in plans:
        if len(plans) >= _MAX_PLANS:
            plans.clear()
        plans[key] = finufft.Plan(
            1, shape, n_trans=len(strengths), eps=NUFFT_TOLERANCE, isign=1, nthreads=1
        )
    plan = plans[key]
    plan.setpts(along_chirps, along_samples)
    transforms: NDArray[np.complex128] = plan.execute(np.ascontiguousarray(strengths))
    return transforms.reshape(len(strengths), *shape)


def turns_of(echoes: Echoes, config: RadarConfig) -> Turns:
    """Phases of echoes at every chirp and sample, as four numbers each."""
    per_metre = 2.0 / SPEED_OF_LIGHT_MPS
    carrier = 2.0 / config.wavelength_m
    per_sample_s = 1.0 / config.sample_rate_hz
    slope = per_metre * config.slope_hz_per_s * per_sample_s
    start = carrier * echoes.range_m
    return Turns(
        start - np.floor(start),
        carrier * config.chirp_repetition_s * echoes.rate_mps,
        slope * echoes.range_m + carrier * per_sample_s * echoes.rate_mps,
        slope * config.chirp_repetition_s * echoes.rate_mps,
    )


def _angle(turns: NDArray[np.float64]) -> NDArray[np.float64]:
    """Radians within half a turn of 0."""
    return 2.0 * np.pi * (turns - np.rint(turns))
