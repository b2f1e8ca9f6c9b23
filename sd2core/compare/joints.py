"""Joints of a surface, each the weighted mean of a small patch of vertices.

A surface of ours is known by its faces, and carries fixed patches: all vertices within
a radius of the joint on the bundled body at rest, of the limbs that meet there. Their
weights are as even as they can be while the patch of the bundled body gives the joint
itself. So a patch of another shape gives a point some millimetres from its joint, the
same point in every frame, which is all that velocities and differences need.

Another surface (SMPL's, say) takes the patches over from one of ours: in the frame in
which the two lie closest, every vertex of a patch is replaced by the nearest one there,
and those are followed.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sd2core.body.limbs import LIMBS, vertex_limbs
from sd2core.body.model import Body, Resolution
from sd2core.errors import Sd2Error

Floats = NDArray[np.float64]


class _Patch(NamedTuple):
    bones: tuple[str, ...]  # the joint is the mean of their heads
    limbs: tuple[str, ...]
    radius_m: float


# Left and middle; the right side likewise.
_PATCHES = {
    "head": _Patch(("head", "eye.L", "eye.R"), ("head",), 0.13),
    "neck": _Patch(("neck01",), ("head", "torso"), 0.09),
    "chest": _Patch(("spine02",), ("torso",), 0.19),
    "pelvis": _Patch(("root",), ("torso",), 0.17),
    "shoulder.L": _Patch(("upperarm01.L",), ("torso", "upper_arm.L"), 0.09),
    "elbow.L": _Patch(("lowerarm01.L",), ("upper_arm.L", "forearm.L"), 0.065),
    "wrist.L": _Patch(("wrist.L",), ("forearm.L", "hand.L"), 0.045),
    "hand.L": _Patch(
        ("wrist.L", "finger2-1.L", "finger3-1.L", "finger4-1.L", "finger5-1.L"),
        ("hand.L",),
        0.050,
    ),
    "hip.L": _Patch(("upperleg01.L",), ("torso", "thigh.L"), 0.14),
    "knee.L": _Patch(("lowerleg01.L",), ("thigh.L", "shank.L"), 0.085),
    "ankle.L": _Patch(("foot.L",), ("shank.L", "foot.L"), 0.065),
}

JOINTS: tuple[str, ...] = tuple(
    name if side == "L" else name.replace(".L", ".R")
    for name in _PATCHES
    for side in ("LR" if name.endswith(".L") else "L")
)
"""Joints in the order of arrays; L and R are the person's own sides."""

GROUPS = {
    "hands": ("hand.L", "hand.R"),
    "wrists": ("wrist.L", "wrist.R"),
    "elbows": ("elbow.L", "elbow.R"),
    "torso": ("chest", "pelvis"),
    "legs": ("knee.L", "knee.R", "ankle.L", "ankle.R"),
}
"""Joints that are reported together."""

_PROBED_FRAMES = 24
_FARTHEST_M = 0.10


def rows_of(names: tuple[str, ...]) -> list[int]:
    """Numbers of joints by their names."""
    return [JOINTS.index(name) for name in names]


@dataclass(frozen=True, eq=False)
class JointPatches:
    """Patches of one surface."""

    rows: tuple[NDArray[np.intp], ...]  # vertices of each joint's patch, in the order of JOINTS
    weights: tuple[Floats, ...]  # adding up to 1 for each joint

    def positions(self, vertices: NDArray[np.floating]) -> Floats:
        """Joints (..., J, 3) of vertices (..., V, 3)."""
        joints = np.empty((*vertices.shape[:-2], len(self.rows), 3))
        for number, (rows, weights) in enumerate(zip(self.rows, self.weights, strict=True)):
            joints[..., number, :] = weights @ vertices[..., rows, :].astype(np.float64)
        return joints


@lru_cache(maxsize=3)
def own_patches(resolution: Resolution) -> JointPatches:
    """Patches of one of our surfaces."""
    body = Body.load(resolution)
    limbs = vertex_limbs(body)
    rows, weights = [], []
    for name in JOINTS:
        side = name[-2:] if name.endswith((".L", ".R")) else ".L"
        patch = _PATCHES[name.replace(".R", ".L")]
        bones = [body.skeleton.index[bone.replace(".L", side)] for bone in patch.bones]
        joint = body.skeleton.heads_m[bones].mean(axis=0)
        allowed = [LIMBS.index(limb.replace(".L", side)) for limb in patch.limbs]
        away = np.linalg.norm(body.vertices_m - joint, axis=1)
        near = np.flatnonzero(np.isin(limbs, allowed) & (away <= patch.radius_m))
        rows.append(near)
        weights.append(_even_weights(body.vertices_m[near], joint))
    return JointPatches(tuple(rows), tuple(weights))


def _even_weights(points_m: Floats, joint_m: Floats) -> Floats:
    """Weights that add up to 1 and give the joint, as near to even ones as possible."""
    count = len(points_m)
    even = np.full(count, 1.0 / count)
    # Least change that meets four equations: the sum, and three coordinates.
    equations = np.vstack([np.ones(count), (points_m - joint_m).T])
    wanted = np.array([1.0, 0.0, 0.0, 0.0]) - equations @ even
    return even + np.asarray(np.linalg.lstsq(equations, wanted, rcond=None)[0])


class CarriedPatches(NamedTuple):
    """Patches that another surface took over."""

    patches: JointPatches
    frame: int  # common frame in which the two surfaces lie closest
    distance_m: float
    """Mean distance of the patches' vertices from those that replace them, there."""


def carry_patches(
    patches: JointPatches, source: NDArray[np.floating], target: NDArray[np.floating]
) -> CarriedPatches:
    """Transfer patches to another surface of the same person in the same motion.

    Source (T, V, 3) and target (T, W, 3) are at the same times. Up to two dozen frames,
    spread evenly, are tried. The middles of the two (of each patch's vertices, of all
    vertices) may differ: a shift of the whole body is taken out first.

    Raises Sd2Error if the surfaces are of different persons, poses or scales: they lie more
    than 10 cm apart even where they are closest.
    """
    from scipy.spatial import cKDTree

    rows = np.concatenate(patches.rows)
    best: tuple[float, int, NDArray[np.intp]] | None = None
    for frame in np.unique(np.linspace(0, len(source) - 1, _PROBED_FRAMES).astype(int)):
        tree = cKDTree(target[frame])
        points = source[frame].astype(np.float64)
        shift = _shift(points, target[frame].astype(np.float64), tree)
        away, nearest = tree.query(points[rows] + shift)
        if best is None or away.mean() < best[0]:
            best = float(away.mean()), int(frame), nearest
    assert best is not None
    distance_m, frame, nearest = best
    if distance_m > _FARTHEST_M:
        raise Sd2Error(
            f"The two surfaces lie {distance_m * 100:.0f} cm apart where they are closest",
            "two meshes of the same person in the same video, in metres",
            "Check the scale (--scale), the times and the axes of the files",
        )
    ends = np.cumsum([len(one) for one in patches.rows])[:-1]
    carried = JointPatches(tuple(np.split(nearest, ends)), patches.weights)
    return CarriedPatches(carried, frame, distance_m)


def _shift(points: Floats, others: Floats, tree: object) -> Floats:
    """Shift of one surface onto the other: boxes first, then nearest vertices three times."""
    shift: Floats = 0.5 * (
        others.min(axis=0) + others.max(axis=0) - points.min(axis=0) - points.max(axis=0)
    )
    sample = points[:: max(len(points) // 1500, 1)]
    for _ in range(3):
        _, nearest = tree.query(sample + shift)  # type: ignore[attr-defined]
        shift = shift + np.median(others[nearest] - sample - shift, axis=0)
    return shift
