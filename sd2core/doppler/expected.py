"""Expected maps: every vertex is counted as the normal distribution of its velocity.

A mesh that was fitted to a video states how badly the velocity of each limb is known
(:class:`~sd2core.mesh.velocity_uncertainty.VelocityUncertainty`). Of the vertices of a limb, each
is spread over the bins as N(v, (σ/2)²) around its own velocity (docs/decisions/0071). They are
counted on a finer axis first, and each of its parts is spread from the mean velocity of what lies
in it, by their deviation, too; where σ is very small, each vertex is spread by itself. Of a raw map
that is right to 1e-3.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sd2core.doppler.histogram import Counting, Counts, Frames, Scatterers, place_in_bins
from sd2core.doppler.kernels import CLIP, WRAP
from sd2core.doppler.limb_histograms import FineAxis
from sd2core.doppler.limb_kernels import REACH, fine_kernel
from sd2core.mesh.velocity_uncertainty import VelocityUncertainty
from sd2core.sensor import VelocityAxis

SIGMA_FACTOR = 0.5
"""Factor on the deviations that a mesh states: with it maps of calibrating clips came nearest to
the true ones (docs/decisions/0071). What covers two errors of three spreads most too far."""


def sigma_bins(
    known: VelocityUncertainty,
    ends_m: NDArray[np.float64],
    limbs_m: NDArray[np.float64],
    start: int,
    axis: VelocityAxis,
) -> NDArray[np.float64]:
    """Deviation of each limb's velocity towards a sensor in bins, (n, limbs).

    A velocity that may be anywhere on the axis is as good as one that may be even farther.

    Parameters
    ----------
    known : VelocityUncertainty
        As the mesh states it.
    ends_m : float64 ndarray, (1 or 2, 3)
        Of the path, in the camera frame.
    limbs_m : float64 ndarray, (n, limbs, 3)
        Places of the limbs in the camera frame.
    start : int
        First of these frames in the clip.
    axis : VelocityAxis
        Of the map.
    """
    sigma_mps = known.towards(ends_m, limbs_m, start)
    return np.minimum(sigma_mps / axis.bin_width_mps, axis.bins)


def count_expected(
    frames: Frames,
    ends: NDArray[np.float64],
    counting: Counting,
    scatterers: Scatterers,
    sigma_bins: NDArray[np.float64],
    vertex_limb: NDArray[np.uint8],
    into: Counts,
) -> None:
    """Count some frames as :func:`sd2core.doppler.histogram.count` does, each vertex spread.

    Parameters
    ----------
    frames : Frames
        The n frames with all vertices.
    ends : float64 ndarray, (1 or 2, 3)
        Of the path, in the frame of the positions.
    counting : Counting
        Velocity axis and range law.
    scatterers : Scatterers
        Of these frames.
    sigma_bins : float64 ndarray, (n, limbs)
        Deviations of the limbs in bins; of 0 a vertex counts in one bin.
    vertex_limb : uint8 ndarray, (V,)
        Limb of every vertex.
    into : Counts
        Written; zero at first.
    """
    parts = scatterers.parts
    number = vertex_limb.astype(np.intp)
    if parts is not None:
        number = number + sigma_bins.shape[1] * parts.astype(np.intp)
    # Of the pairs of a limb and a part of the body those that there are.
    pairs = np.flatnonzero(np.bincount(number))
    group = np.searchsorted(pairs, number)
    limb, part = pairs % sigma_bins.shape[1], pairs // sigma_bins.shape[1]
    place, axis = ends.astype(frames.positions.dtype), counting.arguments()
    sigma = sigma_bins.take(limb, axis=1)  # rows on end, of one type for the compiler
    room = 0 if counting.beyond == WRAP else math.ceil(REACH * sigma.max()) + 1
    fine_kernel(
        tuple(frames.paths()), counting.scale(frames.duration_s, place.dtype),
        scatterers.arguments(), place, axis, group, room, sigma, part,
        np.empty((0, len(pairs), FineAxis(counting, room).parts)), into.histogram, into.visible,
        into.beyond,
    )  # fmt: skip


def spread_over_bins(
    place: NDArray[np.float64],
    weight: NDArray[np.float64],
    sigma: NDArray[np.float64],
    counting: Counting,
) -> NDArray[np.float64]:
    """Shares (bins,) of what lies at some places of the axis and is spread.

    Parameters
    ----------
    place : float64 ndarray, (N,)
        Places in bins; the axis runs from 0 to ``bins``.
    weight : float64 ndarray, (N,)
        What lies there.
    sigma : float64 ndarray, (N,)
        Standard deviations in bins; what has 0 counts in one bin.
    counting : Counting
        Axis, and what happens beyond it.
    """
    from scipy.special import ndtr

    known, bins = sigma == 0, counting.bins
    number, _ = place_in_bins(place[known], counting)
    shares = np.bincount(number, weight[known], bins + 1)[:bins].astype(np.float64)
    reach = np.ceil(2 * REACH * sigma).astype(np.intp)  # bins to each side; beyond it is 1e-15
    for away in np.unique(reach[~known]).tolist():
        rows = reach == away
        first = np.floor(place[rows]) - away
        edges = first[:, None] + np.arange(2 * away + 2)
        below = ndtr((edges - place[rows, None]) / sigma[rows, None])
        number, share = edges[:, :-1].astype(np.intp), weight[rows, None] * np.diff(below)
        if counting.beyond == WRAP:
            number %= bins
        elif counting.beyond == CLIP:
            number = np.clip(number, 0, bins - 1)
        inside = (number >= 0) & (number < bins)
        shares += np.bincount(number[inside], share[inside], bins)
    return shares
