"""Reading of skeletons in motion: ASF with AMC, and BVH.

Formats: "Acclaim" (ASF/AMC) as mocap.cs.cmu.edu writes them, and Biovision's BVH. Both give a tree
of bones at rest and, for every frame, the place of the root and the angles of the joints.
"""

from __future__ import annotations

import gzip
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
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
