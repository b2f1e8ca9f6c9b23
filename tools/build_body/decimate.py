"""Fewer vertices for the same surface, each of them an old one.

Greedy edge collapse by quadric error (M. Garland and P. S. Heckbert, "Surface
simplification using quadric error metrics", SIGGRAPH 1997), restricted to moving one
end of an edge onto the other, so that every vertex keeps its place and its skinning.
"""

from __future__ import annotations

import heapq

import numpy as np
from numpy.typing import NDArray

_TURN = 0.3
"""Cosine of the largest turn of a triangle in one collapse."""

_LENGTH_SHARE = 1e-2
"""Weight of the edge's length beside the quadric: flat parts stay evenly meshed."""

Quadric = tuple[float, ...]
Point = tuple[float, float, float]


def decimate(
    vertices_m: NDArray[np.float64], faces: NDArray[np.int32], count: int
) -> tuple[NDArray[np.intp], NDArray[np.int32]]:
    """Collapse edges of a closed surface (V, 3), (F, 3) until ``count`` vertices are left.

    Returns which are left, ascending (count,), and their faces, renumbered and oriented as before;
    the surface stays a closed manifold.
    """
    surface = _Surface(vertices_m, faces)
    while surface.left > count and surface.collapse_cheapest():
        pass
    rows = np.flatnonzero(surface.alive)
    number = np.full(len(vertices_m), -1, dtype=np.int32)
    number[rows] = np.arange(len(rows), dtype=np.int32)
    kept = np.array([face for face in surface.faces if face is not None], dtype=np.int32)
    return rows, number[kept]


class _Surface:
    """Triangles around every vertex, and a heap of collapses with their cost."""

    def __init__(self, vertices_m: NDArray[np.float64], faces: NDArray[np.int32]) -> None:
        self.points: list[Point] = [tuple(p) for p in vertices_m.tolist()]
        self.faces: list[tuple[int, int, int] | None] = [tuple(f) for f in faces.tolist()]
        self.around: list[set[int]] = [set() for _ in self.points]
        for number, face in enumerate(faces.tolist()):
            for vertex in face:
                self.around[vertex].add(number)
        self.alive = np.ones(len(self.points), dtype=np.bool_)
        self.left = len(self.points)
        self.quadrics = _quadrics(vertices_m, faces)
        self.version = [0] * len(self.points)
        self.heap: list[tuple[float, int, int, int, int]] = []
        for vertex in range(len(self.points)):
            self._offer(vertex)

    def collapse_cheapest(self) -> bool:
        """Take the cheapest collapse that keeps the surface closed; False when none is left."""
        while self.heap:
            _, gone, onto, version_gone, version_onto = heapq.heappop(self.heap)
            fresh = self.version[gone] == version_gone and self.version[onto] == version_onto
            if fresh and self._allowed(gone, onto):
                self._collapse(gone, onto)
                return True
        return False

    def _neighbours(self, vertex: int) -> set[int]:
        return {v for f in self.around[vertex] for v in self._face(f)} - {vertex}

    def _face(self, number: int) -> tuple[int, int, int]:
        face = self.faces[number]
        if face is None:
            raise ValueError(f"face {number} is gone")
        return face

    def _offer(self, gone: int) -> None:
        """Put every collapse of one vertex onto a neighbour on the heap."""
        for onto in self._neighbours(gone):
            self._offer_edge(gone, onto)

    def _offer_edge(self, gone: int, onto: int) -> None:
        cost = _cost(self.quadrics[gone], self.quadrics[onto], self.points[onto])
        cost += _LENGTH_SHARE * _squared(self.points[gone], self.points[onto]) ** 2
        heapq.heappush(self.heap, (cost, gone, onto, self.version[gone], self.version[onto]))

    def _allowed(self, gone: int, onto: int) -> bool:
        # Link condition: an edge of a closed surface has two triangles and, when its
        # collapse is to change no topology, no other common neighbours. Four vertices
        # in all are a tetrahedron, the smallest closed surface.
        beside_gone, beside_onto = self._neighbours(gone), self._neighbours(onto)
        if len(beside_gone & beside_onto) != 2 or len(beside_gone | beside_onto) <= 4:
            return False
        for number in self.around[gone] - self.around[onto]:
            face = self._face(number)
            before = _normal(*(self.points[v] for v in face))
            after = _normal(*(self.points[onto if v == gone else v] for v in face))
            dot = sum(a * b for a, b in zip(before, after, strict=True))
            sizes = _squared(before, (0.0, 0.0, 0.0)) * _squared(after, (0.0, 0.0, 0.0))
            if dot <= 0.0 or dot * dot < _TURN * _TURN * sizes:
                return False
        return True

    def _collapse(self, gone: int, onto: int) -> None:
        touched = self._neighbours(gone)
        for number in self.around[gone] & self.around[onto]:
            for vertex in self._face(number):
                self.around[vertex].discard(number)
            self.faces[number] = None
        for number in self.around[gone]:
            a, b, c = (onto if v == gone else v for v in self._face(number))
            self.faces[number] = (a, b, c)
            self.around[onto].add(number)
        self.around[gone] = set()
        self.alive[gone] = False
        self.left -= 1
        self.version[gone] += 1
        self.quadrics[onto] = tuple(
            a + b for a, b in zip(self.quadrics[onto], self.quadrics[gone], strict=True)
        )
        self.version[onto] += 1
        self._offer(onto)
        for vertex in touched - {onto}:
            # The edges towards the changed vertex cost something else now.
            self.version[vertex] += 1
            self._offer(vertex)
        for vertex in touched - {onto}:
            for other in self._neighbours(vertex) - touched:
                self._offer_edge(other, vertex)
        for other in self._neighbours(onto) - touched:
            self._offer_edge(other, onto)


def _quadrics(vertices_m: NDArray[np.float64], faces: NDArray[np.int32]) -> list[Quadric]:
    """Sum over each vertex's triangles of area times squared distance to their planes."""
    corners = vertices_m[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = 0.5 * np.linalg.norm(normal, axis=1)
    normal = np.divide(normal, 2.0 * area[:, None], out=normal, where=area[:, None] > 0)
    plane = np.concatenate([normal, -(normal * corners[:, 0]).sum(axis=1)[:, None]], axis=1)
    i, j = np.triu_indices(4)
    products = area[:, None] * plane[:, i] * plane[:, j]  # (F, 10)
    quadrics = np.zeros((len(vertices_m), 10))
    for corner in range(3):
        np.add.at(quadrics, faces[:, corner], products)
    return [tuple(row) for row in quadrics.tolist()]


def _cost(first: Quadric, second: Quadric, point: Point) -> float:
    xx, xy, xz, xd, yy, yz, yd, zz, zd, dd = (a + b for a, b in zip(first, second, strict=True))
    x, y, z = point
    return (
        x * (xx * x + 2.0 * (xy * y + xz * z + xd))
        + y * (yy * y + 2.0 * (yz * z + yd))
        + z * (zz * z + 2.0 * zd)
        + dd
    )


def _normal(a: Point, b: Point, c: Point) -> Point:
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    return (uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx)


def _squared(a: Point, b: Point) -> float:
    return (a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2
