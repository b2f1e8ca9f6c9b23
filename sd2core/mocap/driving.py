"""Body of the size of a recorded skeleton, in its poses.

The solver of the fit does it: joints take the place of landmarks seen in a picture,
with their depth known. The joints of another tool are not quite ours, so where each
lies on the body is found from a sample of frames, together with the body's shape.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sd2core.body.evidence import Evidence
from sd2core.body.fitted import fitted_vertices
from sd2core.body.initial import Pose, initial_pose
from sd2core.body.lifter import FEET
from sd2core.body.model import Resolution, Skeleton
from sd2core.body.rig import Keypoints, KeypointSpace, Rig
from sd2core.body.rotations import Floats, applied, transposed
from sd2core.body.shape import BodyShape, ShapeSpace
from sd2core.body.shaping import shape_of_lengths
from sd2core.body.solve import solve, solve_stills
from sd2core.body.track import LANDMARK, LANDMARKS, TORSO_CORNERS
from sd2core.errors import Sd2Error
from sd2core.io.radar.mars import JOINTS
from sd2core.mesh.sequence import MeshSequence
from sd2core.options.bounds import STATURE_M
from sd2core.timebase import Timebase

_STILLS = 150
_ROUNDS = 3
_PLACE_SD_M = 0.005
"""Standard deviation of a joint's place on the body, measured on a sample of frames."""


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
        size_sd=0.0,
        trunk=TORSO_CORNERS,
        depth_m=depth - trunk_m[:, None],
        depth_sd_m=sd_m,
        trunk_m=trunk_m,
        # Every point tells where the whole is: without this, the body would rather be moved
        # in depth than agree with limbs of another length.
        trunk_sd_m=1.0 / np.sqrt(np.maximum((1.0 / sd_m**2).sum(axis=1), 1e-12)),
        velocity_mps=np.zeros_like(sd_m),
        velocity_sd_mps=np.full_like(sd_m, np.inf),
        standing_sd_mps=np.full((len(depth), len(FEET)), np.inf),
    )


@dataclass(frozen=True, eq=False)
class Puppet:
    """One person's body, with the places of a skeleton's joints on it."""

    shape: BodyShape
    keypoints: Keypoints  # the joints at rest, as landmarks
    markers: tuple[Marker, ...]

    def pose(self, clip: SkeletonClip, tick: Callable[[], None] = lambda: None) -> DrivenClip:
        """The body in the poses of one clip; ``tick`` is called often and may raise."""
        rig = Rig(ShapeSpace().skeleton(self.shape), self.keypoints)
        points_m, sd_m, trust = clip.landmarks(self.markers)
        evidence = evidence_of_points(clip.times_s, points_m, sd_m)
        start = initial_pose(rig, points_m, trust)
        pose = solve(rig, evidence, start, lambda done: tick())
        posed_m = rig.keypoints.positions(rig.transforms(*pose))
        residual_m = np.linalg.norm(posed_m - points_m, axis=-1)
        return DrivenClip(
            self, clip, pose, posed_m, np.where(np.isfinite(sd_m), residual_m, np.nan)
        )


@dataclass(frozen=True, eq=False)
class DrivenClip:
    """A body's motion."""

    puppet: Puppet
    clip: SkeletonClip
    pose: Pose
    landmarks_m: Floats  # joints on the moving body, shape (T, 33, 3)
    residual_m: Floats  # distance from those of the skeleton, shape (T, 33); NaN without one

    def mesh(self, times_s: Floats, resolution: Resolution = "medium") -> MeshSequence:
        """The moving surface at any ascending times; vertices are posed where they are read.

        Between the clip's frames the pose follows splines without a kink in velocity;
        before and after the clip its first and last pose are held.
        """
        space = ShapeSpace()
        body = space.load(resolution, self.puppet.shape)
        rig = Rig(body.skeleton, self.puppet.keypoints)
        pose = resample_pose(self.pose, self.clip.times_s, times_s)
        vertices = fitted_vertices(body, rig, pose)
        return MeshSequence(vertices, body.faces, Timebase(times_s), "body driven by a skeleton")


def puppet_of(clips: Sequence[SkeletonClip], markers: tuple[Marker, ...]) -> Puppet:
    """The body of the person whose joints these are; all clips are of one person.

    Raises Sd2Error if the joints are not those of a person.
    """
    stills = _sample(clips, markers)
    space = ShapeSpace()
    points = KeypointSpace(space)
    shape = _shape(space, points, *stills)
    placed = _placed(space.skeleton(shape), points.of(shape), markers, *stills)
    return Puppet(shape, placed, markers)


def _sample(
    clips: Sequence[SkeletonClip], markers: tuple[Marker, ...]
) -> tuple[Floats, Floats, Floats]:
    """Landmarks, their standard deviations, and trust in some of the known frames."""
    parts = []
    for clip in clips:
        known = slice(None) if clip.known is None else clip.known
        parts.append([part[known] for part in clip.landmarks(markers)])
    points_m, sd_m, trust = (np.concatenate(part) for part in zip(*parts, strict=True))
    rows = np.unique(np.linspace(0, len(points_m) - 1, _STILLS).astype(int))
    return points_m[rows], sd_m[rows], trust[rows]


def _shape(
    space: ShapeSpace, points: KeypointSpace, points_m: Floats, sd_m: Floats, trust: Floats
) -> BodyShape:
    """Stature by the way from head to ankles, proportions by the distances of joints."""
    length_m = float(np.median(_upright_m(points_m)))
    stature_m = space.base_stature_m * length_m / float(_upright_m(points.base_m))
    for _ in range(_ROUNDS):
        if stature_m not in STATURE_M:
            raise Sd2Error(
                f"The skeleton is that of a person of {stature_m:.2g} m",
                f"metres, {STATURE_M.low:g} to {STATURE_M.high:g}",
            )
        shape, _ = shape_of_lengths(space, points, points_m, trust, stature_m)
        stature_m *= length_m / float(_upright_m(points.of(shape).rest_m))
    return shape


def _upright_m(points_m: Floats) -> Floats:
    """Distance from the middle of the ears by shoulders, hips and knees to the ankles, (...)."""

    def middle(name: str) -> Floats:
        both = [LANDMARK[f"{name}.L"], LANDMARK[f"{name}.R"]]
        return np.asarray(points_m[..., both, :].mean(axis=-2))

    def apart(first: Floats, second: Floats) -> Floats:
        return np.asarray(np.linalg.norm(first - second, axis=-1))

    length = apart(middle("ear"), middle("shoulder")) + apart(middle("shoulder"), middle("hip"))
    for side in "LR":
        hip, knee, ankle = (
            points_m[..., LANDMARK[f"{part}.{side}"], :] for part in ("hip", "knee", "ankle")
        )
        length = length + 0.5 * (apart(hip, knee) + apart(knee, ankle))
    return length


def _placed(
    skeleton: Skeleton,
    own: Keypoints,
    markers: tuple[Marker, ...],
    points_m: Floats,
    sd_m: Floats,
    trust: Floats,
) -> Keypoints:
    """Keypoints at the joints: pose and place in turn, each place near its landmark."""
    rows = [LANDMARK[marker.landmark] for marker in markers]
    beside = np.array([marker.beside_sd_m for marker in markers])[:, None]
    share = beside**2 / (beside**2 + _PLACE_SD_M**2)
    evidence = evidence_of_points(np.arange(len(points_m), dtype=float), points_m, sd_m)
    placed = own
    for _ in range(_ROUNDS):
        rig = Rig(skeleton, placed)
        pose = solve_stills(rig, evidence, initial_pose(rig, points_m, trust))
        transforms = rig.transforms(*pose)
        off_m = points_m - rig.keypoints.positions(transforms)
        turns = transforms[:, rig.keypoints.bones, :, :3]
        off_m = np.median(applied(transposed(turns), off_m), axis=0)  # (33, 3)
        rest_m = placed.rest_m.copy()
        rest_m[rows] = own.rest_m[rows] + share * (placed.rest_m + off_m - own.rest_m)[rows]
        placed = replace(placed, rest_m=rest_m)
    return placed


def resample_pose(pose: Pose, times_s: Floats, wanted_s: Floats) -> Pose:
    """A pose at other times: splines with continuous acceleration, held at both ends."""
    from scipy.interpolate import CubicSpline
    from scipy.spatial.transform import Rotation, RotationSpline

    if len(times_s) == 1:
        rows = np.zeros(len(wanted_s), int)
        return Pose(pose.turns[rows], pose.translation_m[rows])
    inside = np.clip(wanted_s, times_s[0], times_s[-1])
    turns = np.empty((len(wanted_s), *pose.turns.shape[1:]))
    for joint in range(turns.shape[1]):
        spline = RotationSpline(times_s, Rotation.from_matrix(pose.turns[:, joint]))
        turns[:, joint] = spline(inside).as_matrix()
    return Pose(turns, CubicSpline(times_s, pose.translation_m)(inside))
