"""Result of a fit: shape and motion of a person, and the moving surface made of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sd2core.body.initial import Pose
from sd2core.body.limbs import LIMB_LANDMARKS, LIMBS, vertex_limbs
from sd2core.body.model import Body, Resolution
from sd2core.body.rig import KeypointSpace, Rig
from sd2core.body.rotations import Floats
from sd2core.body.shape import BodyShape, ShapeSpace
from sd2core.body.skinning import pose_vertices
from sd2core.body.track import LANDMARKS
from sd2core.mesh.made_vertices import MadeVertices
from sd2core.mesh.sequence import MeshSequence
from sd2core.mesh.velocity_uncertainty import VelocityUncertainty
from sd2core.timebase import Timebase


@dataclass(frozen=True, eq=False)
class BodyFit:
    """A person's shape and motion."""

    timebase: Timebase
    shape: BodyShape
    turns: Floats  # (T, J, 3, 3) rotation of every joint of rig.JOINTS; held in empty frames
    translation_m: Floats  # (T, 3)
    present: NDArray[np.bool_]  # (T,) False in empty frames
    keypoints_m: Floats  # (T, 33, 3) the fitted body's landmarks in the camera frame
    residual_m: Floats  # (T, 33) distance of the lifted landmarks from them; NaN where not seen
    along_sd_mps: Floats  # (T, 33) deviation of velocity along the line of sight; 0 in empty ones
    across_sd_mps: Floats  # (T, 33) deviation in any direction at right angles to it

    def __len__(self) -> int:
        return len(self.timebase)

    @property
    def quality(self) -> Floats:
        """Quality of the fit per frame, (T,): from 0 (no person) to 1 (landmarks on the body)."""
        seen = np.isfinite(self.residual_m)
        ordered = np.sort(self.residual_m, axis=1)  # what was not seen comes last
        middle = np.maximum(seen.sum(axis=1) - 1, 0) // 2
        median_m = np.take_along_axis(ordered, middle[:, None], axis=1)[:, 0]
        return np.asarray(np.exp(-np.nan_to_num(median_m, nan=np.inf) / 0.05))


@dataclass(frozen=True, eq=False)
class FittedMotion:
    """A person's shape and motion in a clip of any length."""

    timebase: Timebase
    shape: BodyShape
    pose: Pose  # held in empty frames
    present: NDArray[np.bool_]
    along_sd_mps: NDArray[np.float32]  # (T, L) of BodyFit, mean over each limb's landmarks
    across_sd_mps: NDArray[np.float32]  # (T, L)
    seen: Floats  # (33,) share of the frames with the person in which each landmark was seen
    residual_m: float  # mean of BodyFit.residual_m
    quality: float  # mean of BodyFit.quality over frames with the person

    def mesh(self, resolution: Resolution = "high") -> MeshSequence:
        """The moving surface, posed where it is read; its uncertainty is that of the limbs."""
        space = ShapeSpace()
        body = space.load(resolution, self.shape)
        rig = KeypointSpace(space).rig(self.shape)
        limbs = vertex_limbs(body)
        return MeshSequence(
            fitted_vertices(body, rig, self.pose),
            body.faces,
            self.timebase,
            present=self.present.copy(),
            uncertainty=VelocityUncertainty(LIMBS, limbs, self.along_sd_mps, self.across_sd_mps),
        )


def fitted_vertices(body: Body, rig: Rig, pose: Pose) -> MadeVertices:
    """Vertices (T, V, 3) of a body, float32, posed when they are read."""

    def made(rows: NDArray[np.intp]) -> NDArray[np.float32]:
        turns, translation_m = pose.at(rows)
        transforms = body.skeleton.transforms(rig.body_rotations(turns), translation_m)
        return pose_vertices(body, transforms)

    return MadeVertices((len(pose.turns), len(body.vertices_m), 3), np.float32, made)


def mean_over_limbs(landmarks: Floats) -> NDArray[np.float32]:
    """Mean over the landmarks of each limb, (T, L)."""
    rows = [[LANDMARKS.index(name) for name in LIMB_LANDMARKS[limb]] for limb in LIMBS]
    return np.stack([landmarks[:, row].mean(axis=1) for row in rows], axis=1).astype(np.float32)
