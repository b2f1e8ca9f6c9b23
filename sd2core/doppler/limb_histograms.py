"""Fine histograms of velocity, limb by limb, to shift the velocities of a limb."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sd2core.doppler.histogram import Counting, Frames, Scatterers
from sd2core.doppler.kernels import CLIP, WRAP
from sd2core.doppler.limb_kernels import PARTS, fine_kernel


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
        return np.diff(below, axis=2)


def fine_histograms(
    frames: Frames,
    ends: NDArray[np.float64],
    axis: FineAxis,
    scatterers: Scatterers,
    limbs: int,
    velocity_mps: NDArray[np.float64] | None = None,
) -> NDArray[np.float64]:
    """Count every limb in every part of a fine axis; the mean over a frame's samples.

    Parameters
    ----------
    ends : float64 array, shape (1 or 2, 3)
        Of the path, in the frame of the positions.
    scatterers : Scatterers
        Their ``parts`` are the limbs.
    limbs : int
    velocity_mps : float64 array, shape (n, V), optional
        Velocities of another rule, for the frames with something to measure.

    Returns
    -------
    float64 array, shape (n, limbs, parts)
    """
    limb, counting = scatterers.parts, axis.counting
    assert limb is not None
    fine = np.zeros((len(frames), limbs, axis.parts))
    if velocity_mps is None:
        place = ends.astype(frames.positions.dtype)
        fine_kernel(
            tuple(frames.paths()), counting.scale(frames.duration_s, place.dtype),
            scatterers.arguments(), place, counting.arguments(), limb.astype(np.intp),
            axis.room_bins, np.zeros((len(frames), limbs)), np.zeros(limbs, np.intp), fine,
            np.empty((0, 1, 0)), np.zeros(len(frames)), np.zeros(len(frames)),
        )  # fmt: skip
        return fine
    last = axis.parts - 1
    for t in np.flatnonzero((frames.duration_s > 0).any(axis=1)).tolist():
        points = frames.positions[frames.centre[t]]
        seen = scatterers.seen(t, points, ends)
        weight = seen * scatterers.weights(t, points, ends, counting)
        place = counting.bins * (0.5 + 0.5 / counting.v_max_mps * velocity_mps[t])
        number = np.floor((place + axis.room_bins) * PARTS)
        number = number % axis.parts if axis.periodic else np.clip(number, 0, last)
        slot = limb * np.intp(axis.parts) + number.astype(np.intp)
        fine[t] = np.bincount(slot, weight, fine[t].size).reshape(fine[t].shape)
    return fine
