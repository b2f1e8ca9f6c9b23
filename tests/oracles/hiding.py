"""What a surface hides in NumPy, as :mod:`sd2core.scattering.behind_things` finds it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from oracles.exact_visibility import exact_visibility
from sd2core.scattering.behind_things import Hiding, may_hide


def hide_behind(
    hiding: Hiding,
    points: NDArray[np.float32],
    origins_m: NDArray[np.float64],
    places_m: NDArray[np.float64],
    needed: NDArray[np.uint8],
    visible: NDArray[np.uint8],
) -> None:
    """Hide points as :func:`sd2core.scattering.behind_things.hide_behind` does."""
    for t in range(len(points) if len(hiding.faces) else 0):
        _in_frame(hiding, t, points[t], origins_m[t], places_m[t], needed[t], visible[t])


def _in_frame(
    hiding: Hiding,
    t: int,
    points: NDArray[np.float32],
    origin_m: NDArray[np.float64],
    place_m: NDArray[np.float64],
    needed: NDArray[np.uint8],
    visible: NDArray[np.uint8],
) -> None:
    """Hide those of one frame."""
    asked = np.flatnonzero(visible & needed)
    if not len(asked):
        return
    its = points[:, asked]
    box_m = np.stack([its.min(axis=1), its.max(axis=1)]) + origin_m
    boxes = hiding.boxes_m[min(t, len(hiding.boxes_m) - 1)]
    if not any(may_hide(box, box_m, place_m + origin_m) for box in boxes):
        return
    at, faces = min(t, len(hiding.points) - 1), hiding.faces
    surface = hiding.points[at] + (hiding.origins_m[at] - origin_m)[:, None]
    if hiding.counts is not None:
        faces = faces[(hiding.counts[t] > 0)[faces].any(axis=1)]
    both = np.concatenate([surface, its], axis=1, dtype=np.float32, casting="same_kind")
    marked = np.arange(both.shape[1]) >= surface.shape[1]
    visible[asked] = exact_visibility(both, faces, place_m, marked)[surface.shape[1] :]
