"""Doppler maps of meshes that are compared, made alike."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sd2core.doppler import PRESETS, Synthesizer
from sd2core.maps import DopplerMap
from sd2core.mesh.sequence import MeshSequence
from sd2core.progress import Progress, silent
from sd2core.sensor import VirtualSensor


def maps_alike(
    meshes: Sequence[MeshSequence], sensor: VirtualSensor, progress: Progress = silent
) -> tuple[DopplerMap, ...]:
    """Count maps of all meshes by the paper's preset.

    Hidden vertices are left out where every mesh has faces; otherwise all vertices of
    all meshes count, so that none is compared with another kind of map.
    """
    options = PRESETS["paper"]
    if any(mesh.faces is None for mesh in meshes):
        options = replace(options, visibility="none")
    total = sum(mesh.frame_count for mesh in meshes)
    maps, done = [], 0
    for mesh in meshes:
        before = done
        maps.append(
            Synthesizer(mesh, options).map(
                sensor,
                progress=lambda frames, _, before=before: progress(  # type: ignore[misc]
                    before + frames, total
                ),
            )
        )
        done += mesh.frame_count
    return tuple(maps)


def map_l1(
    values: DopplerMap, reference: DopplerMap, frames: NDArray[np.bool_] | None = None
) -> float:
    """Sum of absolute differences over the sum of the reference, both smoothed.

    Parameters
    ----------
    values, reference : DopplerMap
        Of one shape.
    frames : bool array, shape (frames,), optional
        Only these.

    Returns
    -------
    float
        0 when both are empty, infinite when only the reference is.
    """
    a, b = (one.values.astype(np.float64) for one in (values, reference))
    if frames is not None:
        a, b = a[:, frames], b[:, frames]
    difference, total = float(np.abs(a - b).sum()), float(b.sum())
    if total > 0:
        return difference / total
    return 0.0 if difference == 0 else float("inf")
