"""The moving body of a mesh, made another: of another shape, or coarser."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from sd2core.body.model import Body, own_resolution
from sd2core.body.rig import JOINTS
from sd2core.body.rotations import Floats, applied, product, transposed
from sd2core.body.shape import BodyShape, ShapeSpace
from sd2core.body.skinning import pose_vertices
from sd2core.errors import Sd2Error
from sd2core.mesh.sequence import MeshSequence

_DECIDED = 4
"""Power of a bone's share of a vertex: those that other bones move as well say little of it."""


def reshaped(mesh: MeshSequence, shape: BodyShape) -> MeshSequence:
    """Move a body of another shape as the body of a mesh moves.

    Every bone that a fit turns is turned as the vertices that follow it are (weighted least
    squares: Kabsch, Acta Cryst. A32, 922, 1976). Ways are longer as the legs are, about the
    middle of the way and the floor, where the lowest vertex comes to.

    Parameters
    ----------
    mesh : MeshSequence
        A surface of the bundled body, as ``sd2 fit`` makes it, with a person in every frame.
    shape : BodyShape
        Of the other body.

    Returns
    -------
    MeshSequence
        The same frames and faces, without a statement of accuracy.

    Raises
    ------
    Sd2Error
        If the mesh is another surface.
    """
    resolution = own_resolution(mesh)
    if resolution is None:
        raise Sd2Error(
            f"{mesh.source or 'The mesh'} has another surface than the bundled body",
            "a mesh that `sd2 fit` made",
            "Bones of other meshes are not known: vary places, or mirror",
        )
    body, other = Body.load(resolution), ShapeSpace().load(resolution, shape)
    seen_m = np.asarray(mesh.read(0, mesh.frame_count), np.float64)  # (T, V, 3)
    turns, root_m, size = _motion(body, seen_m)
    hips_m = other.skeleton.heads_m[0]
    longer = hips_m[1] / (size * body.skeleton.heads_m[0, 1])
    centre_m = root_m.mean(axis=0)
    centre_m[1] = seen_m[..., 1].max()
    place_m = centre_m + longer * (root_m - centre_m) - hips_m
    vertices = pose_vertices(other, other.skeleton.transforms(turns, place_m))
    return replace(mesh, vertices=vertices, uncertainty=None)


def coarser(mesh: MeshSequence) -> MeshSequence:
    """The bundled body's coarsest surface on the vertices of a finer one; others as they are.

    Its vertices are the nearest ones of the finer surface at rest, some millimetres off.
    """
    resolution = own_resolution(mesh)
    if resolution in (None, "low"):
        return mesh
    from scipy.spatial import cKDTree

    low, own = Body.load("low"), Body.load(resolution)
    _, nearest = cKDTree(own.vertices_m).query(low.vertices_m)
    vertices = np.ascontiguousarray(mesh.read(0, mesh.frame_count)[:, nearest])
    return replace(mesh, vertices=vertices, faces=low.faces, uncertainty=None)


def _motion(body: Body, seen_m: Floats) -> tuple[Floats, Floats, float]:
    """Turns of the bones (T, B, 3, 3), place of the root (T, 3), and size over that of ``body``."""
    bones = body.skeleton
    turned = {bones.names[0], *(name for joint in JOINTS for name in joint.bones)}
    # The bone that each follows: itself, or the nearest above it that a fit turns.
    leads: list[int] = []
    for number, (name, parent) in enumerate(zip(bones.names, bones.parents, strict=True)):
        leads.append(number if name in turned else leads[parent])
    shares = np.zeros((len(bones), len(body.vertices_m)))
    for numbers, weights in zip(body.bones.T, body.weights.T, strict=True):
        np.add.at(shares, (np.take(leads, numbers), np.arange(len(weights))), weights)
    whole = np.empty((len(seen_m), len(bones), 3, 3))
    turns = np.tile(np.eye(3), (len(seen_m), len(bones), 1, 1))
    for bone in reversed(range(len(bones))):  # the root is the last
        if leads[bone] == bone:
            part = _Rigid.of(body.vertices_m, seen_m, shares[bone] ** _DECIDED)
            whole[:, bone] = part.turns
    for bone, parent in enumerate(bones.parents):
        if leads[bone] != bone:
            whole[:, bone] = whole[:, parent]
        elif parent >= 0:
            turns[:, bone] = product(transposed(whole[:, parent]), whole[:, bone])
    turns[:, 0] = whole[:, 0]
    return turns, part.places(bones.heads_m[0]), part.size


class _Rigid(NamedTuple):
    """Motion of a part that keeps its shape: turns (T, 3, 3), its middle, and its size."""

    turns: Floats
    rest_m: Floats  # (3,)
    middle_m: Floats  # (T, 3)
    size: float

    @classmethod
    def of(cls, rest_m: Floats, seen_m: Floats, weights: Floats) -> _Rigid:
        """Find it by vertices at rest (V, 3) and as they are seen (T, V, 3), weighted."""
        weights = weights / weights.sum()
        rest, middle = weights @ rest_m, np.einsum("v,tvc->tc", weights, seen_m)
        before, after = rest_m - rest, seen_m - middle[:, None]
        left, _, right = np.linalg.svd(np.einsum("v,tvi,vj->tij", weights, after, before))
        left[..., 2] *= np.linalg.det(left @ right)[:, None]
        spread = np.einsum("v,tvc->", weights, after**2) / len(seen_m)
        size = float(np.sqrt(spread / np.einsum("v,vc->", weights, before**2)))
        return cls(left @ right, rest, middle, size)

    def places(self, point_m: Floats) -> Floats:
        """Places of a point at rest (3,) that moves with the part, (T, 3)."""
        return self.middle_m + self.size * applied(self.turns, point_m - self.rest_m)
