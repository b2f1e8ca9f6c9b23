"""The joints that a fit turns, 48 degrees of freedom of 104 bones, and the landmarks on them.

A joint turns one bone, or several by the same rotation (the spine bends in three
places, a forearm twists in two). Rotations are kept as matrices and changed on their
right by small turns about the joint's own axes, so there is no gimbal lock.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sd2core.body.model import Skeleton, read_body_arrays
from sd2core.body.rotations import Floats, applied, product
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
            array.astype(np.float64) for array in read_body_arrays(("high_vertices", "high_shape"))
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
                    opposite = vertices[row] * np.array([-1.0, 1.0, 1.0])
                    row = int(np.argmin(((vertices - opposite) ** 2).sum(axis=1)))
                self.base_m[number] = vertices[row]
                self.directions_m[:, number] = directions[:, row]

    def of(self, shape: BodyShape) -> Keypoints:
        """Landmarks of one body."""
        moved = self.base_m + np.tensordot(shape.coefficients, self.directions_m, 1)
        return Keypoints(self.bones, shape.stature_m / self._space.base_stature_m * moved)

    def rig(self, shape: BodyShape) -> Rig:
        """Joints of one body, and its landmarks."""
        return Rig(self._space.skeleton(shape), self.of(shape))


def _sided(name: str, mirrored: bool) -> str:
    return name.replace(".L", ".R") if mirrored else name


@dataclass(frozen=True)
class Joint:
    """One rotation of the fit, shared by all of its bones.

    ``hinge`` names three bones: the joint turns only about the normal of the plane of their heads
    at rest, bending the chain further. ``along`` names two: it turns only about the line between
    their heads. Without both it turns about all axes.
    """

    name: str
    bones: tuple[str, ...]
    hinge: tuple[str, str, str] | None = None
    along: tuple[str, str] | None = None


def _both(*joints: Joint) -> Iterator[Joint]:
    for joint in joints:
        for side in "LR":
            yield Joint(
                f"{joint.name}.{side}",
                tuple(f"{bone}.{side}" for bone in joint.bones),
                joint.hinge and tuple(f"{bone}.{side}" for bone in joint.hinge),  # type: ignore[arg-type]
                joint.along and tuple(f"{bone}.{side}" for bone in joint.along),  # type: ignore[arg-type]
            )


JOINTS = (
    Joint("root", ("root",)),
    Joint("spine", ("spine04", "spine03", "spine02")),
    Joint("head", ("neck01", "neck03", "head")),
    *_both(
        Joint("clavicle", ("clavicle",)),
        Joint("shoulder", ("upperarm01",)),
        Joint("elbow", ("lowerarm01",), hinge=("upperarm01", "lowerarm01", "wrist")),
        # Radius and ulna share the turn of the hand.
        Joint("pronation", ("lowerarm02", "wrist"), along=("lowerarm02", "wrist")),
        Joint("wrist", ("wrist",)),
        Joint("hip", ("upperleg01",)),
        Joint("knee", ("lowerleg01",), hinge=("upperleg01", "lowerleg01", "foot")),
        Joint("ankle", ("foot",)),
    ),
)
"""Parents before children."""

JOINT = {joint.name: number for number, joint in enumerate(JOINTS)}
"""Number of a joint by its name."""

CHEST, BEHIND = len(LANDMARKS), len(LANDMARKS) + 1
"""Numbers of the chest and of the point behind it among a rig's marks."""

_CHEST = "spine01"


class Rig:
    """Joints of one body, and the keypoints that follow them.

    Attributes
    ----------
    skeleton
        Only the bones that the joints turn or the keypoints follow.
    marks
        Keypoints, then a point of the chest and one a metre behind it.
    axes
        Axes of each joint, in the rest pose; of shape (3, 1) or (3, 3).
    columns
        Degrees of freedom of each joint; the translation is last.
    freedoms
        Number of all of them, translation included.
    """

    def __init__(self, skeleton: Skeleton, keypoints: Keypoints) -> None:
        needed = {bone for joint in JOINTS for bone in joint.bones}
        needed |= {skeleton.names[bone] for bone in keypoints.bones}
        self.skeleton, self._kept = skeleton.pruned(needed)
        self._whole = skeleton
        place = {int(bone): number for number, bone in enumerate(self._kept)}
        bones = np.array([place[int(bone)] for bone in keypoints.bones], np.intp)
        self.keypoints = replace(keypoints, bones=bones)
        chest = self.skeleton.index[_CHEST]
        ends = self.skeleton.heads_m[chest] + np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
        self.marks = Keypoints(
            np.concatenate([bones, [chest, chest]]), np.concatenate([keypoints.rest_m, ends])
        )
        self.axes = [_axes(joint, self.skeleton) for joint in JOINTS]
        ends = np.cumsum([axes.shape[1] for axes in self.axes])
        self.columns = [
            slice(int(end) - axes.shape[1], int(end))
            for end, axes in zip(ends, self.axes, strict=True)
        ]
        self.freedoms = int(ends[-1]) + 3

    def transforms(self, turns: Floats, translation_m: Floats) -> Floats:
        """Transforms of the rig's bones (T, B, 3, 4) by joints' rotations (T, J, 3, 3)."""
        return self.skeleton.transforms(self._rotations(turns), translation_m)

    def body_rotations(self, turns: Floats) -> Floats:
        """Rotations of all the body's bones (T, 104, 3, 3), for :meth:`Skeleton.transforms`."""
        rotations = np.tile(np.eye(3), (len(turns), len(self._whole), 1, 1))
        rotations[:, self._kept] = self._rotations(turns)
        return rotations

    def _rotations(self, turns: Floats) -> Floats:
        rotations = np.tile(np.eye(3), (len(turns), len(self.skeleton), 1, 1))
        bones, numbers = self._first_turns
        rotations[:, bones] = turns[:, numbers]
        for bone, number in self._further_turns:
            rotations[:, bone] = product(rotations[:, bone], turns[:, number])
        return rotations

    def jacobian(self, transforms: Floats, positions_m: Floats) -> Floats:
        """Derivative of the marks by every degree of freedom, (T, 35, 3, freedoms).

        A small turn by δ about a joint's axis a, made on the right of its rotation,
        moves a point x by δ (W a) × (x − p): W is the bone's rotation in the world
        and p its head.
        """
        frames = len(transforms)
        jacobian = np.zeros((frames, positions_m.shape[1], 3, self.freedoms))
        for number, bones in enumerate(self._bones):
            for bone in bones:
                rows = self._follows[bone]
                head = applied(transforms[:, bone, :, :3], self.skeleton.heads_m[bone])
                arms = positions_m[:, rows] - (head + transforms[:, bone, :, 3])[:, None]
                after = self._turned_after(transforms, bone, number)  # (T, 3, n)
                jacobian[:, rows, :, self.columns[number]] += _cross(after, arms)
        for axis in range(3):
            jacobian[:, :, axis, self.freedoms - 3 + axis] = 1.0
        return jacobian

    def _turned_after(self, transforms: Floats, bone: int, joint: int) -> Floats:
        """World directions of the joint's axes at one bone, (T, 3, n)."""
        # Where two joints turn one bone (pronation, then wrist), the first one's axis is
        # that of its other bone: a twist goes along the line, which the second leaves.
        last = self._bones[joint][0] if JOINTS[joint].along else bone
        return np.asarray(transforms[:, last, :, :3] @ self.axes[joint])

    @cached_property
    def _bones(self) -> list[list[int]]:
        return [[self.skeleton.index[bone] for bone in joint.bones] for joint in JOINTS]

    @cached_property
    def _first_turns(self) -> tuple[list[int], list[int]]:
        """Bones that joints turn, and the number of the first joint that turns each."""
        first: dict[int, int] = {}
        for number, bones in enumerate(self._bones):
            for bone in bones:
                first.setdefault(bone, number)
        return list(first), list(first.values())

    @cached_property
    def _further_turns(self) -> list[tuple[int, int]]:
        """Bones that several joints turn, and the numbers of the joints after the first."""
        first = dict(zip(*self._first_turns, strict=True))
        return [
            (bone, number)
            for number, bones in enumerate(self._bones)
            for bone in bones
            if first[bone] != number
        ]

    @cached_property
    def _follows(self) -> dict[int, NDArray[np.intp]]:
        """Marks that each turning bone carries."""
        parents = self.skeleton.parents

        def carried(bone: int, by: int) -> bool:
            while bone >= 0 and bone != by:
                bone = parents[bone]
            return bone == by

        return {
            by: np.array(
                [row for row, bone in enumerate(self.marks.bones) if carried(int(bone), by)],
                np.intp,
            )
            for bones in self._bones
            for by in bones
        }


def _cross(axes: Floats, arms: Floats) -> Floats:
    """Cross products (T, rows, 3, n) of the columns of (T, 3, n) with (T, rows, 3)."""
    x, y, z = np.moveaxis(axes, 1, 0)[:, :, None]  # (T, 1, n) each
    a, b, c = np.moveaxis(arms, 2, 0)[..., None]  # (T, rows, 1) each
    return np.stack([y * c - z * b, z * a - x * c, x * b - y * a], axis=2)


def _axes(joint: Joint, skeleton: Skeleton) -> Floats:
    heads, index = skeleton.heads_m, skeleton.index
    if joint.hinge is not None:
        first, middle, last = (heads[index[bone]] for bone in joint.hinge)
        normal = np.cross(middle - first, last - middle)
        return np.asarray((normal / np.linalg.norm(normal))[:, None])
    if joint.along is not None:
        first, last = (heads[index[bone]] for bone in joint.along)
        return np.asarray(((last - first) / np.linalg.norm(last - first))[:, None])
    return np.eye(3)
