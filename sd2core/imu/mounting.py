"""Mounting of a sensor on a body or a surface: its place, its axes, and what carries it.

On the bundled body a place has a name, such as ``left-wrist``. The sensor sits on the skin there
and moves with the bone: x runs along the bone away from the trunk (up the trunk and the head), z
points out of the body, y completes them right-handed.

On any surface it sits on a vertex and moves with the patch around it: z points out of the surface,
x as near to upwards as lies in it in the first frame with a body (where the surface is level, the
axis of the world that is nearest to it), y completes them right-handed.

Either way it is fixed rigidly. A bone or patch moves by the rotation that brings its vertices in
the first frame with a body nearest to those of each frame (W. Kabsch, Acta Crystallographica A32,
1976).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sd2core.body.model import Body, Resolution, own_resolution, vertex_normals
from sd2core.body.rotations import Floats, aligning, frame
from sd2core.errors import Sd2Error
from sd2core.imu.signals import UP, RigidPath, unit_up
from sd2core.mesh.sequence import MeshSequence, refuse_missing
from sd2core.progress import Progress, silent
from sd2core.sensor import Vector

PATCH_RADIUS_M = 0.04
"""Length along the surface from a vertex to the edge of the patch that carries a sensor there."""

_CARRIED = 0.4
"""Least share of a vertex's motion by its bones with which it is taken to move as they do."""
_READ_FRAMES = 64
_LEVEL = 0.2
"""Length of the unit vector upwards within a surface below which it counts as level."""
_FLAT = 1e-4
"""Width of a patch, as a share of its length, below which its rotation is not known."""

_BONE_AXES = "x along the bone, away from the trunk or up it; z out of the body; y right-handed"
_PATCH_AXES = (
    "x nearest to upwards within the surface, in the first frame; z out of it; y right-handed"
)


class _Place(NamedTuple):
    """Place on the left or in the middle of the bundled body."""

    bones: tuple[str, ...]  # that carry the sensor
    ends: tuple[str, str]  # bones from whose head to whose head x runs
    along: float  # place between them
    outwards: Vector  # at rest, roughly; axes to the left, down, backwards


_DORSAL = (0.78, -0.63, -0.05)
"""Direction that the back of the left hand faces at rest."""

_PLACES = {
    "head": _Place(("head",), ("neck01", "head"), 1.7, (0.0, 0.0, -1.0)),
    "chest": _Place(("spine01", "spine02"), ("spine02", "neck01"), 0.5, (0.0, 0.0, -1.0)),
    "pelvis": _Place(
        ("root", "pelvis.L", "pelvis.R", "spine05"), ("root", "spine04"), 0.3, (0.0, 0.0, 1.0)
    ),
    "upper-arm": _Place(
        ("upperarm01.L", "upperarm02.L"), ("upperarm01.L", "lowerarm01.L"), 0.6, (0.75, -0.66, 0.0)
    ),
    "forearm": _Place(("lowerarm01.L",), ("lowerarm01.L", "wrist.L"), 0.4, _DORSAL),
    "wrist": _Place(("lowerarm02.L",), ("lowerarm01.L", "wrist.L"), 0.9, _DORSAL),
    "hand": _Place(
        ("wrist.L", *(f"metacarpal{finger}.L" for finger in range(1, 5))),
        ("wrist.L", "finger3-1.L"),
        0.6,
        _DORSAL,
    ),
    "thigh": _Place(
        ("upperleg01.L", "upperleg02.L"), ("upperleg01.L", "lowerleg01.L"), 0.5, (1.0, 0.0, 0.0)
    ),
    "shank": _Place(
        ("lowerleg01.L", "lowerleg02.L"), ("lowerleg01.L", "foot.L"), 0.5, (1.0, 0.0, 0.0)
    ),
    "foot": _Place(("foot.L",), ("foot.L", "toe1-1.L"), 0.4, (0.0, -1.0, 0.0)),
}
_MIDDLE = ("head", "chest", "pelvis")

PLACES: tuple[str, ...] = (
    *_MIDDLE,
    *(f"{side}-{name}" for name in _PLACES if name not in _MIDDLE for side in ("left", "right")),
)
"""Names of places on the bundled body; left and right are the person's own sides."""


@dataclass(frozen=True, eq=False)
class Mounting:
    """Sensor fixed to some vertices of a mesh, in its first frame with a body."""

    name: str
    axes: str  # in words
    rows: NDArray[np.intp]  # (n,) vertices that carry it
    weights: Floats  # (n,) adding up to 1
    vertices_m: Floats  # (n, 3)
    vertex: int  # that it sits on
    position_m: Floats  # (3,) of the sensor
    rotation: Floats  # (3, 3) from its axes to the world's

    def path(self, mesh: MeshSequence, progress: Progress = silent) -> RigidPath:
        """Place and rotation of the sensor in every frame; the mesh is read in stretches.

        Raises Sd2Error where a vertex of a frame with a body is not finite.
        """
        centre = self.weights @ self.vertices_m
        rest, arm = self.vertices_m - centre, self.position_m - centre
        present = mesh.presence.present
        position_m = np.empty((mesh.frame_count, 3))
        rotation = np.empty((mesh.frame_count, 3, 3))
        for start in range(0, mesh.frame_count, _READ_FRAMES):
            stop = min(start + _READ_FRAMES, mesh.frame_count)
            whole = mesh.read(start, stop)
            block = whole[:, self.rows].astype(np.float64)  # (t, n, 3)
            block[~present[start:stop]] = self.vertices_m
            missing = np.flatnonzero(~np.isfinite(block).all(axis=(1, 2)))
            for number in missing.tolist():
                refuse_missing(whole[number : number + 1], start + number, mesh.source)
            middle = np.einsum("n,tni->ti", self.weights, block)
            turns = aligning(
                np.broadcast_to(rest, block.shape),
                block - middle[:, None],
                np.broadcast_to(self.weights, block.shape[:2]),
            )
            position_m[start:stop] = middle + turns @ arm
            rotation[start:stop] = turns @ self.rotation
            progress(stop, mesh.frame_count)
        return RigidPath(mesh.timebase, position_m, rotation, present)


def mounted(mesh: MeshSequence, at: str | int, up: Vector = UP) -> Mounting:
    """Mount a sensor at a named place of the bundled body, or on a vertex.

    Parameters
    ----------
    mesh : MeshSequence
        With faces.
    at : str or int
        One of :data:`PLACES`, or the number of a vertex, which may be text as well.
    up : tuple of 3 floats
        Direction upwards in the world.

    Raises
    ------
    Sd2Error
        When the mesh has no body, no such place or vertex, or no surface around the vertex.

    Examples
    --------
    >>> import sd2core as sd2
    >>> from sd2core.files.resources import resource_path
    >>> mesh = sd2.load_mesh(resource_path("swipes.sd2") / "mesh.zarr")
    >>> mounted(mesh, "left-wrist").axes
    'x along the bone, away from the trunk or up it; z out of the body; y right-handed'
    """
    if not mesh.presence.present.any():
        raise Sd2Error(f"{_source(mesh)} has no frame with a body", "one at least")
    name = str(at).strip()
    first = int(np.argmax(mesh.presence.present))
    points_m = mesh.frame(first).astype(np.float64)  # (V, 3)
    refuse_missing(points_m[None], first, mesh.source)
    if name.isdecimal() and name.isascii() and len(name) < 10:
        return _on_vertex(mesh, points_m, int(name), unit_up(up))
    resolution = own_resolution(mesh)
    vertices = f"the number of a vertex, 0 to {mesh.vertex_count - 1}"
    if resolution is None:
        raise Sd2Error(
            f"{_source(mesh)} is not the bundled body's surface, and the sensor is to be at"
            f" {name!r}",
            vertices,
            "Names such as left-wrist are known on meshes that `sd2 fit` makes",
        )
    if name not in PLACES:
        raise Sd2Error(
            f"The sensor is to be at {name!r}", f"one of {', '.join(PLACES)}, or {vertices}"
        )
    return _on_bone(mesh, points_m, Body.load(resolution), name)


def place_near(mesh: MeshSequence, vertex: int) -> str:
    """Find the named place nearest to a vertex of the bundled body.

    Of the places whose bones carry the vertex, the one nearest to it on the body at rest; of all
    places where none of them does, as on a finger. On any other surface the vertex itself is the
    place: its number as text.

    Examples
    --------
    >>> import sd2core as sd2
    >>> from sd2core.files.resources import resource_path
    >>> mesh = sd2.load_mesh(resource_path("swipes.sd2") / "mesh.zarr")
    >>> place_near(mesh, mounted(mesh, "left-hand").vertex)
    'left-hand'
    """
    resolution = own_resolution(mesh)
    return str(vertex) if resolution is None else PLACES[_nearest_places(resolution)[vertex]]


@lru_cache(maxsize=3)
def _nearest_places(resolution: Resolution) -> NDArray[np.intp]:
    """Number of the nearest place for every vertex of the bundled body, (V,)."""
    body = Body.load(resolution)
    away_m = np.empty((len(PLACES), len(body.vertices_m)))
    carries = np.empty_like(away_m, bool)
    for number, name in enumerate(PLACES):
        carried, vertex, _ = _on_skin(body, _place(name))
        away_m[number] = np.linalg.norm(body.vertices_m - body.vertices_m[vertex], axis=1)
        carries[number] = carried >= _CARRIED
    counts = carries | ~carries.any(axis=0)
    return np.asarray(np.where(counts, away_m, np.inf).argmin(axis=0))


def _on_bone(mesh: MeshSequence, points_m: Floats, body: Body, name: str) -> Mounting:
    carried, vertex, axes = _on_skin(body, _place(name))
    rows = np.flatnonzero(carried >= _CARRIED)
    weights = carried[rows] / carried[rows].sum()
    at_rest = body.vertices_m[rows]
    turn = aligning(
        (at_rest - weights @ at_rest)[None],
        (points_m[rows] - weights @ points_m[rows])[None],
        weights[None],
    )[0]
    at = vertex, points_m[vertex]
    return Mounting(name, _BONE_AXES, rows, weights, points_m[rows], *at, turn @ axes)


def _on_skin(body: Body, place: _Place) -> tuple[Floats, int, Floats]:
    """Share of every vertex's motion by a place's bones (V,), its vertex, its axes (3, 3)."""
    number = body.skeleton.index
    carried = (body.weights * np.isin(body.bones, [number[bone] for bone in place.bones])).sum(1)
    rows = np.flatnonzero(carried >= _CARRIED)
    start, end = (body.skeleton.heads_m[number[bone]] for bone in place.ends)
    axes = _axes(end - start, np.array(place.outwards))
    # The skin where a ray leaves the bone: of what lies outwards, what is nearest to the ray.
    away = body.vertices_m[rows] - (start + place.along * (end - start))
    out = axes[:, 2]
    beside = np.linalg.norm(away - (away @ out)[:, None] * out, axis=1)
    vertex = rows[np.argmin(np.where(away @ out > 0, beside, np.inf))]
    return carried, int(vertex), axes


def _place(name: str) -> _Place:
    """Place on either side."""
    side, _, part = name.partition("-")
    if side not in ("left", "right"):
        return _PLACES[name]
    place = _PLACES[part]
    if side == "left":
        return place
    left, down, back = place.outwards
    first, last = (_right(bone) for bone in place.ends)
    return _Place(tuple(map(_right, place.bones)), (first, last), place.along, (-left, down, back))


def _right(bone: str) -> str:
    return bone.replace(".L", ".R")


def _on_vertex(mesh: MeshSequence, points_m: Floats, vertex: int, up: Floats) -> Mounting:
    if vertex >= mesh.vertex_count:
        raise Sd2Error(
            f"{_source(mesh)} has {mesh.vertex_count:,} vertices, and the sensor is to be on"
            f" number {vertex}",
            f"0 to {mesh.vertex_count - 1}",
        )
    if mesh.faces is None:
        raise Sd2Error(
            f"{_source(mesh)} has points without a surface",
            "faces, which say what surrounds a vertex",
            "Give the faces of the mesh (--faces)",
        )
    rows = _patch(points_m, mesh.faces, vertex)
    out = vertex_normals(points_m, mesh.faces)[rows].sum(axis=0)
    patch = points_m[rows]
    spread = np.linalg.svd(patch - patch.mean(axis=0), compute_uv=False)
    if len(rows) < 3 or not spread[1] > _FLAT * spread[0] or not np.linalg.norm(out) > 0:
        raise Sd2Error(
            f"{_source(mesh)}: the {len(rows)} vertices around number {vertex} make no surface",
            "three or more that are not on a line",
            "Choose another vertex",
        )
    out = out / np.linalg.norm(out)
    level = np.linalg.norm(up - (up @ out) * out) < _LEVEL
    towards = np.eye(3)[np.argmin(np.abs(out))] if level else up
    axes = _axes(towards - (towards @ out) * out, out)
    weights = np.full(len(rows), 1.0 / len(rows))
    at = vertex, points_m[vertex]
    return Mounting(f"vertex {vertex}", _PATCH_AXES, rows, weights, patch, *at, axes)


def _patch(points_m: Floats, faces: NDArray[np.int32], vertex: int) -> NDArray[np.intp]:
    """Vertices near one along the surface, those that share a face with it at least."""
    from scipy.sparse.csgraph import dijkstra

    from sd2core.body.parts import edge_lengths

    lengths_m = edge_lengths(points_m, faces)
    away = dijkstra(lengths_m, directed=False, indices=vertex, limit=PATCH_RADIUS_M)
    beside = faces[(faces == vertex).any(axis=1)]
    return np.union1d(np.flatnonzero(np.isfinite(away)), beside).astype(np.intp)


def _axes(along: Floats, outwards: Floats) -> Floats:
    """Axes in columns: x along, z outwards at right angles to it, y = z × x."""
    x, z, minus_y = frame(along, outwards).T
    return np.stack([x, -minus_y, z], axis=1)


def _source(mesh: MeshSequence) -> str:
    return mesh.source or "The mesh"


def checked_places(places: Sequence[str]) -> tuple[str, ...]:
    """Names of places, each once; Sd2Error for one that is none."""
    if not {*places} <= {*PLACES} or len(set(places)) < len(places):
        raise Sd2Error(
            f"The inertial sensors are to be at {', '.join(places)}",
            f"some of {', '.join(PLACES)}, each once",
        )
    return tuple(places)
