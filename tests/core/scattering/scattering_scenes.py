"""Surfaces to look at, and slow but certain answers about them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Mesh = tuple[NDArray[np.float64], NDArray[np.int32]]


def sphere(radius_m: float = 1.0, divisions: int = 3, turn_rad: float = 0.0) -> Mesh:
    """Icosphere, turned about an odd axis: vertices (V, 3) and outward faces (F, 3)."""
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=divisions, radius=radius_m)
    ball.apply_transform(trimesh.transformations.rotation_matrix(turn_rad, [1.0, 2.0, 0.7]))
    return np.asarray(ball.vertices), np.asarray(ball.faces, np.int32)


def plate(side_m: float = 1.0, cells: int = 12, depth_m: float = 0.0) -> Mesh:
    """Flat grid in x and y that faces −z."""
    line = np.linspace(-side_m / 2, side_m / 2, cells + 1)
    x, y = np.meshgrid(line, line)
    vertices = np.stack([x.ravel(), y.ravel(), np.full(x.size, depth_m)], axis=1)
    corner = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    right, below = corner + 1, corner + cells + 1
    faces = np.concatenate(
        [np.stack([corner, below, right], 1), np.stack([right, below, below + 1], 1)]
    )
    return vertices, faces.astype(np.int32)


def together(*meshes: Mesh) -> Mesh:
    """Several surfaces as one mesh."""
    offsets = np.cumsum([0, *(len(vertices) for vertices, _ in meshes[:-1])])
    return (
        np.concatenate([vertices for vertices, _ in meshes]),
        np.concatenate(
            [faces + offset for (_, faces), offset in zip(meshes, offsets, strict=True)]
        ).astype(np.int32),
    )


def columns(vertices: NDArray[Any]) -> NDArray[np.float32]:
    """(V, 3) as the kernels take it: one frame, (1, 3, V) float32."""
    return np.ascontiguousarray(vertices.T[None], np.float32)


def certain(
    vertices: NDArray[np.float32],
    faces: NDArray[np.int32],
    sensor: NDArray[np.float64],
    which: NDArray[np.intp],
    *,
    barycentric: float,
    distance_m: float,
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Every vertex against every triangle in double precision.

    Returns
    -------
    hidden, visible : bool arrays, shape (len(which),)
        Certain answers. Neither holds in a grazing tie: some triangle's edge is
        met within ``barycentric``, or its plane within ``distance_m`` of either
        end of the ray, or it is seen edge-on within ``barycentric``.
    """
    place = vertices.astype(np.float64)
    extended = np.linalg.norm(_normals(place[faces].transpose(1, 2, 0)), axis=0) > 0
    faces = faces[extended]
    corners = np.ascontiguousarray(place[faces].transpose(1, 2, 0))  # (corner, axis, F)
    normals = _normals(corners)
    areas = np.linalg.norm(normals, axis=0)
    sizes = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1).max(axis=0)
    hidden, visible = np.zeros(len(which), bool), np.zeros(len(which), bool)
    for at, vertex in enumerate(which):
        ray = sensor - place[vertex]
        length = np.linalg.norm(ray)
        if length <= 2 * distance_m:
            continue
        direction = ray / length
        a, b, c = corners - place[vertex][:, None]
        # p x q . d is p . (q x d), and q x d a product with one matrix.
        turn = np.cross(np.eye(3), direction).T
        turned_a, turned_b, turned_c = turn @ a, turn @ b, turn @ c
        volumes = np.stack([(b * turned_c).sum(0), (c * turned_a).sum(0), (a * turned_b).sum(0)])
        total = volumes.sum(axis=0)
        others = (vertex != faces.T).all(axis=0)
        edge_on = np.abs(total) <= barycentric * areas
        safe = np.where(total == 0, 1.0, total)
        inside = (volumes / safe).min(axis=0)
        along = (normals * a).sum(axis=0) / safe
        within = np.minimum(along, length - along)
        clear = ~edge_on & (inside > barycentric) & (within > distance_m)
        possible = (inside > -barycentric) & (within > -distance_m)
        # Edge-on, the ray meets the triangle's plane anywhere: only its extent is certain.
        flat = np.flatnonzero(edge_on)
        near = np.stack([a, b, c])[:, :, flat]
        aside = np.linalg.norm(turn @ near, axis=1).min(axis=0)
        nearest = (direction @ near).min(axis=0)
        possible[flat] |= (aside <= sizes[flat]) & (nearest < length)
        hidden[at] = (clear & others).any()
        visible[at] = not (possible & others).any()
    return hidden, visible


def _normals(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    a, b, c = corners
    return np.cross(b - a, c - a, axis=0)


def embree_visible(
    vertices: NDArray[np.float32], faces: NDArray[np.int32], sensor: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """The same question to embree, starting a little off the surface."""
    from embreex import rtcore_scene
    from embreex.mesh_construction import TriangleMesh

    place = np.ascontiguousarray(vertices, np.float32)
    size = float(np.linalg.norm(np.ptp(place, axis=0)))
    scene = rtcore_scene.EmbreeScene()
    TriangleMesh(scene, place, faces)
    ray = sensor.astype(np.float32) - place
    length = np.linalg.norm(ray, axis=1).astype(np.float32)
    ray /= np.maximum(length, np.float32(1e-30))[:, None]
    offset = np.float32(2e-5 * size)
    hit = scene.run(place + offset * ray, ray, dists=length - 2 * offset)
    seen: NDArray[np.bool_] = np.asarray(hit) < 0
    return seen


def skims_own_surface(
    vertices: NDArray[np.float32],
    faces: NDArray[np.int32],
    sensor: NDArray[np.float64],
    which: NDArray[np.intp],
    sine: float,
) -> NDArray[np.bool_]:
    """Whether a triangle that a vertex belongs to is seen edge-on within ``sine``.

    It cannot hide its own corner, but embree, which starts a little off the
    surface in single precision, may meet it.
    """
    place = vertices.astype(np.float64)
    skims = np.zeros(len(which), bool)
    for at, vertex in enumerate(which):
        a, b, c = place[faces[(faces == vertex).any(axis=1)]].transpose(1, 0, 2)
        normal, ray = np.cross(b - a, c - a), sensor - place[vertex]
        cosine = np.abs(normal @ ray)
        skims[at] = (cosine <= sine * np.linalg.norm(normal, axis=1) * np.linalg.norm(ray)).any()
    return skims
