"""Measurements that a body is fitted to: landmarks in the picture and their lifted depth."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from sd2core.body.camera import PinholeCamera
from sd2core.body.lifter import Lifted, LiftedTrack
from sd2core.body.rotations import Floats
from sd2core.body.track import TORSO_CORNERS, Landmarks, LandmarkTrack, parts

_PICTURE_SD = 0.006
"""Standard deviation of a well visible landmark, in apparent statures: 3 pixels of 480."""
_LEAST_VISIBILITY = 0.05
DEPTH_CAUTION = 2.0
VELOCITY_CAUTION = 4.0
"""Neighbouring frames err alike, so each tells less than it seems to."""


@dataclass(frozen=True, eq=False)
class Evidence:
    """Measurements of a stretch of frames, in the camera frame, with standard deviations."""

    times_s: Floats  # (T,)
    slopes: Floats  # (T, 33, 2) x / z and y / z of each landmark
    slopes_sd: Floats  # (T, 33)
    trunk: tuple[int, ...]  # landmarks whose mean is the middle of the trunk
    depth_m: Floats  # (T, 33) behind the middle of the trunk
    depth_sd_m: Floats  # (T, 33)
    trunk_m: Floats  # (T,) depth of the middle of the trunk
    trunk_sd_m: Floats  # (T,)
    velocity_mps: Floats  # (T, 33) change of depth_m, positive away
    velocity_sd_mps: Floats  # (T, 33)

    @property
    def points_m(self) -> Floats:
        """Places of the landmarks by slopes and depths, (T, 33, 3)."""
        depth = (self.trunk_m[:, None] + self.depth_m)[..., None]
        return np.concatenate([self.slopes * depth, depth], axis=-1)

    def __getitem__(self, frames: slice | NDArray[np.intp]) -> Evidence:
        """Evidence of some frames."""
        parts = {
            field.name: getattr(self, field.name)[frames]
            for field in fields(self)
            if field.name != "trunk"
        }
        return Evidence(trunk=self.trunk, **parts)


def evidence_of(
    track: LandmarkTrack, lifted: LiftedTrack, camera: PinholeCamera, stature_m: float
) -> Evidence:
    """Landmarks and depths of the same frames in metres and seconds, scaled by the stature."""
    # How the trunk moves is told better by how the person grows in the picture.
    trunk = lifted.velocity[:, TORSO_CORNERS].mean(axis=1, keepdims=True)
    visibility = np.clip(track.visibility.astype(np.float64), _LEAST_VISIBILITY, 1.0)
    depth_m = stature_m * lifted.centre_depth
    return Evidence(
        times_s=np.array(track.timebase.times_s),
        slopes=camera.slopes(track.image_px.astype(np.float64)),
        slopes_sd=_PICTURE_SD * (stature_m / depth_m)[:, None] / visibility,
        trunk=TORSO_CORNERS,
        depth_m=stature_m * lifted.depth,
        depth_sd_m=DEPTH_CAUTION * stature_m * lifted.depth_sigma,
        trunk_m=depth_m,
        trunk_sd_m=DEPTH_CAUTION * stature_m * lifted.centre_sigma,
        velocity_mps=stature_m * (lifted.velocity - trunk),
        velocity_sd_mps=VELOCITY_CAUTION * stature_m * lifted.velocity_sigma,
    )


class EvidenceInParts:
    """Evidence of a clip of any length, made part by part."""

    def __init__(
        self, track: Landmarks, lifted: Lifted, camera: PinholeCamera, stature_m: float
    ) -> None:
        self._track, self._lifted = track, lifted
        self._camera, self._stature_m = camera, stature_m

    def part(self, start: int, stop: int) -> tuple[Evidence, LandmarkTrack, LiftedTrack]:
        """Evidence of frames ``start`` to ``stop``, with its track and lifted track."""
        track, lifted = self._track.part(start, stop), self._lifted.part(start, stop)
        return evidence_of(track, lifted, self._camera, self._stature_m), track, lifted

    def chosen(
        self, frames: NDArray[np.intp], looked: Callable[[int], None]
    ) -> tuple[Evidence, Floats]:
        """Evidence of some frames (ascending), and their visibility (n, 33).

        ``looked`` is called with the number of parts that were read.
        """
        pieces, trust = [], []
        for number, (start, stop) in enumerate(parts(len(self._track))):
            looked(number)
            rows = frames[(frames >= start) & (frames < stop)] - start
            if len(rows):
                evidence, track, _ = self.part(start, stop)
                pieces.append(evidence[rows])
                trust.append(track.visibility[rows].astype(np.float64))
        joined = {
            field.name: np.concatenate([getattr(piece, field.name) for piece in pieces])
            for field in fields(Evidence)
            if field.name != "trunk"
        }
        return Evidence(trunk=pieces[0].trunk, **joined), np.concatenate(trust)
