"""Recorded skeletons, and the assignment of their joints to landmarks of the body."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sd2core.body.evidence import Evidence
from sd2core.body.rotations import Floats
from sd2core.body.track import LANDMARKS, TORSO_CORNERS
from sd2core.errors import Sd2Error
from sd2core.io.radar.mars import JOINTS


@dataclass(frozen=True)
class Marker:
    """One joint of a skeleton as a landmark of the body."""

    landmark: str  # of sd2core.body.track.LANDMARKS
    joint: int  # number in the skeleton
    sd_m: float  # of the joint's position in a frame
    beside_sd_m: float  # of its lasting distance from the landmark, fixed to the same bone


# Hands are noisy. What a Kinect calls hips, shoulders and feet lies elsewhere than in our
# body; where limbs bend, less so.
_KINECT = (
    ("ear", "Head", 0.015, 0.05),
    ("shoulder", "Shoulder", 0.015, 0.05),
    ("elbow", "Elbow", 0.015, 0.015),
    ("wrist", "Wrist", 0.015, 0.015),
    ("index", "HandTip", 0.04, 0.03),
    ("thumb", "Thumb", 0.08, 0.03),
    ("hip", "Hip", 0.015, 0.05),
    ("knee", "Knee", 0.015, 0.015),
    ("ankle", "Ankle", 0.015, 0.015),
    ("foot_index", "Foot", 0.03, 0.08),
)

KINECT_MARKERS = tuple(
    Marker(
        f"{landmark}.{side[0]}",
        JOINTS.index(joint if joint in JOINTS else joint + side),
        sd_m,
        beside_sd_m,
    )
    for landmark, joint, sd_m, beside_sd_m in _KINECT
    for side in ("Left", "Right")
)
"""The Kinect's joints on our landmarks. Both ears are the middle of the head: where the
face turns, a Kinect does not tell."""


@dataclass(frozen=True, eq=False)
class SkeletonClip:
    """Joints of one stretch of time."""

    times_s: Floats  # (T,), ascending
    joints_m: Floats  # (T, J, 3) in the camera frame, in front of the camera
    known: NDArray[np.bool_] | None = None
    """False in frames whose joints are only bridged; None: all are known."""

    def __post_init__(self) -> None:
        if len(self.times_s) != len(self.joints_m) or not len(self.times_s):
            raise Sd2Error(
                f"{len(self.joints_m)} frames of joints and {len(self.times_s)} times",
                "one time per frame, at least one",
            )
        if not (self.joints_m[..., 2] > 0.0).all():
            raise Sd2Error("A joint lies beside or behind the sensor", "a person in front of it")

    @classmethod
    def on_grid(
        cls, frames: NDArray[np.int64], joints_m: Floats, frames_per_s: float
    ) -> SkeletonClip:
        """Evenly spaced frames; joints of those left out are bridged in a straight line."""
        grid = np.arange(int(frames[-1]) + 1)
        flat = joints_m.reshape(len(joints_m), -1)
        bridged = np.stack([np.interp(grid, frames, column) for column in flat.T], axis=1)
        return cls(grid / frames_per_s, bridged.reshape(len(grid), -1, 3), np.isin(grid, frames))

    def landmarks(self, markers: tuple[Marker, ...]) -> tuple[Floats, Floats, Floats]:
        """The joints as landmarks: points (T, 33, 3), SD in metres (T, 33), and trust (T, 33).

        Points without a marker are at the middle of the trunk. The SD is infinite without
        marker, and in frames that are not known. Trust is 1 with a marker, otherwise 0.
        """
        rows = [LANDMARKS.index(marker.landmark) for marker in markers]
        frames = len(self.times_s)
        points_m = np.empty((frames, len(LANDMARKS), 3))
        points_m[:, rows] = self.joints_m[:, [marker.joint for marker in markers]]
        bare = np.setdiff1d(np.arange(len(LANDMARKS)), rows)
        points_m[:, bare] = points_m[:, TORSO_CORNERS].mean(axis=1)[:, None]
        sd_m = np.full((frames, len(LANDMARKS)), np.inf)
        sd_m[:, rows] = [marker.sd_m for marker in markers]
        if self.known is not None:
            sd_m[~self.known] = np.inf
        trust = np.zeros((frames, len(LANDMARKS)))
        trust[:, rows] = 1.0
        return points_m, sd_m, trust


def evidence_of_points(times_s: Floats, points_m: Floats, sd_m: Floats) -> Evidence:
    """Landmarks (T, 33, 3) that are known in space, for the solver of the fit.

    ``sd_m`` (T, 33) holds in every direction alike; infinite where nothing is known.
    """
    depth = points_m[..., 2]
    trunk_m = depth[:, TORSO_CORNERS].mean(axis=1)
    return Evidence(
        times_s=times_s,
        slopes=points_m[..., :2] / depth[..., None],
        slopes_sd=sd_m / depth,
        trunk=TORSO_CORNERS,
        depth_m=depth - trunk_m[:, None],
        depth_sd_m=sd_m,
        trunk_m=trunk_m,
        # Every point tells where the whole is: without this, the body would rather be moved
        # in depth than agree with limbs of another length.
        trunk_sd_m=1.0 / np.sqrt(np.maximum((1.0 / sd_m**2).sum(axis=1), 1e-12)),
        velocity_mps=np.zeros_like(sd_m),
        velocity_sd_mps=np.full_like(sd_m, np.inf),
    )
