"""Model files in the layout of SMPL, made here: a row of boxes that turn about their joints."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

SHAPES = 4
BOX_M = np.array([[x, y, z] for x in (0.0, 0.1) for y in (-0.05, 0.05) for z in (-0.05, 0.05)])
BOX_FACES = np.array(
    [
        *([0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1]),
        *([2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]),
    ]
)


def model_arrays(joints: int = 24, corrected: bool = False) -> dict[str, Any]:
    """Joint j lies at x = 0.1 j and carries the box beside it; its parent is the joint before.

    Shape 0 makes everything larger by its coefficient, shape 1 moves all up; the others are noise.
    With corrections, each of the numbers of the pose moves all vertices at random.
    """
    noise = np.random.default_rng(joints)
    vertices = np.concatenate([BOX_M + np.array([0.1 * j, 0.0, 0.0]) for j in range(joints)])
    shapes = noise.normal(size=(len(vertices), 3, SHAPES)) * 0.01
    shapes[..., 0], shapes[..., 1] = vertices, [0.0, 1.0, 0.0]
    corrections = noise.normal(size=(len(vertices), 3, 9 * (joints - 1))) * 0.001
    regressor = np.zeros((joints, len(vertices)))
    weights = np.zeros((len(vertices), joints))
    for joint in range(joints):
        regressor[joint, 8 * joint : 8 * joint + 4] = 0.25  # the side at its x
        weights[8 * joint : 8 * joint + 8, joint] = 1.0
    parents = np.arange(-1, joints - 1)
    return {
        "v_template": vertices,
        "shapedirs": shapes,
        "posedirs": corrections * corrected,
        "J_regressor": regressor,
        "kintree_table": np.stack([parents, np.arange(joints)]).astype(np.uint32),
        "weights": weights,
        "f": np.concatenate([BOX_FACES + 8 * joint for joint in range(joints)]).astype(np.uint32),
    }


def write_model(path: Path, joints: int = 24, corrected: bool = False) -> Path:
    """Write such a model as an ``.npz``."""
    np.savez(path, **model_arrays(joints, corrected))
    return path


def turned_from(joint: int, turn: NDArray[np.float64], joints: int = 24) -> NDArray[np.float64]:
    """Vertices at rest, those from a joint on turned about it: what posing it alone must give."""
    vertices = model_arrays(joints)["v_template"].copy()
    pivot = np.array([0.1 * joint, 0.0, 0.0])
    vertices[8 * joint :] = (vertices[8 * joint :] - pivot) @ turn.T + pivot
    return np.asarray(vertices)
