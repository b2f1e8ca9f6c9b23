"""Body of the size of a recorded skeleton, in its poses.

The solver of the fit does it: joints take the place of landmarks seen in a picture,
with their depth known. The joints of another tool are not quite ours, so where each
lies on the body is found from a sample of frames, together with the body's shape.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from sd2core.body.fitted import FittedVertices
from sd2core.body.initial import Pose, initial_pose
from sd2core.body.keypoints import Keypoints, KeypointSpace
from sd2core.body.model import Resolution, Skeleton
from sd2core.body.rig import Rig
from sd2core.body.rotations import Floats, applied, transposed
from sd2core.body.shape import BodyShape, ShapeSpace
from sd2core.body.shaping import shape_of_lengths
from sd2core.body.solve import solve, solve_stills
from sd2core.body.track import LANDMARKS
from sd2core.errors import Sd2Error
from sd2core.mesh.sequence import MeshSequence
from sd2core.mocap.skeleton import Marker, SkeletonClip, evidence_of_points
from sd2core.timebase import Timebase

_STILLS = 150
_ROUNDS = 3
_PLACE_SD_M = 0.005
"""Standard deviation of a joint's place on the body, measured on a sample of frames."""
_AT = {name: row for row, name in enumerate(LANDMARKS)}


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
        found_m = rig.keypoints.positions(rig.transforms(*pose))
        residual_m = np.linalg.norm(found_m - points_m, axis=-1)
        return DrivenClip(
            self, clip, pose, found_m, np.where(np.isfinite(sd_m), residual_m, np.nan)
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
        vertices = FittedVertices(body, rig, len(times_s), pose.at)
        return MeshSequence(vertices, body.faces, Timebase(times_s), "body driven by a skeleton")


def puppet_of(clips: Sequence[SkeletonClip], markers: tuple[Marker, ...]) -> Puppet:
    """The body of the person whose joints these are; all clips are of one person.

    Raises Sd2Error if the joints are not those of a person.
    """
    stills = _sample(clips, markers)
    space = ShapeSpace()
    points = KeypointSpace(space)
    shape = _shape(space, points, *stills)
    own = points.of(shape)
    rest_m = own.rest_m.copy()
    ears = [_AT["ear.L"], _AT["ear.R"]]
    rest_m[ears] = rest_m[ears].mean(axis=0)
    own = replace(own, rest_m=rest_m)
    return Puppet(shape, _placed(space.skeleton(shape), own, markers, *stills), markers)


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
        if not 0.5 < stature_m < 2.6:
            raise Sd2Error(
                f"The skeleton is that of a person of {stature_m:.2g} m", "metres, 0.5 to 2.6"
            )
        shape, _ = shape_of_lengths(space, points, points_m, trust, stature_m)
        stature_m *= length_m / float(_upright_m(points.of(shape).rest_m))
    return shape


def _upright_m(points_m: Floats) -> Floats:
    """Distance from the middle of the ears by shoulders, hips and knees to the ankles, (...)."""

    def middle(name: str) -> Floats:
        return np.asarray(
            0.5 * (points_m[..., _AT[f"{name}.L"], :] + points_m[..., _AT[f"{name}.R"], :])
        )

    def apart(first: Floats, second: Floats) -> Floats:
        return np.asarray(np.linalg.norm(first - second, axis=-1))

    length = apart(middle("ear"), middle("shoulder")) + apart(middle("shoulder"), middle("hip"))
    for side in "LR":
        hip, knee, ankle = (
            points_m[..., _AT[f"{part}.{side}"], :] for part in ("hip", "knee", "ankle")
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
    rows = [_AT[marker.landmark] for marker in markers]
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
