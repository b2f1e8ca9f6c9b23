"""Parts of the body that the vertices of a mesh belong to, and the joints between them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error

PARTS: tuple[str, ...] = (
    "trunk",
    "upper_arm.L",
    "upper_arm.R",
    "forearm.L",
    "forearm.R",
    "thigh.L",
    "thigh.R",
    "lower_leg.L",
    "lower_leg.R",
)
"""Parts of the body in the order of limb maps; L and R are the person's own sides. The trunk has
the head, forearms have the hands, lower legs the feet."""

JOINTS: tuple[str, ...] = (
    "trunk",
    "head",
    *(
        f"{joint}.{side}"
        for side in "LR"
        for joint in ("shoulder", "elbow", "hand", "hip", "knee", "foot")
    ),
)
"""Joints and ends in the order of kinematics; L and R are the person's own sides."""

WHOLE = "body"
"""The one part of somebody whose parts are not known."""

KINEMATICS = "kinematics"
"""Input that a denoiser may take: how joints move, and how much is seen of each part."""

QUANTITIES: tuple[str, ...] = (
    "towards_mps",
    "speed_mps",
    "nearer_m",
    "aside_m",
    "above_m",
    "sigma_mps",
)
"""Of every joint: velocity towards the sensor and speed; place about the middle of the trunk,
towards the sensor, to the right as it sees them, and up; standard deviation of the first, 0 where
none is known."""


def mirrored_columns() -> tuple[NDArray[np.intp], NDArray[np.float32]]:
    """Order and signs of the columns of kinematics after left and right were exchanged.

    Columns are the quantities of each joint, and then one for each of :data:`PARTS`.
    """
    columns = np.arange(len(JOINTS) * len(QUANTITIES)).reshape(len(JOINTS), -1)
    joints = [JOINTS.index(other_side(name)) for name in JOINTS]
    parts = [columns.size + PARTS.index(other_side(name)) for name in PARTS]
    signs = np.ones(columns.size + len(PARTS), np.float32)
    signs[columns[:, QUANTITIES.index("aside_m")]] = -1.0
    return np.array([*columns[joints].ravel(), *parts], np.intp), signs


def other_side(name: str) -> str:
    """Name of a part, joint or landmark on the other side: ``knee.L`` of ``knee.R``."""
    base, dot, side = name.partition(".")
    return base + dot + {"L": "R", "R": "L", "": ""}[side]


@dataclass(frozen=True, eq=False)
class VertexParts:
    """Part of the body of every vertex."""

    names: tuple[str, ...]
    numbers: NDArray[np.uint8]  # (V,), into names
    others: tuple[VertexParts, ...] = ()  # of the other bodies of a scene

    def __post_init__(self) -> None:
        numbers = np.ascontiguousarray(self.numbers, np.uint8)
        most = int(numbers.max(initial=0))
        if numbers.ndim != 1 or most >= len(self.names):
            raise Sd2Error(
                f"Parts of shape {numbers.shape}, numbers up to {most}",
                f"one number per vertex, below {len(self.names)}",
            )
        object.__setattr__(self, "numbers", numbers)
