"""A mesh with fewer vertices, the same ones in every frame."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.mesh.made_vertices import MadeVertices, read_frames, shifted_like, unshifted
from sd2core.mesh.sequence import MeshSequence, refuse_missing

_MIN_FACES = 4
"""Least number of faces that enclose anything."""

_SIZE = 100.0
"""Size that a surface is brought to: the library's thresholds are absolute, and finer there."""


def decimate(mesh: MeshSequence, kept: float) -> MeshSequence:
    """A mesh with about ``kept`` of the vertices, chosen once for the whole clip.

    The surface of the frame in the middle is simplified by collapsing edges (quadric errors, by
    the library fast-simplification). Every vertex that stays is one of the mesh's
    own, of those merged together the one nearest to their middle, so that it moves as
    it always did; ``vertex_counts`` says for how many it stands. Vertices of pieces that vanish
    count with the nearest that stays; loose ones stay. Vertices at the same place
    in that frame are taken as one.

    Parameters
    ----------
    kept : float
        Share of the faces, and so of a closed surface's vertices, above 0 and up
        to 1. 1 gives the mesh itself.

    Returns
    -------
    MeshSequence
        Its vertices are picked from the mesh's when they are read; nothing is
        copied. The mesh itself, with a note, where fewer than four faces would
        be left.

    Raises
    ------
    Sd2Error
        For a share out of range, a point cloud, or a frame that is not finite.
    """
    name = mesh.source or "The mesh"
    if not 0 < kept <= 1:
        raise Sd2Error(f"{kept:g} of the vertices are to be kept", "a share above 0 and up to 1")
    if kept == 1:
        return mesh
    if (still := unshifted(mesh)[0]) is not mesh:  # the same vertices wherever it stands
        return shifted_like(decimate(still, kept), mesh)
    if mesh.faces is None:
        raise Sd2Error(
            f"{name} has no faces, it is a point cloud",
            "a surface to take vertices from",
            "Keep all vertices, or give the faces (--faces)",
        )
    frame = mesh.frame_count // 2
    points = mesh.frame(frame).astype(np.float64)
    refuse_missing(points[None], frame, mesh.source)
    others = tuple(decimate(body, kept) for body in mesh.others)
    simplified = _simplify(points, mesh.faces, kept)
    if simplified is None:
        note = "not decimated: fewer than four faces would be left"
        return replace(mesh, others=others, notes=(*mesh.notes, note))
    columns, group, faces = simplified
    counts = np.bincount(group, mesh.vertex_counts, len(columns)).astype(np.int64)
    done = f"decimated to {len(columns)} of {mesh.vertex_count} vertices"
    return replace(
        mesh,
        vertices=MadeVertices(
            (mesh.frame_count, len(columns), 3),
            mesh.vertices.dtype,
            lambda frames: np.take(read_frames(mesh, frames), columns, axis=1),
        ),
        faces=faces,
        vertex_counts=counts,
        uncertainty=None if mesh.uncertainty is None else mesh.uncertainty.of_vertices(columns),
        source=f"{mesh.source}, {done}" if mesh.source else done,
        notes=(*mesh.notes, done),
        others=others,
    )


def _simplify(
    points: NDArray[np.float64], faces: NDArray[np.int32], kept: float
) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.int32]] | None:
    """The vertices that stay (K,), which of them each vertex is merged into (V,), faces."""
    on_surface = np.unique(faces)
    places, welded = np.unique(points[on_surface], axis=0, return_inverse=True)
    number = np.full(len(points), -1)
    number[on_surface] = welded.ravel()
    triangles = _proper(number[faces])
    if kept * len(triangles) < _MIN_FACES:
        return None
    corners, triangles, merged = _collapse(places, triangles, kept)
    if len(triangles) < _MIN_FACES:
        return None
    lost = merged < 0
    if lost.any():
        from scipy.spatial import cKDTree

        merged[lost] = cKDTree(corners).query(places[lost])[1]

    # Loose vertices follow those of the surface, each a group of its own.
    loose = np.flatnonzero(number < 0)
    group = np.where(number < 0, 0, merged[number])
    group[loose] = len(corners) + np.arange(len(loose))
    # The middle of those merged stands better for them than where their quadrics put the
    # simplified vertex: the map of a walking body comes out nearer to the whole mesh's.
    size = np.bincount(group)
    middle = np.stack([np.bincount(group, along) / size for along in points.T], axis=1)
    # Within each group the nearest to it; then the first.
    distance = np.linalg.norm(points - middle[group], axis=1)
    order = np.lexsort((distance, group))
    first = np.searchsorted(group[order], np.arange(len(middle)))
    columns = order[first]
    # In their old order, so that frames are read from front to back.
    ranks = np.empty(len(columns), np.intp)
    ranks[np.argsort(columns)] = np.arange(len(columns))
    return np.sort(columns), ranks[group], ranks[triangles].astype(np.int32)


def _collapse(
    places: NDArray[np.float64], triangles: NDArray[np.intp], kept: float
) -> tuple[NDArray[np.float64], NDArray[np.intp], NDArray[np.intp]]:
    """Vertices and faces of the simplified surface, and where each vertex went (-1: nowhere)."""
    import fast_simplification

    low, high = places.min(axis=0), places.max(axis=0)
    middle, scale = 0.5 * (low + high), _SIZE / (high - low).max()
    scaled = ((places - middle) * scale).astype(np.float32)
    triangles = np.ascontiguousarray(triangles, np.int32)
    *_, collapses = fast_simplification.simplify(
        scaled, triangles, 1.0 - kept, return_collapses=True
    )
    corners, left, merged = fast_simplification.replay_simplification(scaled, triangles, collapses)
    return (
        np.asarray(corners, np.float64).reshape(-1, 3) / scale + middle,
        _proper(np.asarray(left, np.intp).reshape(-1, 3)),
        np.asarray(merged, np.intp),
    )


def _proper(triangles: NDArray[np.intp]) -> NDArray[np.intp]:
    """Triangles with three different corners."""
    one, two, three = triangles.T
    return triangles[(one != two) & (two != three) & (three != one)]
