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

    Parameters
    ----------
    rotations : array, shape (T, B, 3, 3)
        The first two bones' are written.
    bones : tuple of str
        Thigh, shank, foot; or upper arm, forearm, wrist.
    root : array, shape (T, 3, 4)
        Transform of what the limb hangs on.
    target_m : array, shape (T, 3)
        Brought nearer where it is out of reach.
    pole : array, shape (T, 3)
        Where the joint bends to.

    Returns
    -------
    float64 array, shape (T, 3, 3)
        Turn of the second bone against rest, in the axes of ``target_m``.
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

    Parameters
    ----------
    rotations : array, shape (T, B, 3, 3)
        Of forearm, wrist and fingers, written.
    side : {"L", "R"}
    angles_deg : array, shape (T, 3)
        Pronation, flexion, deviation.
    curl : array, shape (T, 2)
        Of fingers and thumb, 0 open to 1 closed.
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
