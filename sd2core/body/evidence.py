"""Measurements that a body is fitted to: landmarks in the picture and their lifted depth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.body.camera import PinholeCamera
from sd2core.body.lifter import FEET, LiftedTrack
from sd2core.body.rotations import Floats
from sd2core.body.track import TORSO_CORNERS, LandmarkTrack

_ACROSS_SHARE = 0.5
"""Standard deviation of a landmark across the view over the lifter's: errors there are those of
single frames, which smoothness sees through."""
_MIN_TRUST = 0.05
_OUTSIDE = 0.05
"""Share of the picture's height beyond whose edges a landmark is surely a guess."""
_DRAWN_IN = 0.4
"""How far inside the edges a limb that has left may be put, as a share of the picture's height,
if it is not visible at all."""
_STANDING_MPS = 0.05
_STEPPING_MPS = 1.0
"""Standard deviations of a foot's velocity, on the ground and in a step."""
_SIZE_SD = 0.05
"""Who stoops looks smaller, and who stretches larger."""


@dataclass(frozen=True, eq=False)
class Evidence:
    """Measurements of a stretch of frames, in the camera frame, with standard deviations."""

    times_s: Floats  # (T,)
    slopes: Floats  # (T, 33, 2) x / z and y / z of each landmark
    slopes_sd: Floats  # (T, 33)
    size_sd: float
    """Standard deviation of the person's size in the picture, as a share: an error of all
    landmarks together, beside their own."""
    trunk: tuple[int, ...]  # landmarks whose mean is the middle of the trunk
    depth_m: Floats  # (T, 33) behind the middle of the trunk
    depth_sd_m: Floats  # (T, 33)
    trunk_m: Floats  # (T,) depth of the middle of the trunk
    trunk_sd_m: Floats  # (T,)
    velocity_mps: Floats  # (T, 33) along the optical axis, positive away
    velocity_sd_mps: Floats  # (T, 33)
    standing_sd_mps: Floats  # (T, 4) velocity of each of lifter.FEET, about none

    @property
    def points_m(self) -> Floats:
        """Places of the landmarks by slopes and depths, (T, 33, 3)."""
        depth = (self.trunk_m[:, None] + self.depth_m)[..., None]
        return np.concatenate([self.slopes * depth, depth], axis=-1)

    def __getitem__(self, frames: slice | NDArray[np.intp]) -> Evidence:
        """Evidence of some frames."""
        return replace(self, **{name: getattr(self, name)[frames] for name in _per_frame()})


def _per_frame() -> list[str]:
    return [field.name for field in fields(Evidence) if field.name not in ("size_sd", "trunk")]


def evidence_of(
    track: LandmarkTrack, lifted: LiftedTrack, camera: PinholeCamera, stature_m: float
) -> Evidence:
    """Landmarks and depths of the same frames in metres and seconds, scaled by the stature.

    Parameters
    ----------
    track : LandmarkTrack
        Landmarks in the picture, T frames.
    lifted : LiftedTrack
        The same frames in statures, from the lifter (docs/decisions/0018).
    camera : PinholeCamera
        That of the track's picture.
    stature_m : float
        Stature of the person.
    """
    moving_mps = _STEPPING_MPS * np.sqrt(1.0 - lifted.standing)
    return Evidence(
        times_s=np.array(track.timebase.times_s),
        slopes=camera.slopes(track.image_px.astype(np.float64)) + lifted.across,
        slopes_sd=_ACROSS_SHARE * lifted.across_sigma,
        size_sd=_SIZE_SD,
        trunk=TORSO_CORNERS,
        depth_m=stature_m * lifted.depth,
        depth_sd_m=stature_m * lifted.depth_sigma,
        trunk_m=stature_m * lifted.centre_depth,
        trunk_sd_m=stature_m * lifted.centre_sigma,
        velocity_mps=stature_m * lifted.velocity,
        velocity_sd_mps=stature_m * lifted.velocity_sigma,
        standing_sd_mps=np.hypot(_STANDING_MPS, moving_mps) / trust_of(track)[:, FEET],
    )


def trust_of(track: LandmarkTrack) -> Floats:
    """Trust in each landmark (T, 33), from 0.05 to 1: visibility, and least outside the picture.

    What is outside the picture or hidden was never seen; the model guesses it.
    """
    return _trust(track, 0.0)


def sight_of(track: LandmarkTrack) -> Floats:
    """Whether each landmark was seen (T, 33), from 0.05 to 1.

    A limb that leaves the picture is often put just inside its edges, less visible. Its place
    still says more than nothing, and so it is trusted for a fit; nobody saw it all the same.
    """
    return _trust(track, _DRAWN_IN)


def _trust(track: LandmarkTrack, drawn_in: float) -> Floats:
    size = np.array([track.width, track.height])
    beyond = np.maximum(-track.image_px, track.image_px - size).max(axis=2) / track.height
    beyond += drawn_in * (1.0 - track.visibility)
    inside = 1.0 - np.clip(beyond / _OUTSIDE, 0.0, 1.0)
    return np.asarray(np.clip(track.visibility * inside, _MIN_TRUST, 1.0), np.float64)


def joined(pieces: Sequence[Evidence]) -> Evidence:
    """Evidence of the frames of all pieces."""
    arrays: dict[str, Any] = {
        name: np.concatenate([getattr(piece, name) for piece in pieces]) for name in _per_frame()
    }
    return replace(pieces[0], **arrays)
