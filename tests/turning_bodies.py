"""The bundled body, turning about its upright axis."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from sd2core.body.model import Body
from sd2core.mesh.sequence import MeshSequence
from sd2core.timebase import Timebase


def turning_body(frames: int) -> MeshSequence:
    """A mesh 2 m ahead that turns by 1 rad from the first to the last frame, at 30 frames/s."""
    body = Body.load("low")
    turns = Rotation.from_rotvec(np.outer(np.linspace(0.0, 1.0, frames), [0.0, 1.0, 0.0]))
    vertices = np.einsum("tij,vj->tvi", turns.as_matrix(), body.vertices_m)
    vertices[..., 2] += 2.0
    return MeshSequence(vertices.astype(np.float32), body.faces, Timebase.regular(frames, 30.0))
