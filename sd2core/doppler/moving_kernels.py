"""Compiled loops that find and gather the vertices that move: :mod:`sd2core.doppler.moving`."""

from __future__ import annotations

import numpy as np

from sd2core.doppler.kernels import multiplicity_seen
from sd2core.numerics.compiled import compiled
from sd2core.scattering.visibility import add_cross_product, facing_kernel, set_normal

GROUP = 4
"""Frames whose moving vertices are kept together. With more, knots are shared by more frames, but
more vertices are kept that do not move in all of them."""


@compiled
def moving_kernel(positions, before, after, limit_m, marks):  # type: ignore[no-untyped-def]
    """Mark the vertices that move so far or farther in any sample.

    Parameters
    ----------
    positions : (knots, 3, V)
        Of all vertices.
    before, after : int64 (n, samples)
        Knots between which each sample is measured.
    limit_m : float64 (n, samples)
        Distance from which on a vertex moves.
    marks : bool (groups, V)
        Written; false at first.
    """
    for t in range(before.shape[0]):
        group = marks[t // GROUP]
        for sample in range(before.shape[1]):
            limit = limit_m[t, sample] * limit_m[t, sample]
            a, b = positions[before[t, sample]], positions[after[t, sample]]
            for v in range(marks.shape[1]):
                dx = np.float64(a[0, v]) - np.float64(b[0, v])
                dy = np.float64(a[1, v]) - np.float64(b[1, v])
                dz = np.float64(a[2, v]) - np.float64(b[2, v])
                group[v] |= dx * dx + dy * dy + dz * dz >= limit


@compiled
def gather_kernel(values, rows, vertex, first, result):  # type: ignore[no-untyped-def]
    """Write the values of the vertices that move, at the rows of every group.

    Parameters
    ----------
    values : (N, columns, V)
        Of all vertices.
    rows : int64 (groups, rows)
        Which of the N are wanted of a group.
    vertex, first
        Those of :class:`~sd2core.doppler.histogram.Paths`.
    result : flat
        Written: group after group, row after row, (columns, n).
    """
    at = 0
    for group in range(rows.shape[0]):
        for row in rows[group]:
            for column in range(values.shape[1]):
                for p in range(first[group], first[group + 1]):
                    result[at] = values[row, column, vertex[p]]
                    at += 1


@compiled
def moving_normals_kernel(points, faces, vertex, first, normals):  # type: ignore[no-untyped-def]
    """Write the normals of the vertices that move, as :func:`gather_kernel` orders them.

    They are those of :func:`sd2core.scattering.visibility.vertex_normals_kernel`, of which only
    the triangles at these vertices are looked at.

    Parameters
    ----------
    points : float32 (frames, 3, V)
        All vertices.
    faces : int32 (F, 3)
        All triangles.
    vertex, first
        Those of :class:`~sd2core.doppler.histogram.Paths`.
    normals : int8, flat
        Written; of a last group with fewer frames what is missing is left.
    """
    total = np.empty((points.shape[2], 3), np.float64)
    moves = np.zeros(points.shape[2], np.bool_)
    near = np.empty(faces.shape[0], np.int64)
    for group in range(first.shape[0] - 1):
        numbers = vertex[first[group] : first[group + 1]]
        count = numbers.shape[0]
        moves[:] = False
        for v in numbers:
            moves[v] = True
        faces_near = 0
        for f in range(faces.shape[0]):
            near[faces_near] = f
            faces_near += moves[faces[f, 0]] | moves[faces[f, 1]] | moves[faces[f, 2]]
        for t in range(group * GROUP, min((group + 1) * GROUP, points.shape[0])):
            x, y, z = points[t, 0], points[t, 1], points[t, 2]
            for f in near[:faces_near]:
                for corner in range(3):
                    total[faces[f, corner]] = 0
            for v in numbers:
                total[v] = 0
            for f in near[:faces_near]:
                add_cross_product(x, y, z, faces[f], total)
            at = 3 * (GROUP * first[group] + (t - group * GROUP) * count)
            here = normals[at : at + 3 * count].reshape((3, count))
            for p in range(count):
                set_normal(total, numbers[p], here, p)


@compiled
def facing_counts_kernel(  # type: ignore[no-untyped-def]
    points, normals, multiplicity, start, sensor, visible
):
    """Number of vertices that face the sensor in each frame, or that they stand for.

    Parameters
    ----------
    points, normals : (N, 3, V) and int8 (N, 3, V)
        All vertices.
    multiplicity : float32 (V,)
        Number of vertices that each stands for.
    start : int
        First of the n frames in the points.
    sensor : (3,)
        In the frame and the precision of the points.
    visible : float64 (n,)
        Written.
    """
    seen = np.empty(points.shape[2], np.uint8)
    for i in range(visible.shape[0]):
        here, normal = points[start + i], normals[start + i]
        facing_kernel(
            here[0], here[1], here[2], normal[0], normal[1], normal[2],
            sensor[0], sensor[1], sensor[2], seen,
        )  # fmt: skip
        visible[i] = multiplicity_seen(seen, multiplicity)


@compiled
def marked_counts_kernel(mask, multiplicity, visible):  # type: ignore[no-untyped-def]
    """Number of vertices that a mask (n, V) marks in each frame (n,), or that they stand for."""
    for t in range(mask.shape[0]):
        visible[t] = multiplicity_seen(mask[t], multiplicity)
