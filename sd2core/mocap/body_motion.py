"""Motion of real people on bodies of ours: kept in files, posed on any shape."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from sd2core.body.initial import Pose
from sd2core.body.model import Skeleton
from sd2core.body.rotations import Floats, from_vector
from sd2core.body.shape import BodyShape
from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_write
from sd2core.files.numpy_files import open_npz_file

Role = Literal["learn", "calibrate", "measure"]
"""What a person's motions are used for."""

RATE_HZ = 30.0

_LEG = ("upperleg01.L", "lowerleg01.L", "foot.L")
_EXPECTED = "an .npz that `python -m tools.motion_capture drive` made"


@dataclass(frozen=True, eq=False)
class BodyMotion:
    """One trial as rotations of our joints; the world has y down, the floor at 0, and 30 Hz."""

    trial: str
    person: str
    role: Role
    shape: BodyShape  # of the person
    vectors: Floats  # (T, J, 3) rotation vectors of the joints of sd2core.body.rig.JOINTS
    translation_m: Floats  # (T, 3)
    residual_m: float  # mean distance of the body's points from the recorded ones

    def __len__(self) -> int:
        return len(self.vectors)

    def pose_on(self, skeleton: Skeleton, own: Skeleton, frames: slice) -> Pose:
        """Pose of some frames on another skeleton, with steps as long as its legs.

        ``own`` is the skeleton of the person's shape.
        """
        scale = skeleton.length_m(*_LEG) / own.length_m(*_LEG)
        place_m = scale * (own.heads_m[0] + self.translation_m[frames]) - skeleton.heads_m[0]
        return Pose(from_vector(self.vectors[frames]), place_m)

    def save(self, path: Path) -> None:
        """Write one ``.npz``, whole or not at all."""
        arrays: dict[str, Any] = vars(self) | {
            "shape": np.append(self.shape.coefficients, self.shape.stature_m),
            "vectors": self.vectors.astype(np.float32),
            "translation_m": self.translation_m.astype(np.float32),
        }
        with atomic_write(path) as stream:
            np.savez_compressed(stream, **arrays)

    @classmethod
    def load(cls, path: Path) -> BodyMotion:
        """Read what :meth:`save` wrote."""
        with open_npz_file(path, "a body's motion", _EXPECTED) as data:
            arrays = dict(data)
        try:
            known: dict[str, Any] = {
                name: value.astype(np.float64) if value.ndim else value.item()
                for name, value in arrays.items()
            }
            shape = known.pop("shape")
            known.pop("what", None)  # a description, in files of before
            return cls(shape=BodyShape(shape[:-1], float(shape[-1])), **known)
        except (KeyError, TypeError, ValueError) as error:
            raise Sd2Error(f"{path} holds no body's motion ({error})", _EXPECTED) from error


def load_motions(folder: Path, role: Role) -> list[BodyMotion]:
    """All motions of a folder that are for one use, by name; Sd2Error if a file holds none."""
    motions = [BodyMotion.load(path) for path in sorted(folder.glob("*.npz"))]
    return [motion for motion in motions if motion.role == role]
