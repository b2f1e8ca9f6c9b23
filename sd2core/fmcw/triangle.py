"""The phase of a wave averaged over a flat facet, in closed form."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

_SERIES_BELOW_RAD = 1.0
_SERIES_TERMS = 16
"""The first term left out is below 1e-16 at the limit above."""


def mean_phasor(phase_rad: NDArray[np.float64]) -> NDArray[np.complex128]:
    """Mean of exp(j phase) over triangles on which the phase is linear; (n, 3) to (n,).

    The mean is twice the second divided difference of exp at the three corner
    phases (Hermite-Genocchi). Differences of close numbers are avoided on two
    levels: the first differences are written with sinc, and triangles whose
    phases span less than one radian use the Taylor series about the mean phase,
    whose moments are complete symmetric polynomials of the corner phases.

    Exact to about 1e-15, whether or not phases coincide.
    """
    ordered = np.sort(phase_rad, axis=1)
    middle = ordered.mean(axis=1)
    low, mid, high = (ordered - middle[:, None]).T
    close = high - low < _SERIES_BELOW_RAD
    mean = np.empty(len(phase_rad), dtype=np.complex128)
    mean[close] = _series(low[close], mid[close], high[close])
    far = ~close
    low, mid, high = low[far], mid[far], high[far]
    mean[far] = 2j * (_first(low, mid) - _first(mid, high)) / (high - low)
    mean *= np.exp(1j * middle)
    return mean


def _first(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.complex128]:
    """Mean of exp(j x) for x between a and b."""
    divided: NDArray[np.complex128] = np.exp(0.5j * (a + b)) * np.sinc((b - a) / (2.0 * np.pi))
    return divided


def _series(
    a: NDArray[np.float64], b: NDArray[np.float64], c: NDArray[np.float64]
) -> NDArray[np.complex128]:
    """Sum over k of 2 j^k h_k(a, b, c) / (k + 2)! for a + b + c = 0."""
    second = a * b + b * c + c * a
    third = a * b * c
    # h_k = -e2 h_(k-2) + e3 h_(k-3), because e1 = a + b + c = 0.
    before = [np.zeros_like(a), np.zeros_like(a), np.ones_like(a)]
    total = np.ones(len(a), dtype=np.complex128)
    factor = 1.0 + 0.0j
    for order in range(1, _SERIES_TERMS):
        factor *= 1j / (order + 2)
        term = third * before[0] - second * before[1]
        before = [before[1], before[2], term]
        total += factor * term
    return total
