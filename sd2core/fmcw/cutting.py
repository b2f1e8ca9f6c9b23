"""Facets cut finer: those of the reference, and those of things, which are large."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sd2core.mesh.things import Surroundings

_MAX_CUTS = 6
_MAX_PIECES = 100_000
"""Some 50 MB; what is larger is cut less finely, and echoes as strongly."""


def subdivided(corners: NDArray[np.float64], cuts: int) -> NDArray[np.float64]:
    """Triangles (n, 3 corners, 3) with all edges halved some times, (n 4^cuts, 3, 3)."""
    for _ in range(cuts):
        a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
        ab, bc, ca = 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)
        parts = ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))
        corners = np.concatenate([np.stack(part, axis=1) for part in parts])
    return corners


def pieces_of(surroundings: Surroundings, longest_m: float) -> NDArray[np.float64]:
    """Triangles (n, 3 corners, 3) of the surfaces of things, cut to edges of about this length."""
    corners = surroundings.vertices_m[surroundings.faces]
    edges_m = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    cuts = np.ceil(np.log2(np.maximum(edges_m / longest_m, 1.0))).clip(max=_MAX_CUTS).astype(int)
    while (4**cuts).sum() > _MAX_PIECES and cuts.any():
        cuts = np.maximum(cuts - 1, 0)
    return np.concatenate([subdivided(corners[cuts == one], one) for one in np.unique(cuts)])
