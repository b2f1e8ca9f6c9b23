"""From what limbs do to rotations of bones: two-bone limbs brought to places in closed form."""

from __future__ import annotations

import numpy as np

from sd2core.body.model import Skeleton
from sd2core.body.rotations import Floats, about, applied, product, transposed
from sd2core.simulate.gestures import bend

_KNEES_REACH = 0.995


def turn_about(axis: int, angle_deg: Floats) -> Floats:
    """Rotations about x (0), y (1) or z (2), (T, 3, 3)."""
    return about(np.eye(3)[axis], angle_deg)


def place_limb(
    skeleton: Skeleton,
    rotations: Floats,
    bones: tuple[str, str, str],
    root: Floats,
    target_m: Floats,
    pole: Floats,
) -> Floats:
    """Bring the end of a limb of two bones to a place.

    ``bones`` are thigh, shank, foot; or upper arm, forearm, wrist. The first two are written in
    ``rotations``, (T, B, 3, 3). ``root``, (T, 3, 4), is the transform of the parent of the limb;
    ``target_m``, (T, 3), is brought nearer where it is out of reach; ``pole``, (T, 3), is where the
    joint bends to. Returns the turn of the second bone against rest, (T, 3, 3), in the axes of
    ``target_m``.
    """
    first, second, end = (skeleton.index[bone] for bone in bones)
    heads = skeleton.heads_m
    upper_rest, lower_rest = heads[second] - heads[first], heads[end] - heads[second]
    upper, lower = float(np.linalg.norm(upper_rest)), float(np.linalg.norm(lower_rest))
    start = applied(root[..., :3], heads[first]) + root[..., 3]
    line = target_m - start
    far = np.linalg.norm(line, axis=1, keepdims=True)
    reach = np.clip(far, 1.05 * abs(upper - lower) + 0.02, _KNEES_REACH * (upper + lower))
    target = start + line * (reach / far)
    upper_turn, lower_turn = bend(start, target, upper_rest, lower_rest, pole)
    rotations[:, first] = product(transposed(root[..., :3]), upper_turn)
    # The thigh's two bones turn as one: what lies between them is the identity.
    rotations[:, second] = product(transposed(upper_turn), lower_turn)
    return lower_turn


def turn_hand(
    skeleton: Skeleton, rotations: Floats, side: str, angles_deg: Floats, curl: Floats
) -> None:
    """Turn, bend and close one hand.

    The rotations of forearm, wrist and fingers are written. ``angles_deg``, (T, 3): pronation,
    flexion, deviation. ``curl``, (T, 2): of fingers and thumb, 0 open to 1 closed.
    """
    index, heads = skeleton.index, skeleton.heads_m
    across = 1.0 if side == "R" else -1.0
    forearm, wrist = index[f"lowerarm02.{side}"], index[f"wrist.{side}"]
    along = _unit(heads[wrist] - heads[forearm])
    knuckles = across * _unit(heads[index[f"finger5-1.{side}"]] - heads[index[f"finger2-1.{side}"]])
    half = about(along, -across * 0.5 * angles_deg[:, 0])
    rotations[:, forearm] = half
    palm = _unit(np.cross(along, knuckles))
    bend = product(about(knuckles, angles_deg[:, 1]), about(palm, angles_deg[:, 2]))
    rotations[:, wrist] = product(half, bend)
    curl = np.clip(curl, 0.0, 1.0)
    for finger in range(1, 6):
        amount = curl[:, 0] if finger > 1 else 0.5 * curl[:, 1]
        for joint, most_deg in ((1, 70.0), (2, 85.0), (3, 55.0)):
            bone = index.get(f"finger{finger}-{joint}.{side}")
            if bone is not None:
                rotations[:, bone] = about(knuckles, 4.0 + most_deg * amount)


def _unit(vector: Floats) -> Floats:
    return np.asarray(vector / np.linalg.norm(vector))
