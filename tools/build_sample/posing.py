"""A body posed to the same bits on every machine, which the sample's reproducibility rests on."""

from __future__ import annotations

import numpy as np

from sd2core.body.model import Body
from sd2core.body.rotations import Floats, applied


def posed(body: Body, rotations: Floats, translation_m: Floats | None = None) -> Floats:
    """Vertices (T, V, 3) by linear blend skinning; arguments of ``Skeleton.transforms``."""
    transforms = body.skeleton.transforms(rotations, translation_m)  # (T, B, 3, 4)
    slots = []
    for slot in range(body.weights.shape[1]):
        rows = np.flatnonzero(body.weights[:, slot])
        slots.append((rows, body.bones[rows, slot], body.weights[rows, slot, None, None]))
    vertices = np.empty((len(transforms), len(body.vertices_m), 3))
    for frame, bones in enumerate(transforms):
        blend = np.zeros((len(body.vertices_m), 3, 4))
        # Slot after slot instead of a matrix product: the same sum in the same order.
        for rows, numbers, weights in slots:
            blend[rows] += weights * bones[numbers]
        vertices[frame] = applied(blend[..., :3], body.vertices_m) + blend[..., 3]
    return vertices
