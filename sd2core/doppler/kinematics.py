"""Motion of a body's joints towards a sensor: what a histogram of velocities does not tell.

Joints are found on any surface whose parts are known: where two parts meet, and at their ends.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from sd2core.mesh.sequence import MeshSequence
from sd2core.mesh.vertex_parts import JOINTS, PARTS, VertexParts
from sd2core.scattering.velocity import moments, radial_velocity
from sd2core.sensor import VirtualSensor

Floats = NDArray[np.float64]

_MEETING = {
    "shoulder": ("trunk", "upper_arm"),
    "elbow": ("upper_arm", "forearm"),
    "hip": ("trunk", "thigh"),
    "knee": ("thigh", "lower_leg"),
}
_END_OF = {"hand": ("forearm", "elbow"), "foot": ("lower_leg", "knee")}
_END_SHARE = 0.15
"""Share of a part's vertices, the farthest ones, that are its end."""

_BLOCK_FRAMES = 256


@dataclass(frozen=True, eq=False)
class _Joints:
    """Joints of a mesh, whatever the sensor is; places are found where they are asked for."""

    numbers: NDArray[np.uint8]  # part of the body of every vertex
    rows: list[NDArray[np.intp]]  # vertices whose mean each joint is
    places_m: Floats  # (T, J, 3), in those blocks of frames that are known
    known: NDArray[np.bool_]

    def between(self, mesh: MeshSequence, start: int, stop: int) -> Floats:
        """Places in frames ``start`` to ``stop`` (exclusive), (n, J, 3)."""
        for number in range(start // _BLOCK_FRAMES, -(-stop // _BLOCK_FRAMES)):
            if not self.known[number]:
                first = number * _BLOCK_FRAMES
                block = mesh.read(first, min(first + _BLOCK_FRAMES, mesh.frame_count))
                places = [block[:, row].mean(axis=1, dtype=np.float64) for row in self.rows]
                self.places_m[first : first + len(block)] = np.stack(places, axis=1)
                self.known[number] = True
        return self.places_m[start:stop]


def kinematics(
    mesh: MeshSequence,
    parts: VertexParts,
    sensor: VirtualSensor,
    frames: tuple[int, int] | None = None,
) -> NDArray[np.float32] | None:
    """Motion and place of every joint as a sensor sees them; zero where nothing can be measured.

    Velocities are differences over two frames, as in the maps.

    Parameters
    ----------
    parts : VertexParts
        Of the mesh, as :func:`sd2core.body.parts.known_parts` finds them.
    frames : (int, int), optional
        Half-open; all of the clip otherwise.

    Returns
    -------
    float32 array, shape (joints, quantities, frames), or None
        Of :data:`~sd2core.mesh.vertex_parts.JOINTS` and
        :data:`~sd2core.mesh.vertex_parts.QUANTITIES`; None unless the parts are a body's.
    """
    if parts.names != PARTS or not np.bincount(parts.numbers, minlength=len(PARTS)).all():
        return None
    start, stop = frames or (0, mesh.frame_count)
    joints = _joints_of(mesh, parts)
    place = np.asarray(sensor.position_m, np.float64)
    knots = moments(mesh.times_s, np.arange(start, stop), 1, mesh.presence)
    origin = min(int(knots.before.min()), start)
    places_m = joints.between(mesh, origin, max(int(knots.after.max()) + 1, stop))
    before, after = (places_m[each[:, 0] - origin] for each in (knots.before, knots.after))
    towards = radial_velocity(
        before.transpose(0, 2, 1), after.transpose(0, 2, 1), place, knots.duration_s
    )
    step_m = after - before
    moved_m = np.sqrt(np.einsum("tjk,tjk->tj", step_m, step_m))
    speed = np.divide(
        moved_m, knots.duration_s, out=np.zeros_like(moved_m), where=knots.duration_s > 0
    )
    own = places_m[start - origin : stop - origin]
    about = own - own[:, :1]
    nearer = place - own[:, 0]
    nearer[:, 1] = 0.0
    nearer /= np.maximum(np.linalg.norm(nearer, axis=1, keepdims=True), 1e-9)
    aside = nearer[:, ::-1] * [-1.0, 0.0, 1.0]  # nearer × down
    sigma = np.zeros_like(towards)
    if (known := mesh.uncertainty) is not None:
        limbs = [np.bincount(known.vertex_limb[row]).argmax() for row in joints.rows]
        of_joints = replace(
            known,
            limbs=JOINTS,
            vertex_limb=np.arange(len(JOINTS), dtype=np.uint8),
            along_mps=known.along_mps[start:stop, limbs],
            across_mps=known.across_mps[start:stop, limbs],
        )
        sigma = of_joints.towards(place, own)
    features = (
        towards, speed, np.einsum("tjk,tk->tj", about, nearer),
        np.einsum("tjk,tk->tj", about, aside), -about[..., 1], sigma,
    )  # fmt: skip
    values = np.stack(features, axis=2).transpose(1, 2, 0)
    values[..., ~mesh.presence.measured[start:stop]] = 0.0
    return np.ascontiguousarray(values, np.float32)


_JOINTS_OF: WeakKeyDictionary[MeshSequence, _Joints] = WeakKeyDictionary()


def _joints_of(mesh: MeshSequence, parts: VertexParts) -> _Joints:
    """Joints of a mesh, found once."""
    joints = _JOINTS_OF.get(mesh)
    if joints is None or joints.numbers is not parts.numbers:
        first = mesh.frame(int(np.argmax(mesh.presence.present))).astype(np.float64)
        rows = joint_vertices(first, mesh.faces, parts)
        places_m = np.zeros((mesh.frame_count, len(rows), 3))
        blocks = -(-mesh.frame_count // _BLOCK_FRAMES)
        joints = _Joints(parts.numbers, rows, places_m, np.zeros(blocks, bool))
        _JOINTS_OF[mesh] = joints
    return joints


def joint_vertices(
    points_m: Floats, faces: NDArray[np.int32] | None, parts: VertexParts
) -> list[NDArray[np.intp]]:
    """Vertices whose mean is a joint, in the order of the joints.

    ``points_m`` (V, 3) is the surface in one frame. Where two parts do not meet, the vertex of
    each that is nearest to the other's middle.
    """
    number = {name: np.flatnonzero(parts.numbers == row) for row, name in enumerate(parts.names)}
    ends = np.zeros((0, 2), np.intp)
    if faces is not None:
        ends = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    rows: dict[str, NDArray[np.intp]] = {"trunk": number["trunk"]}
    for side in "LR":
        for joint, (inner, outer) in _MEETING.items():
            names = [inner if inner == "trunk" else f"{inner}.{side}", f"{outer}.{side}"]
            rows[f"{joint}.{side}"] = _border(points_m, ends, *(number[name] for name in names))
        for joint, (part, near) in _END_OF.items():
            from_m = points_m[rows[f"{near}.{side}"]].mean(axis=0)
            rows[f"{joint}.{side}"] = _farthest(points_m, number[f"{part}.{side}"], from_m)
    hips = np.concatenate([rows["hip.L"], rows["hip.R"]])
    rows["head"] = _farthest(points_m, number["trunk"], points_m[hips].mean(axis=0))
    return [rows[joint] for joint in JOINTS]


def _border(
    points_m: Floats, ends: NDArray[np.integer], one: NDArray[np.intp], two: NDArray[np.intp]
) -> NDArray[np.intp]:
    """Vertices of edges between two parts."""
    side = np.zeros(len(points_m), np.int8)
    side[one], side[two] = 1, 2
    across = ends[side[ends].sum(axis=1) * (side[ends].min(axis=1) > 0) == 3]
    if len(across):
        return np.unique(across).astype(np.intp)
    away = [np.linalg.norm(points_m[a] - points_m[b].mean(axis=0), axis=1).argmin()
            for a, b in ((one, two), (two, one))]  # fmt: skip
    return np.array([one[away[0]], two[away[1]]], np.intp)


def _farthest(points_m: Floats, rows: NDArray[np.intp], from_m: Floats) -> NDArray[np.intp]:
    away = np.linalg.norm(points_m[rows] - from_m, axis=1)
    return rows[away >= np.quantile(away, 1.0 - _END_SHARE)]
