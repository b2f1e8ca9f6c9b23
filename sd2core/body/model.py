"""The bundled body: a closed surface on a skeleton, posed by linear blend skinning."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sd2core.body.rotations import Floats
from sd2core.files.resources import open_bundled_arrays, resource_path
from sd2core.mesh.sequence import MeshSequence
from sd2core.options.fitting import Resolution as Resolution

FORMAT = "sd2-body"
VERSION = 2
INFLUENCES = 8
"""Bones per vertex, at most."""

_SKELETON = ("bone_names", "bone_parents", "bone_heads")


@dataclass(frozen=True, eq=False)
class Skeleton:
    """Bones at rest, every parent before its children, bone 0 the root."""

    names: tuple[str, ...]
    parents: tuple[int, ...]  # -1 for the root
    heads_m: Floats  # (B, 3) points about which the bones turn

    @cached_property
    def index(self) -> Mapping[str, int]:
        """Number of a bone by its name."""
        return {name: number for number, name in enumerate(self.names)}

    def __len__(self) -> int:
        return len(self.names)

    def length_m(self, *bones: str) -> float:
        """Length at rest of the way from head to head of some bones."""
        heads = [self.heads_m[self.index[bone]] for bone in bones]
        return sum(float(np.linalg.norm(end - start)) for start, end in pairwise(heads))

    def pruned(self, names: Collection[str]) -> tuple[Skeleton, NDArray[np.intp]]:
        """Only these bones and those above them, and their numbers here."""
        kept = set()
        for name in names:
            bone = self.index[name]
            while bone >= 0:
                kept.add(bone)
                bone = self.parents[bone]
        numbers = sorted(kept)
        place = {bone: number for number, bone in enumerate(numbers)} | {-1: -1}
        rows = np.array(numbers, np.intp)
        pruned = Skeleton(
            tuple(self.names[bone] for bone in numbers),
            tuple(place[self.parents[bone]] for bone in numbers),
            self.heads_m[rows],
        )
        return pruned, rows

    def transforms(self, rotations: Floats, translation_m: Floats | None = None) -> Floats:
        """Transforms ``[R | t]`` of every bone, (T, B, 3, 4): a point x at rest goes to R x + t.

        ``rotations`` (T, B, 3, 3) turn every bone about its head relative to its parent, in
        the axes of the rest pose; the identity is the rest pose. The translation (T, 3) is
        added to everything.
        """
        # Frames last: NumPy is quick along the last axis, and the others are short.
        turns = np.ascontiguousarray(np.moveaxis(rotations, 0, -1), np.float64)  # (B, 3, 3, T)
        transforms = np.empty((len(self), 3, 4, len(rotations)))
        for bones, parents in self._generations:
            heads = self.heads_m[bones, :, None]
            turn = turns[bones]
            if parents is None:
                moved = np.broadcast_to(heads, (*heads.shape[:2], len(rotations)))
                if translation_m is not None:
                    moved = moved + translation_m.T
            else:
                above = transforms[parents]
                turn = _summed(above[:, :, :3, None], turn[:, None])
                moved = _summed(above[:, :, :3], heads[:, None]) + above[:, :, 3]
            transforms[bones, :, :3] = turn
            transforms[:, :, 3][bones] = moved - _summed(turn, heads[:, None])
        return np.ascontiguousarray(np.moveaxis(transforms, -1, 0))

    @cached_property
    def _generations(self) -> list[tuple[NDArray[np.intp], NDArray[np.intp] | None]]:
        """Numbers of the bones without a parent, then of their children and so on.

        Each with the numbers of their parents.
        """
        parents = np.array(self.parents, np.intp)
        bones = np.flatnonzero(parents < 0)
        generations: list[tuple[NDArray[np.intp], NDArray[np.intp] | None]] = [(bones, None)]
        while len(bones := np.flatnonzero(np.isin(parents, bones))):
            generations.append((bones, parents[bones]))
        return generations


@dataclass(frozen=True, eq=False)
class Body:
    """A surface fixed to a skeleton.

    Axes are those of the camera frame for a body that faces the camera: x to its left (right in
    the image), y down, z backwards; the origin is on the floor.
    """

    vertices_m: Floats  # (V, 3) at rest
    faces: NDArray[np.int32]  # (F, 3) counter-clockwise from outside
    bones: NDArray[np.intp]  # (V, 8) bones that move a vertex, strongest first
    weights: Floats  # (V, 8) each row adds up to 1
    skeleton: Skeleton

    @classmethod
    def load(cls, resolution: Resolution = "high") -> Body:
        """Read one surface of the bundled body.

        The resolutions have 13,348, 5,000 and 1,229 vertices, each one closed component; those
        of ``medium`` are vertices of ``high``. Raises Sd2Error if the file is missing, damaged or
        of a later version.
        """
        surface = [f"{resolution}_{part}" for part in ("vertices", "faces", "bones", "weights")]
        vertices, faces, bones, weights = read_body_arrays(surface)
        weights = weights.astype(np.float64)
        return cls(
            vertices_m=vertices.astype(np.float64),
            faces=faces.astype(np.int32),
            bones=bones.astype(np.intp),
            weights=weights / weights.sum(axis=1, keepdims=True),
            skeleton=load_skeleton(),
        )

    @property
    def stature_m(self) -> float:
        """Height at rest."""
        return float(np.ptp(self.vertices_m[:, 1]))


def load_skeleton() -> Skeleton:
    """Read the bones of the bundled body."""
    names, parents, heads = read_body_arrays(_SKELETON)
    return Skeleton(
        names=tuple(str(name) for name in names),
        parents=tuple(int(parent) for parent in parents),
        heads_m=heads.astype(np.float64),
    )


def read_body_arrays(names: Sequence[str]) -> list[NDArray[Any]]:
    """Arrays of the bundled body's file, as they are stored.

    Raises Sd2Error if the file is missing, damaged, of a later version, or lacks one of them.
    """
    path, command = resource_path("body.npz"), "python -m tools.bundled body"
    with open_bundled_arrays(path, FORMAT, VERSION, "a body", command) as (_, data):
        return [data[name] for name in names]


def vertex_normals(vertices_m: Floats, faces: NDArray[np.int32]) -> Floats:
    """Outward unit normals of one frame, area-weighted over the faces, (V, 3)."""
    corners = vertices_m[faces]  # (F, 3, 3)
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.stack(
        [
            np.bincount(faces.ravel(), np.repeat(across[:, axis], 3), minlength=len(vertices_m))
            for axis in range(3)
        ],
        axis=1,
    )
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.divide(normals, length, out=np.zeros_like(normals), where=length > 0)


def _summed(left: Floats, right: Floats) -> Floats:
    """Sum of products over the third axis, in the same order on every machine."""
    products = left * right
    return products[:, :, 0] + products[:, :, 1] + products[:, :, 2]


def own_resolution(mesh: MeshSequence) -> Resolution | None:
    """Resolution of the bundled surface that a mesh is, by its faces; None for any other."""
    if mesh.faces is None:
        return None
    for resolution, faces in _own_faces():
        if faces.shape == mesh.faces.shape and np.array_equal(faces, mesh.faces):
            return resolution
    return None


@lru_cache(maxsize=1)
def _own_faces() -> tuple[tuple[Resolution, NDArray[np.int32]], ...]:
    names: tuple[Resolution, ...] = ("low", "medium", "high")
    return tuple((name, Body.load(name).faces) for name in names)
