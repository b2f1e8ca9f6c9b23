"""Landmarks with their depth: what a lifter makes of a track."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from sd2core.body.camera import PinholeCamera
from sd2core.body.track import LANDMARKS, LandmarkTrack
from sd2core.timebase import Timebase

Floats = NDArray[np.float64]

CENTRE = tuple(LANDMARKS.index(name) for name in ("shoulder.L", "shoulder.R", "hip.L", "hip.R"))
"""The body's centre is the mean of these."""

_TORSO = 0.269
"""Middle of the shoulders to that of the hips, in statures; ± 0.005 over random bodies."""
_WORLD_DEPTH_SD = 0.05
_WORLD_CENTRE_SD = 0.05
_WORLD_VELOCITY_SD = 3.0


@dataclass(frozen=True, eq=False)
class LiftedTrack:
    """Depth and motion along z of every landmark, in statures; NaN in empty frames.

    Parameters
    ----------
    timebase : Timebase
        That of the track, T frames.
    centre_depth : float64 array, shape (T,)
        Z of the body's centre, the mean of shoulders and hips.
    centre_sigma : float64 array, shape (T,)
        Standard deviation of it.
    depth : float64 array, shape (T, 33)
        How far behind the centre every landmark is.
    depth_sigma : float64 array, shape (T, 33)
    velocity : float64 array, shape (T, 33)
        Of the landmark's z, the centre's motion included, per second; positive when
        it moves away from the camera.
    velocity_sigma : float64 array, shape (T, 33)
    """

    timebase: Timebase
    centre_depth: Floats
    centre_sigma: Floats
    depth: Floats
    depth_sigma: Floats
    velocity: Floats
    velocity_sigma: Floats

    def part(self, start: int, stop: int) -> LiftedTrack:
        """Frames ``start`` to ``stop``."""
        frames = slice(start, stop)
        arrays = {name: values[frames] for name, values in vars(self).items() if name != "timebase"}
        return LiftedTrack(Timebase(self.timebase.times_s[frames]), **arrays)


class Lifted(Protocol):
    """A lifted track that need not be in memory as a whole."""

    def part(self, start: int, stop: int) -> LiftedTrack:
        """Frames ``start`` to ``stop``."""
        ...


def lifted_by_world(track: LandmarkTrack, camera: PinholeCamera) -> LiftedTrack:
    """Depths as the landmark model itself gives them in its world coordinates.

    They are weak (5 % of the stature) and say nothing of velocities; they tell which
    of the two ways a limb of known length leans. How far away the person is follows
    from the size of the picture of the world coordinates.
    """
    slopes = camera.slopes(track.image_px.astype(np.float64))
    world = track.world_m.astype(np.float64)
    weight = track.visibility.astype(np.float64)
    torso = world[:, CENTRE[:2]].mean(axis=1) - world[:, CENTRE[2:]].mean(axis=1)
    scale = _TORSO / np.nanmedian(np.linalg.norm(torso, axis=-1))
    spread, size = _spread(world[..., :2], weight), _spread(slopes, weight)
    depth = scale * (world[..., 2] - world[:, CENTRE, 2].mean(axis=1, keepdims=True))
    return LiftedTrack(
        timebase=track.timebase,
        centre_depth=scale * spread / size,
        centre_sigma=np.full(len(track), _WORLD_CENTRE_SD),
        depth=depth,
        depth_sigma=np.full(depth.shape, _WORLD_DEPTH_SD),
        velocity=np.where(np.isnan(depth), np.nan, 0.0),
        velocity_sigma=np.full(depth.shape, _WORLD_VELOCITY_SD),
    )


def _spread(points: Floats, weight: Floats) -> Floats:
    """Root mean square distance (T,) of points (T, n, 2) from their middle."""
    total = weight.sum(axis=1)
    middle = (weight[..., None] * points).sum(axis=1, keepdims=True) / total[:, None, None]
    square = ((points - middle) ** 2).sum(axis=-1)
    return np.asarray(np.sqrt((weight * square).sum(axis=1) / total))
