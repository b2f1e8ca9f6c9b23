"""Points of a person that all kinds of motion capture give, in one order.

What differs between the sources is where those points lie on the body; that is found for every
person when the body is driven (:func:`sd2core.mocap.driving.puppet_of`).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from sd2core.mocap.driving import Marker
from tools.motion_capture.skeletons import SkeletonMotion

Floats = NDArray[np.float64]

_SIDED = ("ear", "shoulder", "elbow", "wrist", "index", "thumb", "hip", "knee", "ankle")
POINTS = ("nose", *(f"{name}.{side}" for name in (*_SIDED, "foot_index") for side in "LR"))
"""Names of the points; those of :data:`sd2core.body.track.LANDMARKS`."""

_FINE = ("elbow", "wrist", "knee", "ankle")

_SD_M, _HAND_SD_M = 0.012, 0.03
_BESIDE_SD_M, _BESIDE_FINE_SD_M = 0.05, 0.02

MARKERS = tuple(
    Marker(
        name,
        number,
        _HAND_SD_M if name[:5] in ("index", "thumb") else _SD_M,
        _BESIDE_FINE_SD_M if name.split(".")[0] in _FINE else _BESIDE_SD_M,
    )
    for number, name in enumerate(POINTS)
)
"""The points as markers of a body."""

# Name of each point in the kinds of skeletons; {s} is l or r, {S} L or R, {Side} Left or Right.
_NAMES = {
    "shoulder": ("{s}clavicle", "{Side}Arm", "{Side}Shoulder", "{s}Shldr"),
    "elbow": ("{s}humerus", "{Side}ForeArm", "{Side}Elbow", "{s}ForeArm"),
    "wrist": ("{s}radius", "{Side}Hand", "{Side}Wrist", "{s}Hand"),
    "index": ("{s}hand", "{Side}HandIndex1", "{s}hand", "{s}Index1"),
    "thumb": ("{s}thumb", "{S}Thumb_end", "{S}Thumb_end", "{s}Thumb2"),
    "hip": ("{s}hipjoint", "{Side}UpLeg", "{Side}Hip", "{s}Thigh"),
    "knee": ("{s}femur", "{Side}Leg", "{Side}Knee", "{s}Shin"),
    "ankle": ("{s}tibia", "{Side}Foot", "{Side}Ankle", "{s}Foot"),
    "foot_index": ("{s}toes", "{Side}ToeBase_end", "{Side}Toe_end", "{s}Foot_end"),
    "head": ("head", "Head_end", "Head_end", "head"),
    "neck": ("upperneck", "Head", "Head", "neck"),
}
CMU_ASF, HAHNE_BVH, KOYAMA_BVH, POSER_BVH = (
    dict(zip(_NAMES, names, strict=True)) for names in zip(*_NAMES.values(), strict=True)
)

_EAR_M, _NOSE_M = 0.075, 0.12
"""Of the middle of the head: to each ear, and forwards to the nose."""


def points_of(motion: SkeletonMotion, names: Mapping[str, str]) -> Floats:
    """The points (T, 20, 3) of a skeleton in motion, y up; ears and nose by the head's turn."""

    def number(point: str, side: str) -> int:
        name = names[point].format(s=side.lower(), S=side, Side={"L": "Left", "R": "Right"}[side])
        return motion.number(name)

    points_m = np.empty((len(motion.places_m), len(POINTS), 3))
    for row, point in enumerate(POINTS):
        name, _, side = point.partition(".")
        if name not in ("nose", "ear"):
            points_m[:, row] = motion.places_m[:, number(name, side)]
    head, neck = motion.number(names["head"]), motion.number(names["neck"])
    left, ahead = _directions(motion.rest_m, number("hip", "L"), number("hip", "R"), neck)
    middle = 0.5 * (motion.places_m[:, head] + motion.places_m[:, neck])
    for point, shift in (
        ("ear.L", _EAR_M * left),
        ("ear.R", -_EAR_M * left),
        ("nose", _NOSE_M * ahead),
    ):
        points_m[:, POINTS.index(point)] = middle + motion.turns[:, head] @ shift
    return points_m


def _directions(rest_m: Floats, left: int, right: int, neck: int) -> tuple[Floats, Floats]:
    """Unit vectors to the left and ahead of a skeleton at rest."""
    across = rest_m[left] - rest_m[right]
    across = across / np.linalg.norm(across)
    up = rest_m[neck] - 0.5 * (rest_m[left] + rest_m[right])
    up = up - (up @ across) * across
    return across, np.cross(across, up / np.linalg.norm(up))


# -- Markers on the skin ---------------------------------------------------------------------------

_SKIN = {
    "nose": (0, 1),
    "ear.L": (0, 2),
    "ear.R": (1, 3),
    "shoulder.L": (9,),
    "shoulder.R": (16,),
    "elbow.L": (11,),
    "elbow.R": (18,),
    "wrist.L": (13, 14),
    "wrist.R": (20, 21),
    "index.L": (15,),
    "index.R": (22,),
    "thumb.L": (13,),
    "thumb.R": (20,),
    "knee.L": (28,),
    "knee.R": (34,),
    "ankle.L": (30,),
    "ankle.R": (36,),
    "foot_index.L": (32,),
    "foot_index.R": (38,),
}
_PELVIS = (23, 24, 25, 26)  # left and right in front, left and right behind
USED_MARKERS = frozenset(_PELVIS).union(*_SKIN.values())
"""Numbers of the markers of UI-PRMD that the points are made of."""

_HIP_INWARDS, _HIP_DOWN, _HIP_BACK = 0.14, 0.30, 0.22


def points_of_markers(markers_m: Floats) -> Floats:
    """The points (T, 20, 3), y up, of the 39 markers of UI-PRMD (T, 39, 3): x ahead, z up.

    Hip joints lie from the front of the pelvis by shares of its width (Bell, Brand and Pedersen,
    Human Movement Science 8, 1989).
    """
    turned = markers_m[..., [1, 2, 0]]
    points_m = np.empty((len(turned), len(POINTS), 3))
    for point, rows in _SKIN.items():
        points_m[:, POINTS.index(point)] = turned[:, rows].mean(axis=1)
    left, right, behind_left, behind_right = (turned[:, row] for row in _PELVIS)
    width_m = np.linalg.norm(left - right, axis=1, keepdims=True)
    across = (left - right) / width_m
    back = 0.5 * (behind_left + behind_right) - 0.5 * (left + right)
    back = back - (back * across).sum(axis=1, keepdims=True) * across
    back = back / np.linalg.norm(back, axis=1, keepdims=True)
    down = np.cross(across, back)
    for side, front, inwards in (("L", left, -across), ("R", right, across)):
        shift = _HIP_INWARDS * inwards + _HIP_DOWN * down + _HIP_BACK * back
        points_m[:, POINTS.index(f"hip.{side}")] = front + width_m * shift
    return points_m
