"""Fine histograms of velocity, limb by limb, to shift the velocities of a limb."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.doppler.histogram import Counting, Frames, relative_range
from sd2core.doppler.kernels import CLIP, WRAP
from sd2core.numerics.compiled import compiled, kernels_ready

PARTS = 8
"""Number of parts per bin."""


@dataclass(frozen=True)
class FineAxis:
    """Finely divided velocity axis, with room for velocities from beyond the axis.

    Parameters
    ----------
    room_bins : int
        Bins added at each end; zero where velocities fold back.
    """

    counting: Counting
    room_bins: int

    @property
    def periodic(self) -> bool:
        """True if velocities beyond one end fold back to the other."""
        return self.counting.beyond == WRAP

    @property
    def parts(self) -> int:
        """Number of parts."""
        return PARTS * (self.counting.bins + 2 * self.room_bins)

    def shifted(
        self, fine: NDArray[np.float64], shift_bins: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Coarse histograms after a change of all velocities.

        Within a part the velocities are taken as evenly distributed.

        Parameters
        ----------
        fine : float64 array, shape (n, parts)
        shift_bins : float64 array, shape (k, n)
            In bins, up to ``room_bins`` either way.

        Returns
        -------
        float64 array, shape (k, n, bins)
        """
        bins, (frames, parts) = self.counting.bins, fine.shape
        running = np.zeros((frames, parts + 1))
        np.cumsum(fine, axis=1, out=running[:, 1:])
        total = running[:, -1:]
        edges = PARTS * (np.arange(bins + 1) + self.room_bins)
        place = edges - PARTS * shift_bins[:, :, None]  # (k, n, bins + 1)
        turns = np.floor(place / parts) if self.periodic else np.zeros(1)
        place = np.clip(place - parts * turns, 0, parts)
        whole = np.minimum(place.astype(np.intp), parts - 1)
        rows = np.arange(frames)[:, None]
        low = running[rows, whole]
        below = low + (place - whole) * (running[rows, whole + 1] - low)
        below += turns * total
        if self.counting.beyond == CLIP:
            below[..., 0], below[..., -1] = 0.0, total[:, 0]
        coarse: NDArray[np.float64] = np.diff(below, axis=2)
        return coarse


def fine_histograms(
    frames: Frames,
    sensor: NDArray[np.float64],
    axis: FineAxis,
    weights: NDArray[np.float32],
    vertex_limb: NDArray[np.uint8],
    limbs: int,
) -> NDArray[np.float64]:
    """Count every limb in every part of a fine axis; the mean over a frame's samples.

    Parameters
    ----------
    sensor : float64 array, shape (3,)
        In the frame of the positions.
    weights : float32 array, shape (n, V)
        Weight of each vertex; 0 if it is hidden.
    vertex_limb : uint8 array, shape (V,)

    Returns
    -------
    float64 array, shape (limbs, n, parts)
    """
    fine = np.zeros((limbs, len(frames), axis.parts))
    precision = frames.positions.dtype
    offset = 0.5 * axis.counting.bins + axis.room_bins
    scale = axis.counting.scale(frames.duration_s, precision)
    if kernels_ready():
        fine_kernel(
            frames.positions, frames.before, frames.after, scale, sensor.astype(precision),
            weights, vertex_limb, offset, PARTS, axis.periodic, fine,
        )  # fmt: skip
        return fine
    for t in range(len(frames)):
        samples = np.flatnonzero(frames.duration_s[t] > 0).tolist()
        for sample in samples:
            closer = relative_range(
                frames.positions[frames.before[t, sample]], sensor
            ) - relative_range(frames.positions[frames.after[t, sample]], sensor)
            place = (offset + closer * scale[t, sample]) * PARTS
            _add(fine[:, t], place, weights[t] / len(samples), vertex_limb, axis.periodic)
    return fine


def fine_histograms_of(
    velocity_mps: NDArray[np.float64],
    measured: NDArray[np.bool_],
    axis: FineAxis,
    weights: NDArray[np.float32],
    vertex_limb: NDArray[np.uint8],
    limbs: int,
) -> NDArray[np.float64]:
    """Count given velocities (n, V), in the frames that are ``measured`` (n,)."""
    fine = np.zeros((limbs, len(velocity_mps), axis.parts))
    per_bin = 0.5 * axis.counting.bins / axis.counting.v_max_mps
    offset = 0.5 * axis.counting.bins + axis.room_bins
    for t in np.flatnonzero(measured):
        place = (offset + velocity_mps[t] * per_bin) * PARTS
        _add(fine[:, t], place, weights[t], vertex_limb, axis.periodic)
    return fine


def _add(
    into: NDArray[np.float64],  # (limbs, parts)
    place: NDArray[Any],
    weight: NDArray[Any],
    vertex_limb: NDArray[np.uint8],
    periodic: bool,
) -> None:
    limbs, parts = into.shape
    number = np.floor(place)
    number = number % parts if periodic else np.clip(number, 0, parts - 1)
    slot = vertex_limb * np.intp(parts) + number.astype(np.intp)
    into += np.bincount(slot, weight, limbs * parts).reshape(limbs, parts)


@compiled
def fine_kernel(  # type: ignore[no-untyped-def]
    positions, before, after, scale, sensor, weights, vertex_limb, offset, per_bin, periodic, fine
) -> None:
    """Compiled form of :func:`fine_histograms`; ``fine`` starts as zeros."""
    parts = fine.shape[2]
    sx, sy, sz = np.float64(sensor[0]), np.float64(sensor[1]), np.float64(sensor[2])
    distance = np.sqrt(sx * sx + sy * sy + sz * sz)
    for t in range(fine.shape[1]):
        measured = 0
        for sample in range(before.shape[1]):
            measured += scale[t, sample] > 0
        for sample in range(before.shape[1]):
            if scale[t, sample] <= 0:
                continue
            a, b = positions[before[t, sample]], positions[after[t, sample]]
            for v in range(vertex_limb.shape[0]):
                weight = weights[t, v]
                if weight == 0:
                    continue
                closer = _relative(a, v, sx, sy, sz, distance) - _relative(
                    b, v, sx, sy, sz, distance
                )
                number = int(np.floor((offset + closer * scale[t, sample]) * per_bin))
                if periodic:
                    number %= parts
                number = min(max(number, 0), parts - 1)
                fine[vertex_limb[v], t, number] += weight / measured


@compiled
def _relative(points, v, sx, sy, sz, distance):  # type: ignore[no-untyped-def]
    x, y, z = np.float64(points[0, v]), np.float64(points[1, v]), np.float64(points[2, v])
    qx, qy, qz = x - sx, y - sy, z - sz
    away = np.sqrt(qx * qx + qy * qy + qz * qz)
    difference = x * (x - 2.0 * sx) + y * (y - 2.0 * sy) + z * (z - 2.0 * sz)
    return difference / max(away + distance, 1e-30)


def compile_kernels() -> None:
    """Call every kernel of this module once in single and once in double precision."""
    knots, limbs = np.zeros((1, 1), np.int64), np.zeros(4, np.uint8)
    for precision in (np.float32, np.float64):
        fine_kernel(
            np.ones((1, 3, 4), precision), knots, knots, np.ones((1, 1), precision),
            np.zeros(3, precision), np.ones((1, 4), np.float32), limbs, 16.0, PARTS, False,
            np.zeros((1, 1, 256)),
        )  # fmt: skip
