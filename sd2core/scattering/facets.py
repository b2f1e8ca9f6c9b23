"""Visibility of facets and of points: what faces a sensor, and neither body nor thing hides."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sd2core.mesh.things import Surface
from sd2core.scattering.behind_things import Hiding, hide_behind


def visible_facets(
    vertices_m: NDArray[np.floating], faces: NDArray[np.int32], sensor_m: ArrayLike
) -> NDArray[np.bool_]:
    """Visible facets (F,) of one frame; faces are counter-clockwise seen from outside."""
    vertices = np.asarray(vertices_m, np.float64)
    corners = vertices[faces]  # (F, 3, 3)
    centres = corners.mean(axis=1)
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    facing = ((np.asarray(sensor_m, np.float64) - centres) * across).sum(axis=1) > 0
    return _before((vertices, faces), centres, sensor_m, facing)


def points_behind(
    vertices_m: NDArray[np.floating],
    faces: NDArray[np.int32],
    sensor_m: ArrayLike,
    points_m: NDArray[np.float64],
) -> NDArray[np.bool_]:
    """Points (n, 3) that the surface of one frame hides from a sensor, (n,)."""
    vertices = np.asarray(vertices_m, np.float64)
    # Only within the narrowest cone around the surface, and not before it, can one be hidden.
    place = np.asarray(sensor_m, np.float64)
    away, beyond = vertices - place, points_m - place
    range_m, beyond_m = (np.maximum(np.linalg.norm(one, axis=1), 1e-9) for one in (away, beyond))
    axis = (away / range_m[:, None]).mean(axis=0)
    widest = (away @ axis / range_m).min()
    maybe = (beyond @ axis >= widest * beyond_m) & (beyond_m > range_m.min())
    return maybe & ~_before((vertices, faces), points_m, sensor_m, maybe)


def facets_before(
    vertices_m: NDArray[np.floating], faces: NDArray[np.int32], sensor_m: ArrayLike, hiding: Surface
) -> NDArray[np.bool_]:
    """Facets (F,) of one frame whose centre another surface does not hide, whatever its own does.

    ``hiding`` are the other one's vertices (W, 3) and faces.
    """
    centres = np.asarray(vertices_m, np.float64)[faces].mean(axis=1)
    return _before(hiding, centres, sensor_m, np.ones(len(faces), bool))


def _before(
    hiding: Surface, points_m: NDArray[np.float64], sensor_m: ArrayLike, wanted: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """The wanted ones of n points, (n, 3), that a surface does not hide, (n,)."""
    seen = wanted[None].astype(np.uint8)
    if len(hiding[1]) and len(points_m):
        # Around the points, because visibility is decided on single-precision coordinates.
        origin_m = np.rint(points_m[:1])
        points = np.ascontiguousarray((points_m - origin_m).T[None], np.float32)
        place = np.asarray(sensor_m, np.float64) - origin_m
        hide_behind(Hiding.still(*hiding), points, origin_m, place, seen.copy(), seen)
    return seen[0] > 0
