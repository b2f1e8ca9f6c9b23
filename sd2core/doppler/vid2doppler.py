"""Vid2Doppler's arithmetic, for comparison with that tool.

After Ahuja et al., "Vid2Doppler: Synthesizing Doppler radar data from videos for
training privacy-preserving activity recognition" (CHI 2021) and its published
code, with its properties: the backward difference lags half a frame, the first
and last two frames are attenuated, and the typical frame rate stands for all.
Bin edges decide here, so everything is double precision.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.doppler.histogram import Counting, Counts, Frames, Scatterers
from sd2core.doppler.kernels import CLIP, DROP, WRAP
from sd2core.mesh.presence import Presence

TAPS = 5
"""Frames in its mean over time."""

REACH_BEFORE, REACH_AFTER = TAPS // 2 + 1, TAPS // 2
"""Number of frames before and after a frame that its velocity depends on."""


def velocities(
    positions: NDArray[Any],
    first: int,
    start: int,
    stop: int,
    frame_count: int,
    sensor: NDArray[np.float64],
    frames_per_s: float,
    presence: Presence | None = None,
) -> NDArray[np.float64]:
    """Velocity −(Δp·p)/|p|·fps of each vertex, then its zero-padded mean over five frames.

    Parameters
    ----------
    positions : ndarray, (n, 3, V)
        Vertices from frame ``first`` on: at least from ``start - 3`` to ``stop + 2``, as far as
        the recording goes.
    first : int
        First frame of ``positions``.
    start, stop : int
        Half-open range of frames whose velocities are wanted.
    frame_count : int
        Frames of the recording, beyond which the zero padding begins.
    sensor : float64 ndarray, (3,)
        In the frame of the positions.
    frames_per_s : float
        Typical rate, which stands for all frames.
    presence : Presence, optional
        Of all frames of the recording: those without a person cut it into recordings of their own.

    Returns
    -------
    float64 ndarray, (stop - start, V)
        In m/s, positive when approaching.
    """
    low, high = max(start - TAPS // 2, 0), min(stop + TAPS // 2, frame_count)
    instant = np.zeros((stop - start + TAPS - 1, positions.shape[2]))
    place = sensor[:, None]
    first_of = None if presence is None or presence.whole else presence.first
    for frame in range(max(low, 1), high):
        if first_of is not None and first_of[frame] == frame:
            continue
        now = positions[frame - first].astype(np.float64)
        step = now - positions[frame - first - 1]
        ray = now - place
        distance = np.sqrt((ray * ray).sum(axis=0))
        approach = -(step * ray).sum(axis=0) * frames_per_s
        np.divide(approach, distance, out=instant[frame - start + TAPS // 2], where=distance > 0)
    mean = np.zeros((stop - start, positions.shape[2]))
    frames = np.arange(start, stop)
    for tap in range(TAPS):
        add = instant[tap : tap + stop - start]
        if first_of is not None:
            near = np.clip(frames + tap - TAPS // 2, 0, frame_count - 1)
            add = add * (first_of[near] == first_of[frames])[:, None]
        mean += add
    mean /= TAPS
    return mean


def place_in_bins(
    velocity_mps: NDArray[np.float64], edges_mps: NDArray[np.float64], counting: Counting
) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
    """Bin numbers as in ``np.histogram`` (``bins`` where dropped), and a mask of those beyond."""
    beyond = (velocity_mps < edges_mps[0]) | (velocity_mps > edges_mps[-1])
    if counting.beyond == WRAP:
        span = edges_mps[-1] - edges_mps[0]
        wrapped = edges_mps[0] + np.mod(velocity_mps - edges_mps[0], span)
        velocity_mps = np.where(beyond, wrapped, velocity_mps)
    elif counting.beyond == CLIP:
        velocity_mps = np.clip(velocity_mps, edges_mps[0], edges_mps[-1])
    number = np.searchsorted(edges_mps[1:-1], velocity_mps, side="right")
    if counting.beyond == DROP:
        number[beyond] = counting.bins
    return number, beyond


def count(
    frames: Frames,
    velocity_mps: NDArray[np.float64],
    edges_mps: NDArray[np.float64],
    ends: NDArray[np.float64],
    counting: Counting,
    scatterers: Scatterers,
    into: Counts,
) -> None:
    """Count some frames by given velocities, as :func:`histogram.count` does.

    Parameters
    ----------
    frames : Frames
        The n frames with all vertices.
    velocity_mps : float64 ndarray, (n, V)
        From :func:`velocities`.
    edges_mps : float64 ndarray, (bins + 1,)
        Edges of the bins.
    ends : float64 ndarray, (1 or 2, 3)
        Of the path, in the frame of the positions.
    counting : Counting
        Range law, and what happens beyond the axis.
    scatterers : Scatterers
        Of these frames.
    into : Counts
        Written; zero at first.
    """
    _, parts, bins = into.histogram.shape
    multiplicity = scatterers.multiplicity(frames.positions.shape[2])
    number, beyond = place_in_bins(velocity_mps, edges_mps, counting)
    if scatterers.parts is not None:  # bins of a part, and one for what is dropped
        number = number + (bins + 1) * scatterers.parts.astype(np.intp)
    for t, knot in enumerate(frames.centre):
        points = frames.positions[knot]
        seen = scatterers.seen(t, points, ends)
        into.visible[t] = multiplicity[seen].sum()
        if (frames.duration_s[t] > 0).any():
            weight = scatterers.weights(t, points, ends, counting)
            total = np.bincount(number[t][seen], weight[seen], parts * (bins + 1))
            into.histogram[t] += total.reshape(parts, bins + 1)[:, :bins]
            into.beyond[t] += multiplicity[beyond[t] & seen].sum()
