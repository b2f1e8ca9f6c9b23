"""Visibility of facets and of points: what faces a sensor, and neither body nor thing hides."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sd2core.mesh.things import Surface
from sd2core.scattering.behind_things import Hiding, hide_behind
from sd2core.scattering.exact import exact_visibility_kernel


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
    return _before_surface(vertices, faces, place, centres, facing)


def points_behind(
    vertices_m: NDArray[np.floating],
    faces: NDArray[np.int32],
    sensor_m: ArrayLike,
    points_m: NDArray[np.float64],
) -> NDArray[np.bool_]:
    """Points (n, 3) that the surface of one frame hides from a sensor, (n,)."""
    origin = np.rint(np.asarray(vertices_m[0], np.float64))
    vertices = np.asarray(vertices_m, np.float64) - origin
    place, points = np.asarray(sensor_m, np.float64) - origin, points_m - origin
    # Only within the narrowest cone around the surface, and not before it, can one be hidden.
    away, beyond = vertices - place, points - place
    range_m, beyond_m = (np.maximum(np.linalg.norm(one, axis=1), 1e-9) for one in (away, beyond))
    axis = (away / range_m[:, None]).mean(axis=0)
    widest = (away @ axis / range_m).min()
    maybe = (beyond @ axis >= widest * beyond_m) & (beyond_m > range_m.min())
    if not maybe.any():
        return maybe
    return maybe & ~_before_surface(vertices, faces, place, points, maybe)


def _before_surface(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
    place: NDArray[np.float64],
    points: NDArray[np.float64],
    wanted: NDArray[np.bool_],
) -> NDArray[np.bool_]:
    """The wanted ones of n points, (n, 3), that a surface does not hide, (n,)."""
    # They go along as loose vertices, which the surface may hide.
    loose = np.concatenate([vertices, points]).T[None]  # (1, 3, V + n)
    needed = np.concatenate([np.zeros(len(vertices), bool), wanted])[None].astype(np.uint8)
    seen = np.zeros_like(needed)
    exact_visibility_kernel(
        np.ascontiguousarray(loose, dtype=np.float32), faces, place, needed, 0, 1, seen
    )
    return seen[0, len(vertices) :].astype(bool)


def facets_before(
    vertices_m: NDArray[np.floating],
    faces: NDArray[np.int32],
    sensor_m: ArrayLike,
    hiding: Surface,
) -> NDArray[np.bool_]:
    """Facets (F,) of one frame whose centre another surface does not hide, whatever its own does.

    ``hiding`` are the other one's vertices (W, 3) and faces.
    """
    seen = np.ones((1, len(faces)), np.uint8)
    if len(hiding[1]):
        centres = np.asarray(vertices_m, np.float64)[faces].mean(axis=1)
        origin = np.rint(centres[:1])  # (1, 3)
        points = np.ascontiguousarray((centres - origin).T[None], np.float32)
        place = np.asarray(sensor_m, np.float64) - origin
        hide_behind(Hiding.still(*hiding), points, origin, place, np.ones_like(seen), seen)
    return seen[0] > 0
