"""Counting of vertices in NumPy, as :mod:`sd2core.doppler.histogram` does it by kernels."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.doppler import limb_histograms
from sd2core.doppler.histogram import Counting, Counts, Frames, Scatterers, place_in_bins
from sd2core.doppler.limb_histograms import FineAxis
from sd2core.doppler.limb_kernels import PARTS


def relative_range(positions: NDArray[Any], sensor: NDArray[np.float64]) -> NDArray[Any]:
    """Range (V,) of each vertex less the sensor's distance from the clip's origin.

    |p − s| − |s| = p·(p − 2s) / (|p − s| + |s|). The differences between vertices and knots
    stay at the body's own scale, so the difference of two is the exact change of range of
    :func:`radial_velocity` however far the sensor is, with one range per vertex and knot.
    Its rounding error is a few roundings of the largest coordinate
    (:func:`sd2core.numerics.precision.velocity_error_mps`). Positions (3, V) are relative
    to the clip's origin; the result has their precision.
    """
    x, y, z = positions
    sx, sy, sz = place = sensor.astype(positions.dtype)
    two = np.float32(2)
    distance = np.linalg.norm(place.astype(np.float64)).astype(positions.dtype)
    away = np.sqrt((x - sx) ** 2 + (y - sy) ** 2 + (z - sz) ** 2)
    difference = x * (x - two * sx) + y * (y - two * sy) + z * (z - two * sz)
    return difference / np.maximum(away + distance, np.float32(1e-30))


def places(
    frames: Frames, t: int, sample: int, ends: NDArray[np.float64], counting: Counting
) -> NDArray[Any]:
    """Position of every vertex (V,) on the velocity axis, in the precision of the frames.

    Parameters
    ----------
    frames : Frames
        With all vertices.
    t, sample : int
        Frame and velocity sample, which has something to measure.
    ends : float64 ndarray, (1 or 2, 3)
        Of the path, in the frame of the positions.
    counting : Counting
        Its axis runs from 0 to ``bins``.
    """

    def range_at(knot: int) -> NDArray[Any]:
        each = [relative_range(frames.positions[knot], end) for end in ends]
        return each[0] if len(each) == 1 else np.float32(0.5) * (each[0] + each[1])

    closer = range_at(frames.before[t, sample]) - range_at(frames.after[t, sample])
    precision = frames.positions.dtype
    per_bin = closer * counting.scale(frames.duration_s[t, sample : sample + 1], precision)
    return per_bin + np.float32(0.5 * counting.bins)


def count(
    frames: Frames,
    ends: NDArray[np.float64],
    counting: Counting,
    scatterers: Scatterers,
    into: Counts,
) -> None:
    """Count some frames as :func:`sd2core.doppler.histogram.count` does.

    Parameters
    ----------
    frames : Frames
        The n frames with all vertices.
    ends, counting, scatterers, into
        As for the kernel.
    """
    _, parts, bins = into.histogram.shape
    multiplicity = scatterers.multiplicity(frames.positions.shape[2])
    # Bins of a part, and one for what is dropped.
    base = 0 if scatterers.parts is None else (bins + 1) * scatterers.parts.astype(np.intp)
    for t, knot in enumerate(frames.centre):
        points = frames.positions[knot]
        seen = scatterers.seen(t, points, ends)
        weight = scatterers.weights(t, points, ends, counting)
        into.visible[t] = multiplicity[seen].sum()
        measured = max(1, int((frames.duration_s[t] > 0).sum()))
        for sample in np.flatnonzero(frames.duration_s[t] > 0).tolist():
            number, beyond = place_in_bins(places(frames, t, sample, ends, counting), counting)
            total = np.bincount((number + base)[seen], weight[seen], parts * (bins + 1))
            into.histogram[t] += total.reshape(parts, bins + 1)[:, :bins] / measured
            into.beyond[t] += multiplicity[beyond & seen].sum() / measured


def mark_needed(
    frames: Frames, ends: NDArray[np.float64], counting: Counting, live: NDArray[np.uint8]
) -> NDArray[np.uint8]:
    """Mark vertices of all frames as :func:`sd2core.doppler.histogram.mark_needed` does.

    Parameters
    ----------
    frames : Frames
        The n frames with all vertices.
    ends, counting, live
        As for the kernel.
    """
    needed = np.zeros((len(frames.centre), frames.positions.shape[2]), np.uint8)
    for t in range(len(frames.centre)):
        for sample in range(frames.before.shape[1]):
            if frames.duration_s[t, sample] > 0:
                at = places(frames, t, sample, ends, counting)
                needed[t] |= live[place_in_bins(at, counting)[0]]
    return needed


def fine_histograms(
    frames: Frames,
    ends: NDArray[np.float64],
    axis: FineAxis,
    scatterers: Scatterers,
    limbs: int,
    velocity_mps: NDArray[np.float64] | None = None,
) -> NDArray[np.float64]:
    """Count as :func:`sd2core.doppler.limb_histograms.fine_histograms` does by its kernel."""
    if velocity_mps is not None:
        return limb_histograms.fine_histograms(frames, ends, axis, scatterers, limbs, velocity_mps)
    limb, last = scatterers.parts, axis.parts - 1
    assert limb is not None
    fine = np.zeros((len(frames), limbs, axis.parts))
    for t, knot in enumerate(frames.centre):
        points = frames.positions[knot]
        seen = scatterers.seen(t, points, ends)
        weight = seen * scatterers.weights(t, points, ends, axis.counting)
        samples = np.flatnonzero(frames.duration_s[t] > 0).tolist()
        for sample in samples:
            at = places(frames, t, sample, ends, axis.counting)
            number = np.floor((at + axis.room_bins) * PARTS)
            number = number % axis.parts if axis.periodic else np.clip(number, 0, last)
            slot = limb * np.intp(axis.parts) + number.astype(np.intp)
            counted = np.bincount(slot, weight / len(samples), fine[t].size)
            fine[t] += counted.reshape(fine[t].shape)
    return fine
