"""Reading of skeletons in motion: ASF with AMC, and BVH.

Formats: "Acclaim" (ASF/AMC) as mocap.cs.cmu.edu writes them, and Biovision's BVH. Both give a tree
of bones at rest and, for every frame, the place of the root and the angles of the joints.

Points of a person that all kinds of motion capture give are in one order. What differs between the
sources is where those points lie on the body; that is found for every person when the body is
driven (:func:`sd2core.mocap.driving.puppet_of`).
"""

from __future__ import annotations

import gzip
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.mocap.driving import Marker
from sd2core.simulate.limbs import turn_about

Floats = NDArray[np.float64]

_INCH_M = 0.0254
_AXES = "XYZ"


@dataclass(frozen=True, eq=False)
class SkeletonMotion:
    """A skeleton's points through time, y up, in metres.

    Of ASF bones the point is the far end, of BVH joints the joint itself; ``turns`` is the turn of
    that bone, or of what the joint carries, against the skeleton at rest.
    """

    names: tuple[str, ...]
    places_m: Floats  # (T, J, 3)
    turns: Floats  # (T, J, 3, 3)
    rest_m: Floats  # (J, 3)

    def at(self, name: str) -> Floats:
        """Places of one point, (T, 3); Sd2Error if the skeleton has none of this name."""
        return self.places_m[:, self.number(name)]

    def number(self, name: str) -> int:
        """Number of a point; Sd2Error if there is none of this name."""
        if name not in self.names:
            raise Sd2Error(f"The skeleton has no {name!r}", f"one of {', '.join(self.names)}")
        return self.names.index(name)


@dataclass(frozen=True, eq=False)
class _Bone:
    name: str
    parent: int  # -1: the root
    offset: Floats  # (3,) from the parent's point, at rest
    axes: Floats  # (3, 3) of its own angles
    channels: tuple[str, ...]  # such as TX or RZ, in the order of the numbers


def read_amc(path: Path, skeleton: Path) -> SkeletonMotion:
    """Motion of an AMC file on the skeleton of an ASF file."""
    bones, scale_m = _read_asf(skeleton)
    numbers: dict[str, list[list[float]]] = {bone.name: [] for bone in bones}
    for line in _lines(path):
        name, *values = line.split()
        if name in numbers:
            numbers[name].append([float(value) for value in values])
    moving = [bone for bone in bones if bone.channels]
    frames = min(len(numbers[bone.name]) for bone in moving)
    if not frames:
        raise Sd2Error(f"{path} holds no frame", f"numbers for the bones of {skeleton}")
    columns = [np.array(numbers[bone.name][:frames]) for bone in moving]
    return _moved(bones, np.concatenate(columns, axis=1), scale_m, acclaim=True)


def read_bvh(path: Path, unit_m: float) -> tuple[SkeletonMotion, float]:
    """Motion of a BVH file whose lengths are in units of ``unit_m``, and its frames per second."""
    text = "\n".join(_lines(path))
    hierarchy, keyword, motion = text.partition("MOTION")
    timing = re.search(r"Frame Time:\s*([\d.eE+-]+)", motion)
    if not keyword or timing is None:
        raise Sd2Error(f"{path} has no motion", "a BVH file with `MOTION` and `Frame Time:`")
    bones = _bvh_bones(hierarchy)
    values = np.array(motion[timing.end() :].split(), float)
    width = sum(len(bone.channels) for bone in bones)
    values = values[: len(values) // width * width].reshape(-1, width)
    return _moved(bones, values, unit_m, acclaim=False), 1.0 / float(timing.group(1))


def _lines(path: Path) -> list[str]:
    """Lines of a text file, perhaps compressed, without comments and empty ones."""
    try:
        raw = path.read_bytes()
        text = (gzip.decompress(raw) if path.suffix == ".gz" else raw).decode("utf-8", "replace")
    except (OSError, EOFError) as error:
        raise Sd2Error(
            f"{path} cannot be read ({error})", "a text file, perhaps with gzip"
        ) from error
    return [line.strip() for line in text.splitlines() if line.strip() and line[0] not in "#"]


def _read_asf(path: Path) -> tuple[list[_Bone], float]:
    """Bones of an ASF file, parents first, and its unit in metres."""
    section, length = "", 1.0
    own: dict[str, dict[str, list[str]]] = {"root": {}}
    parent: dict[str, str] = {}
    current = "root"
    for line in _lines(path):
        word, *rest = line.split()
        if word.startswith(":"):
            section = word
        elif section == ":units" and word == "length":
            length = float(rest[0])
        elif section == ":root":
            own["root"][word] = rest
        elif section == ":bonedata":
            if word == "name":
                current = rest[0]
                own[current] = {}
            own.setdefault(current, {})[word] = rest
        elif section == ":hierarchy" and word not in ("begin", "end"):
            parent |= dict.fromkeys(rest, word)
    order = ["root"]
    for name in order:  # grows: parents before children
        order += [child for child, above in parent.items() if above == name]
    bones = []
    for name in order:
        fields = own[name]
        axes = fields.get("axis", ["0", "0", "0", "XYZ"])
        channels = fields["order"] if name == "root" else fields.get("dof", [])
        angles = fields.get("orientation", ["0", "0", "0"]) if name == "root" else axes[:3]
        direction = np.array(fields.get("direction", ["0", "0", "0"]), float)
        bones.append(
            _Bone(
                name,
                order.index(parent[name]) if name in parent else -1,
                float(fields.get("length", ["0"])[0]) * direction,
                _axes([float(angle) for angle in angles], (axes[3:] or ["XYZ"])[0]),
                tuple(channel.upper() for channel in channels),
            )
        )
    return bones, _INCH_M / length


def _bvh_bones(hierarchy: str) -> list[_Bone]:
    bones: list[_Bone] = []
    above: list[int] = []
    name = ""
    offset = np.zeros(3)
    for line in hierarchy.splitlines():
        word, *rest = line.split()
        if word in ("ROOT", "JOINT", "End"):
            name = rest[0] if word != "End" else f"{bones[above[-1]].name}_end"
        elif word == "OFFSET":
            offset = np.array(rest[:3], float)
            parent = above[-2] if len(above) > 1 else -1
            bones.append(_Bone(name, parent, offset, np.eye(3), ()))
        elif word == "CHANNELS":
            kinds = {"p": "T", "r": "R"}
            channels = tuple(kinds[channel[1]] + channel[0] for channel in rest[1:])
            bones[-1] = _Bone(name, bones[-1].parent, offset, np.eye(3), channels)
        elif word == "{":
            above.append(len(bones))
        elif word == "}":
            above.pop()
    return bones


def _axes(angles_deg: list[float], order: str) -> Floats:
    """Turn by angles about fixed axes, one after the other."""
    turn = np.eye(3)
    for axis in order.upper():
        number = _AXES.index(axis)
        turn = turn_about(number, np.array([angles_deg[number]]))[0] @ turn
    return turn


def _moved(bones: list[_Bone], values: Floats, unit_m: float, *, acclaim: bool) -> SkeletonMotion:
    """Points of the bones, by their channels' numbers (T, C).

    In ASF a bone's own turn moves its point, and its first angle is turned first; in BVH it moves
    only what hangs on it, and the last angle is turned first.
    """
    frames, count = len(values), len(bones)
    places, turns = np.zeros((frames, count, 3)), np.empty((frames, count, 3, 3))
    rest = np.zeros((count, 3))
    column = 0
    for number, bone in enumerate(bones):
        turn, shift = np.tile(np.eye(3), (frames, 1, 1)), np.zeros((frames, 3))
        for channel in bone.channels:
            axis, numbers = _AXES.index(channel[1]), values[:, column]
            column += 1
            if channel[0] == "T":
                shift[:, axis] = numbers
            elif acclaim:
                turn = turn_about(axis, numbers) @ turn
            else:
                turn = turn @ turn_about(axis, numbers)
        turn = bone.axes @ turn @ bone.axes.T
        if bone.parent < 0:
            turns[:, number], places[:, number] = turn, shift
            continue
        above = turns[:, bone.parent]
        turns[:, number] = above @ turn
        carrier = turns[:, number] if acclaim else above
        places[:, number] = places[:, bone.parent] + carrier @ bone.offset
        rest[number] = rest[bone.parent] + bone.offset
    names = tuple(bone.name for bone in bones)
    return SkeletonMotion(names, unit_m * places, turns, unit_m * rest)


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
