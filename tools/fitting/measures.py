"""Measures of fits beside those of :mod:`sd2core.compare.measures`."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from sd2core.body.model import Body
from sd2core.scattering.velocity import moments

Floats = NDArray[np.float64]

EDGE_FRAMES = 5
"""Frames at each end of a clip that count as its edge."""


def peak_kept(values: NDArray[Any], truth: NDArray[Any]) -> float:
    """Largest magnitude of one over that of the other; NaN when the truth has none."""
    peak = float(np.abs(truth).max(initial=0.0))
    return float(np.abs(values).max(initial=0.0)) / peak if peak > 0 else float("nan")


def speed_mps(positions_m: NDArray[Any], times_s: Floats) -> Floats:
    """Magnitude of the velocity, (T, N) for positions (T, N, 3)."""
    stencil = moments(times_s, np.arange(len(times_s)), 1)
    step = positions_m[stencil.after[:, 0]] - positions_m[stencil.before[:, 0]]
    return np.asarray(np.linalg.norm(step, axis=-1) / stencil.duration_s)


def coverage(errors: NDArray[Any], sigma: NDArray[Any]) -> float:
    """Share of errors no larger than their standard deviation (0.683 when it is right)."""
    known = np.isfinite(errors) & np.isfinite(sigma)
    if not known.any():
        return float("nan")
    return float((np.abs(errors[known]) <= sigma[known]).mean())


@lru_cache(maxsize=1)
def medium_in_high() -> NDArray[np.intp]:
    """Vertices of the finest surface that are those of the medium one, (5000,)."""
    _, rows = cKDTree(Body.load("high").vertices_m).query(Body.load("medium").vertices_m)
    return np.asarray(rows, np.intp)
