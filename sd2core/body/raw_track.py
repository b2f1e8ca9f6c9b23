"""Landmarks as the landmark model gives them, not yet repaired."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]

SCALE_S = 0.5
"""Time over which the person's size in the picture hardly changes."""


@dataclass(frozen=True, eq=False)
class RawTrack:
    """Landmarks as detected in each of T frames; NaN, or visibility 0, where nothing was found."""

    times_s: Floats  # (T,)
    present: NDArray[np.bool_]  # (T,)
    bridged: NDArray[np.bool_]  # (T,)
    image_px: Singles  # (T, 33, 2)
    depth_px: Singles  # (T, 33)
    world_m: Singles  # (T, 33, 3)
    visibility: Singles  # (T, 33)

    def picked(self, order: NDArray[np.intp], frames: NDArray[np.bool_]) -> RawTrack:
        """Landmarks of some frames in another order (33,)."""
        changed = {}
        for name in ("image_px", "depth_px", "world_m", "visibility"):
            values = getattr(self, name).copy()
            values[frames] = values[frames][:, order]
            changed[name] = values
        return replace(self, **changed)

    def part(self, start: int, stop: int) -> RawTrack:
        """Frames ``start`` to ``stop``."""
        return RawTrack(**{name: values[start:stop] for name, values in vars(self).items()})


def pixels_per_metre(track: RawTrack) -> Floats:
    """Scale of the person in the picture, (T,), in pixels per metre: median over 0.5 s."""
    from scipy.ndimage import median_filter

    image, world = (
        np.sqrt(places.var(axis=1, dtype=np.float64).sum(axis=1))
        for places in (track.image_px, track.world_m[..., :2])
    )
    with np.errstate(invalid="ignore", divide="ignore"):
        scale = image / world
    good = np.isfinite(scale) & (scale > 0)
    middle = float(np.median(scale[good])) if good.any() else 1.0
    scale[~good] = middle
    step_s = float(np.median(np.diff(track.times_s))) if len(scale) > 1 else SCALE_S
    # One landmark that jumps away makes that frame's picture look larger.
    window = max(round(SCALE_S / step_s), 5)
    return np.asarray(median_filter(scale, size=window, mode="nearest"))


def place_m(track: RawTrack, rows: NDArray[np.intp], scale: Floats, landmark: int) -> Floats:
    """One landmark in the picture and in the model's own coordinates, in metres, (N, 5).

    Parameters
    ----------
    track : RawTrack
        Landmarks, not repaired.
    rows : int ndarray, (N,)
        Frames of it.
    scale : float64 ndarray, (N, 1)
        Pixels per metre in these frames, see :func:`pixels_per_metre`.
    landmark : int
        Number of the landmark, 0 to 32.
    """
    picture = track.image_px[rows, landmark] / scale
    return np.concatenate([picture, track.world_m[rows, landmark]], axis=1, dtype=np.float64)
