"""Limbs: parts of a body that move as one, between its landmarks and its bones."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from sd2core.body.model import Body, Skeleton
from sd2core.errors import Sd2Error

LIMBS: tuple[str, ...] = (
    "head",
    "torso",
    "upper_arm.L",
    "upper_arm.R",
    "forearm.L",
    "forearm.R",
    "hand.L",
    "hand.R",
    "thigh.L",
    "thigh.R",
    "shank.L",
    "shank.R",
    "foot.L",
    "foot.R",
)
"""The limbs in the order in which arrays number them; L and R are the person's own sides."""

_HEAD = (
    "nose",
    *(f"{eye}.{side}" for side in "LR" for eye in ("eye_inner", "eye", "eye_outer")),
    *(f"{part}.{side}" for part in ("ear", "mouth") for side in "LR"),
)
_OF_A_SIDE = {
    "upper_arm": ("shoulder", "elbow"),
    "forearm": ("elbow", "wrist"),
    "hand": ("wrist", "pinky", "index", "thumb"),
    "thigh": ("hip", "knee"),
    "shank": ("knee", "ankle"),
    "foot": ("ankle", "heel", "foot_index"),
}

LIMB_LANDMARKS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "head": _HEAD,
        "torso": ("shoulder.L", "shoulder.R", "hip.L", "hip.R"),
    }
    | {
        f"{limb}.{side}": tuple(f"{landmark}.{side}" for landmark in landmarks)
        for limb, landmarks in _OF_A_SIDE.items()
        for side in "LR"
    }
)
"""Landmarks on every limb; one on a joint lies on both limbs that meet there."""

# Beginnings of the names of the bones that carry a limb, without their side.
_BONES = {
    "head": ("neck", "head", "eye"),
    "torso": ("root", "pelvis", "spine", "clavicle", "shoulder"),
    "upper_arm": ("upperarm",),
    "forearm": ("lowerarm",),
    "hand": ("wrist", "finger", "metacarpal"),
    "thigh": ("upperleg",),
    "shank": ("lowerleg",),
    "foot": ("foot", "toe"),
}


def bone_limbs(skeleton: Skeleton) -> NDArray[np.uint8]:
    """Limb (number in :data:`LIMBS`) of every bone, (B,).

    The neck counts to the head, the shoulder girdle and the pelvis to the torso. Raises Sd2Error
    if a bone is none of the bundled skeleton's.
    """
    return np.array([_limb_of(name) for name in skeleton.names], dtype=np.uint8)


def _limb_of(bone: str) -> int:
    side = bone[-2:] if bone.endswith((".L", ".R")) else ""
    for limb, beginnings in _BONES.items():
        if bone.startswith(beginnings):
            return LIMBS.index(limb if limb in LIMBS else limb + side)
    raise Sd2Error(
        f"The skeleton has a bone {bone!r}, which belongs to no limb",
        "the bones of the bundled body",
    )


def vertex_limbs(body: Body) -> NDArray[np.uint8]:
    """Limb (number in :data:`LIMBS`) with the most weight at every vertex, (V,)."""
    limbs = bone_limbs(body.skeleton)[body.bones]  # (V, 8)
    shares = np.zeros((len(body.vertices_m), len(LIMBS)))
    rows = np.arange(len(shares))
    for slot in range(limbs.shape[1]):
        shares[rows, limbs[:, slot]] += body.weights[:, slot]
    return shares.argmax(axis=1).astype(np.uint8)
