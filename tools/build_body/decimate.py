"""Fewer vertices for the same surface, each of them an old one.

Greedy edge collapse by quadric error (M. Garland and P. S. Heckbert, "Surface
simplification using quadric error metrics", SIGGRAPH 1997), restricted to moving one
end of an edge onto the other, so that every vertex keeps its place and its skinning.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

_TURN = 0.3
"""Cosine of the largest turn of a triangle in one collapse."""

_LENGTH_SHARE = 1e-2
"""Weight of the edge's length beside the quadric: flat parts stay evenly meshed."""


def decimate(
    vertices_m: NDArray[np.float64], faces: NDArray[np.int32], count: int
) -> tuple[NDArray[np.intp], NDArray[np.int32]]:
    """Collapse edges of a closed surface (V, 3), (F, 3) until ``count`` vertices are left.

    Returns which are left, ascending (count,), and their faces, renumbered and oriented as before;
    the surface stays a closed manifold.
    """
    surface = _Surface(vertices_m, faces)
    while len(surface.around) > count and surface.collapse_cheapest():
        pass
    rows = np.array(sorted(surface.around))
    return rows, np.searchsorted(rows, list(surface.faces.values())).astype(np.int32)


class _Surface:
    """Triangles around every vertex, and a heap of collapses with their cost."""

    def __init__(self, vertices_m: NDArray[np.float64], faces: NDArray[np.int32]) -> None:
        self.points = vertices_m
        self.faces = dict(enumerate(map(tuple, faces.tolist())))
        self.around: dict[int, set[int]] = {vertex: set() for vertex in range(len(vertices_m))}
        for number, face in self.faces.items():
            for vertex in face:
                self.around[vertex].add(number)
        self.quadrics = self._quadrics(faces)
        self.version = [0] * len(vertices_m)
        self.heap: list[tuple[float, int, int, int, int]] = []
        for vertex in self.around:
            self._offer(vertex, self._neighbours(vertex))

    def collapse_cheapest(self) -> bool:
        """Take the cheapest collapse that keeps the surface closed; False when none is left."""
        while self.heap:
            _, gone, onto, *versions = heapq.heappop(self.heap)
            fresh = versions == [self.version[gone], self.version[onto]]
            if fresh and self._allowed(gone, onto):
                self._collapse(gone, onto)
                return True
        return False

    def _neighbours(self, vertex: int) -> set[int]:
        return {other for face in self.around[vertex] for other in self.faces[face]} - {vertex}

    def _normals(self, faces: NDArray[np.int32]) -> NDArray[np.float64]:
        first, second, third = np.moveaxis(self.points[faces], 1, 0)
        return np.cross(second - first, third - first)

    def _quadrics(self, faces: NDArray[np.int32]) -> NDArray[np.float64]:
        """Sum over each vertex's triangles of area times squared distance to their planes."""
        normals = self._normals(faces)
        sizes = np.linalg.norm(normals, axis=1)[:, None]
        np.divide(normals, sizes, out=normals, where=sizes > 0)
        away = -(normals * self.points[faces[:, 0]]).sum(axis=1, keepdims=True)
        planes = np.concatenate([normals, away], axis=1)
        i, j = np.triu_indices(4)
        products = 0.5 * sizes * planes[:, i] * planes[:, j]  # (F, 10)
        quadrics = np.zeros((len(self.points), 10))
        for corners in faces.T:
            np.add.at(quadrics, corners, products)
        return quadrics

    def _offer(self, gone: int, others: Iterable[int]) -> None:
        """Put the collapses of a vertex onto others on the heap."""
        for onto in others:
            both = self.quadrics[gone] + self.quadrics[onto]
            xx, xy, xz, xd, yy, yz, yd, zz, zd, dd = both.tolist()
            x, y, z = self.points[onto].tolist()
            cost = (
                x * (xx * x + 2.0 * (xy * y + xz * z + xd))
                + y * (yy * y + 2.0 * (yz * z + yd))
                + z * (zz * z + 2.0 * zd)
                + dd
            )
            cost += _LENGTH_SHARE * float(((self.points[gone] - self.points[onto]) ** 2).sum()) ** 2
            versions = self.version[gone], self.version[onto]
            heapq.heappush(self.heap, (cost, gone, onto, *versions))

    def _allowed(self, gone: int, onto: int) -> bool:
        # Link condition: an edge of a closed surface has two triangles and, when its
        # collapse is to change no topology, no other common neighbours. Four vertices
        # in all are a tetrahedron, the smallest closed surface.
        beside_gone, beside_onto = self._neighbours(gone), self._neighbours(onto)
        if len(beside_gone & beside_onto) != 2 or len(beside_gone | beside_onto) <= 4:
            return False
        turned = np.array([self.faces[face] for face in self.around[gone] - self.around[onto]])
        before, after = self._normals(turned), self._normals(np.where(turned == gone, onto, turned))
        dots = (before * after).sum(axis=1)
        sizes = (before**2).sum(axis=1) * (after**2).sum(axis=1)
        return bool(((dots > 0.0) & (dots**2 >= _TURN**2 * sizes)).all())

    def _collapse(self, gone: int, onto: int) -> None:
        touched = self._neighbours(gone)
        for number in self.around.pop(gone):
            if onto in self.faces[number]:
                for vertex in set(self.faces.pop(number)) - {gone}:
                    self.around[vertex].remove(number)
            else:
                a, b, c = (onto if vertex == gone else vertex for vertex in self.faces[number])
                self.faces[number] = (a, b, c)
                self.around[onto].add(number)
        self.version[gone] += 1
        self.version[onto] += 1
        self.quadrics[onto] += self.quadrics[gone]
        self._offer(onto, self._neighbours(onto))
        for vertex in touched - {onto}:
            # The edges towards the changed vertex cost something else now.
            self.version[vertex] += 1
            self._offer(vertex, self._neighbours(vertex))
        for vertex in [*(touched - {onto}), onto]:
            for other in self._neighbours(vertex) - touched:
                self._offer(other, [vertex])
