"""The 33 landmarks as points of the body: each fixed to one bone."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sd2core.body.model import read_body_arrays
from sd2core.body.rotations import Floats, applied
from sd2core.body.shape import BodyShape, ShapeSpace
from sd2core.body.track import LANDMARKS


class _Anchor(NamedTuple):
    """A bone, and what its landmark is at rest: a bone's head or a vertex (high surface)."""

    bone: str
    at: str | int


# Left and middle; the right side mirrors it. Knuckles as BlazePose draws them: the
# second joint of the thumb, the first of index and little finger.
_ANCHORS = {
    "nose": _Anchor("head", 5038),
    "eye_inner.L": _Anchor("head", 7804),
    "eye.L": _Anchor("head", 6769),
    "eye_outer.L": _Anchor("head", 7842),
    "ear.L": _Anchor("head", 12006),
    "mouth.L": _Anchor("head", 10372),
    "shoulder.L": _Anchor("upperarm01.L", "upperarm01.L"),
    "elbow.L": _Anchor("lowerarm01.L", "lowerarm01.L"),
    "wrist.L": _Anchor("wrist.L", "wrist.L"),
    "pinky.L": _Anchor("wrist.L", "finger5-1.L"),
    "index.L": _Anchor("wrist.L", "finger2-1.L"),
    "thumb.L": _Anchor("wrist.L", "finger1-2.L"),
    "hip.L": _Anchor("root", "upperleg01.L"),
    "knee.L": _Anchor("lowerleg01.L", "lowerleg01.L"),
    "ankle.L": _Anchor("foot.L", "foot.L"),
    "heel.L": _Anchor("foot.L", 12421),
    "foot_index.L": _Anchor("foot.L", 11519),
}


# Where the landmark model puts its landmarks beside these points, fixed to the same bone:
# thousandths of the stature at rest, to the left, down, backwards; the left side, which
# the right side mirrors. Mean of both sides over simulated people, measured by
# `python -m tools.train_lifter offsets` (docs/decisions/0018).
_SEEN_BESIDE = {
    "nose": (0.0, -8.4, 10.3),
    "eye_inner.L": (-1.5, -3.7, 2.5),
    "eye.L": (-3.1, -0.7, 10.1),
    "eye_outer.L": (-5.7, -2.1, 3.1),
    "ear.L": (-20.4, 3.0, -21.3),
    "mouth.L": (-3.3, -7.4, 4.8),
    "shoulder.L": (-5.9, -6.2, -7.4),
    "elbow.L": (-7.1, -5.8, -8.8),
    "wrist.L": (0.1, 3.3, -7.2),
    "pinky.L": (-10.5, -16.8, -6.9),
    "index.L": (4.3, -4.8, 16.7),
    "thumb.L": (24.4, 3.9, 4.9),
    "hip.L": (-8.0, -2.8, -24.5),
    "knee.L": (-4.1, -7.2, 4.5),
    "ankle.L": (0.0, -15.2, -4.5),
    "heel.L": (-6.3, -1.9, -9.7),
    "foot_index.L": (11.7, -15.0, 20.8),
}


@dataclass(frozen=True, eq=False)
class Keypoints:
    """Points fixed to the bones of one body."""

    bones: NDArray[np.intp]  # (33,)
    rest_m: Floats  # (33, 3) at rest

    def positions(self, transforms: Floats) -> Floats:
        """Positions (T, 33, 3) under :meth:`Skeleton.transforms` (T, B, 3, 4)."""
        moved = transforms[:, self.bones]
        return np.asarray(applied(moved[..., :3], self.rest_m) + moved[..., 3])


class KeypointSpace:
    """Landmarks on bodies of any shape: ``base_m`` (33, 3), ``directions_m`` (K, 33, 3)."""

    def __init__(self, space: ShapeSpace) -> None:
        skeleton = space.base_skeleton
        vertices, directions = (
            array.astype(np.float64)
            for array in read_body_arrays(("high_vertices", "high_shape"), space.path)
        )
        self._space = space
        self.bones = np.empty(len(LANDMARKS), np.intp)
        self.base_m = np.empty((len(LANDMARKS), 3))
        self.directions_m = np.empty((len(space), len(LANDMARKS), 3))
        for number, name in enumerate(LANDMARKS):
            anchor = _ANCHORS[name.replace(".R", ".L")]
            mirrored = name.endswith(".R")
            self.bones[number] = skeleton.index[_sided(anchor.bone, mirrored)]
            if isinstance(anchor.at, str):
                row = skeleton.index[_sided(anchor.at, mirrored)]
                self.base_m[number] = skeleton.heads_m[row]
                self.directions_m[:, number] = space.heads_m[:, row]
            else:
                row = anchor.at
                if mirrored:
                    there = vertices[row] * np.array([-1.0, 1.0, 1.0])
                    row = int(np.argmin(((vertices - there) ** 2).sum(axis=1)))
                self.base_m[number] = vertices[row]
                self.directions_m[:, number] = directions[:, row]

    def of(self, shape: BodyShape) -> Keypoints:
        """Landmarks of one body."""
        moved = self.base_m + np.tensordot(shape.coefficients, self.directions_m, 1)
        return Keypoints(self.bones, shape.stature_m / self._space.base_stature_m * moved)

    def seen_on(self, shape: BodyShape) -> Keypoints:
        """Landmarks of one body as the landmark model sees them, for comparison with pictures.

        They lie up to 4 cm beside :meth:`of`: hips further forward, ears and thumbs further out.
        """
        points = self.of(shape)
        return Keypoints(points.bones, points.rest_m + shape.stature_m * seen_beside())


def seen_beside() -> Floats:
    """Offsets of the landmark model's landmarks from our keypoints, in statures, (33, 3)."""
    rows = []
    for name in LANDMARKS:
        left, down, back = _SEEN_BESIDE[name.replace(".R", ".L")]
        rows.append((-left if name.endswith(".R") else left, down, back))
    return np.array(rows) / 1000.0


def _sided(name: str, mirrored: bool) -> str:
    return name.replace(".L", ".R") if mirrored else name
