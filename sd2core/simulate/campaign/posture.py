"""Posture of a body as the few vectors in which fits err, and bodies in a changed posture.

Three turns (pelvis, chest, head) and fourteen directions (shoulder, upper arm, forearm and
hand; thigh, shank and foot; left and right), all in the axes of the line of sight to
the pelvis. A fit from video errs in these much more along the line of sight than across
it, and every limb about its own joint, which is why they and not the joints' angles are
compared.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from sd2core.body.model import Skeleton
from sd2core.body.rotations import Floats, applied, from_vector, product, transposed

Group = Literal["place", "trunk", "arm", "leg"]

TRUNK = ("root", "spine01", "head")
"""Bones whose turns are compared: pelvis, chest, head."""

LIMBS: dict[Group, tuple[tuple[str, str], ...]] = {
    "arm": (
        ("clavicle", "upperarm01"),
        ("upperarm01", "lowerarm01"),
        ("lowerarm01", "wrist"),
        ("wrist", "finger3-3"),
    ),
    "leg": (("upperleg01", "lowerleg01"), ("lowerleg01", "foot"), ("foot", "toe3-3")),
}
"""From the head of one bone to that of another, without their sides."""

_BETWEEN = (
    ("root", "spine01", ("spine05", "spine04", "spine03", "spine02")),
    ("spine01", "head", ("neck01", "neck02", "neck03")),
)
_MIRRORED_VECTOR = np.array([-1.0, 1.0, 1.0])
_TURNED_MIN = 1e-9


@dataclass(frozen=True, eq=False)
class Posture:
    """Posture of one body in every frame."""

    # Rows, (T, 3, 3): to the right, down and along the line of sight, in the camera frame.
    axes: Floats
    place_m: Floats  # Pelvis, (T, 3), in those axes (so along the last but for rounding).
    trunk: Floats  # Turns of :data:`TRUNK` against rest, (T, 3, 3, 3), in the camera frame.
    # Unit directions in the axes of the line of sight, (T, n, 3). Those of the left side are
    # mirrored, so that both sides can be told together.
    limbs: Mapping[tuple[Group, str], Floats]

    def features(self, group: Group, side: str = "") -> Floats:
        """Features of the pose on which the errors of one group depend, (T, n)."""
        frames = len(self.axes)
        if group == "place":
            return self.place_m
        if group == "trunk":
            # Where pelvis and chest face, and which way is up for the chest.
            held = np.stack(
                [-self.trunk[:, 0, :, 2], -self.trunk[:, 1, :, 2], self.trunk[:, 1, :, 1]], axis=1
            )
            return applied(self.axes[:, None], held).reshape(frames, -1)
        # Upper arm and forearm, or thigh and shank: the rest hardly tells of the pose.
        first = 1 if group == "arm" else 0
        return self.limbs[group, side][:, first : first + 2].reshape(frames, -1)


def posture(skeleton: Skeleton, transforms: Floats, axes: Floats | None = None) -> Posture:
    """Read a body's posture.

    ``transforms``, (T, B, 3, 4), come from :meth:`~sd2core.body.model.Skeleton.transforms`, in the
    camera frame; ``axes``, (T, 3, 3), replace the line of sight to this body's own pelvis.
    """
    heads = applied(transforms[..., :3], skeleton.heads_m) + transforms[..., 3]  # (T, B, 3)
    index = skeleton.index
    root = heads[:, index["root"]]
    axes = sight_axes(root) if axes is None else axes
    limbs = {}
    for group, parts in LIMBS.items():
        for side in "LR":
            ends = [
                heads[:, index[f"{end}.{side}"]] - heads[:, index[f"{start}.{side}"]]
                for start, end in parts
            ]
            seen = applied(axes[:, None], np.stack(ends, axis=1))
            seen /= np.linalg.norm(seen, axis=2, keepdims=True)
            limbs[group, side] = seen * _MIRRORED_VECTOR if side == "L" else seen
    turns = transforms[:, [index[bone] for bone in TRUNK], :, :3]
    return Posture(axes, applied(axes, root), turns, limbs)


def sight_axes(target_m: Floats) -> Floats:
    """Axes of lines of sight from the origin, (T, 3, 3): right, down, along, in rows."""
    along = target_m / np.linalg.norm(target_m, axis=1, keepdims=True)
    down = np.array([0.0, 1.0, 0.0]) - along[:, 1:2] * along
    down /= np.linalg.norm(down, axis=1, keepdims=True)
    return np.stack([np.cross(down, along), down, along], axis=1)


def change_posture(
    skeleton: Skeleton,
    transforms: Floats,
    true: Posture,
    change: Mapping[tuple[Group, str], Floats],
) -> Floats:
    """Transforms of a body in another posture, (T, B, 3, 4).

    Parameters
    ----------
    skeleton : Skeleton
        Of the result; it may be of another shape than the one that the posture was read from.
    transforms : float64 array, shape (T, B, 3, 4)
        Of the body in the true posture.
    true : Posture
    change : mapping of (group, side) to float64 array, shape (T, n)
        Metres along the axes of the line of sight for the place, rotation vectors in them for the
        trunk, differences of directions for limbs; ``place`` and ``trunk`` have the side "".
    """
    frames = len(transforms)
    back = transposed(true.axes)  # from the axes of the line of sight to the camera's
    turned = applied(back[:, None], change["trunk", ""].reshape(frames, 3, 3))
    extra = _trunk_turns(skeleton, turned)
    for group, parts in LIMBS.items():
        for side in "LR":
            _limb_turns(skeleton, extra, true, change[group, side], group, parts, side)
    held = np.empty((frames, len(skeleton), 3, 4))
    held_turns, inherited = held[..., :3], [0] * len(skeleton)
    for bone, parent in enumerate(skeleton.parents):
        inherited[bone] = bone if bone in extra else inherited[parent]
        held_turns[:, bone] = product(extra[inherited[bone]], transforms[:, bone, :, :3])
        head = skeleton.heads_m[bone]
        if parent < 0:
            moved = applied(back, true.place_m + change["place", ""])
        else:
            above = held[:, parent]
            moved = applied(above[..., :3], head) + above[..., 3]
        held[:, bone, :, 3] = moved - applied(held_turns[:, bone], head)
    return held


def _trunk_turns(skeleton: Skeleton, turned: Floats) -> dict[int, Floats]:
    """Extra turns of the bones of the trunk; those between two take their share."""
    index = skeleton.index
    vectors = {index[bone]: turned[:, number] for number, bone in enumerate(TRUNK)}
    for first, last, between in _BETWEEN:
        for number, bone in enumerate(between, start=1):
            share = number / (len(between) + 1.0)
            low, high = vectors[index[first]], vectors[index[last]]
            vectors[index[bone]] = low + share * (high - low)
    return {bone: from_vector(vector) for bone, vector in vectors.items()}


def _limb_turns(
    skeleton: Skeleton,
    extra: dict[int, Floats],
    true: Posture,
    change: Floats,
    group: Group,
    parts: Sequence[tuple[str, str]],
    side: str,
) -> None:
    """Extra turns of one limb's bones: the least that bring each to its new direction."""
    directions = true.limbs[group, side]
    wanted = directions + change.reshape(directions.shape)
    wanted /= np.maximum(np.linalg.norm(wanted, axis=2, keepdims=True), _TURNED_MIN)
    if side == "L":
        directions, wanted = directions * _MIRRORED_VECTOR, wanted * _MIRRORED_VECTOR
    back = transposed(true.axes)[:, None]
    turns = least_turn(applied(back, directions), applied(back, wanted))  # (T, n, 3, 3)
    for number, (start, _) in enumerate(parts):
        extra[skeleton.index[f"{start}.{side}"]] = turns[:, number]


def least_turn(before: Floats, after: Floats) -> Floats:
    """Smallest rotations (..., 3, 3) that bring unit vectors (..., 3) onto others."""
    axis = np.cross(before, after)
    sine = np.linalg.norm(axis, axis=-1, keepdims=True)
    cosine = (before * after).sum(axis=-1, keepdims=True)
    angle = np.arctan2(sine, cosine)
    return from_vector(axis * (angle / np.maximum(sine, _TURNED_MIN)))


def all_groups() -> list[tuple[Group, str]]:
    """Every group with its side: the keys of what :func:`change_posture` takes."""
    return [("place", ""), ("trunk", ""), *((group, side) for group in LIMBS for side in "LR")]
