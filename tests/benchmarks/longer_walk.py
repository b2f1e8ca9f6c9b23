"""A quarter of a minute of a real person: the walk, there and back."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sd2core.mesh.sequence import MeshSequence
from sd2core.timebase import Timebase

FRAMES = 450
LAST = 88
POSES = np.abs((np.arange(FRAMES) + LAST) % (2 * LAST) - LAST)
"""Frame of the recorded walk that each frame shows."""


def longer_walk(shared_data: Path) -> MeshSequence:
    """The walk as often as makes :data:`FRAMES`."""
    with np.load(shared_data / "mesh" / "walk.npz") as data:
        vertices, faces = data["vertices"], data["faces"]
    return MeshSequence(vertices[POSES], faces, Timebase.regular(FRAMES, 30.0), "walk")
