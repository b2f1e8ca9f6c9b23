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


def _sided(name: str, mirrored: bool) -> str:
    return name.replace(".L", ".R") if mirrored else name
