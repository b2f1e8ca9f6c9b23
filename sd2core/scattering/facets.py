"""Visibility of facets: those that face a sensor and whose centre nothing hides."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sd2core.errors import Sd2Error
from sd2core.mesh.sequence import MeshSequence
from sd2core.numerics.compiled import workers
from sd2core.progress import Progress, silent
from sd2core.scattering.exact import exact_visibility_kernel
from sd2core.sensor import VirtualSensor


def facet_visibility(
    mesh: MeshSequence, sensor: VirtualSensor, progress: Progress = silent
) -> NDArray[np.bool_]:
    """Visible facets of every frame, (T, F); none where there is no person.

    Raises Sd2Error for a point cloud.
    """
    if mesh.faces is None:
        raise Sd2Error("The mesh has no faces", "a surface, which alone can hide anything")
    faces = mesh.faces
    visible = np.zeros((mesh.frame_count, len(faces)), dtype=np.bool_)

    def fill(frame: int) -> None:
        if mesh.presence.there[frame]:
            visible[frame] = visible_facets(mesh.frame(frame), faces, sensor.position_m)

    for done, _ in enumerate(workers().map(fill, range(mesh.frame_count))):
        progress(done, mesh.frame_count)
    return visible


def visible_facets(
    vertices_m: NDArray[np.floating], faces: NDArray[np.int32], sensor_m: ArrayLike
) -> NDArray[np.bool_]:
    """Visible facets (F,) of one frame; faces are counter-clockwise seen from outside."""
    # Around the body, because visibility is decided on single-precision coordinates.
    origin = np.rint(np.asarray(vertices_m[0], np.float64))
    vertices = np.asarray(vertices_m, np.float64) - origin
    place = np.asarray(sensor_m, np.float64) - origin
    corners = vertices[faces]  # (F, 3, 3)
    centres = corners.mean(axis=1)
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    facing = ((place - centres) * across).sum(axis=1) > 0
    # The centres go along as loose vertices, which the surface may hide.
    points = np.concatenate([vertices, centres]).T[None]  # (1, 3, V + F)
    needed = np.concatenate([np.zeros(len(vertices), bool), facing])[None].astype(np.uint8)
    seen = np.zeros_like(needed)
    exact_visibility_kernel(
        np.ascontiguousarray(points, dtype=np.float32), faces, place, needed, 0, 1, seen
    )
    return seen[0, len(vertices) :].astype(bool)
