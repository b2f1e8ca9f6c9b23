"""Things around the body in the scene: grey and translucent, with their edges; found by a ray."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray
from vtkmodules.vtkRenderingCore import vtkRenderer

from sd2app.scene.colours import SceneColours, mixed
from sd2app.scene.parts import Shape
from sd2core.mesh.things import Surface, Thing

_OPACITY = 0.38
_SHARP_COSINE = 0.9
_NEAREST_M = 0.01


class Movables:
    """Surfaces of which the pointer finds one, which is lit up while it is on it or drags it."""

    def __init__(self, renderer: vtkRenderer) -> None:
        self._renderer = renderer
        self._colours: SceneColours | None = None
        self._hot: int | None = None

    def set_hot(self, number: int | None) -> None:
        """Light up the one that the pointer is on or drags."""
        if number != self._hot and self._colours is not None:
            self._hot = number
            self.set_colours(self._colours)

    def set_colours(self, colours: SceneColours) -> None:
        """Colours of the theme."""
        raise NotImplementedError

    def under(
        self, eye_m: NDArray[np.float64], ray: NDArray[np.float64]
    ) -> tuple[int, NDArray[np.float64]] | None:
        """Number of the nearest one that a ray meets, and where; None if it meets none."""
        met = [
            np.inf if surface is None else first_meeting(eye_m, ray, *surface)
            for surface in self._to_meet()
        ]
        if not met or not np.isfinite(nearest := min(met)):
            return None
        return met.index(nearest), eye_m + nearest * ray

    def _to_meet(self) -> Sequence[Surface | None]:
        """Surface of each; None of one that cannot be met."""
        raise NotImplementedError


class Things(Movables):
    """Surfaces of things, one of which may be lit up or shifted while it is dragged."""

    def __init__(self, renderer: vtkRenderer) -> None:
        super().__init__(renderer)
        self.things: tuple[Thing, ...] = ()
        self.surfaces: tuple[Surface, ...] = ()
        self._shapes: list[tuple[Shape, Shape]] = []

    @property
    def shapes(self) -> list[Shape]:
        """Faces and edges of all."""
        return [shape for pair in self._shapes for shape in pair]

    @property
    def points_m(self) -> NDArray[np.float64]:
        """All vertices, (n, 3)."""
        return np.concatenate([np.zeros((0, 3)), *(vertices for vertices, _ in self.surfaces)])

    def set_surfaces(self, surfaces: Sequence[Surface], things: tuple[Thing, ...] = ()) -> None:
        """Show other things, which have these surfaces."""
        for shape in self.shapes:
            self._renderer.RemoveActor(shape.actor)
        self.surfaces, self.things, self._hot = tuple(surfaces), things, None
        self._shapes = []
        for vertices, faces in surfaces:
            face = Shape(self._renderer, vertices, triangles=faces, lit=True)
            face.look.SetInterpolationToFlat()
            face.look.SetOpacity(_OPACITY)
            edge = Shape(self._renderer, vertices, segments=sharp_edges(vertices, faces))
            self._shapes.append((face, edge))
        if self._colours is not None:
            self.set_colours(self._colours)

    def shift(self, number: int, offset_m: ArrayLike) -> None:
        """Draw one elsewhere than it is."""
        for shape in self._shapes[number]:
            shape.place(np.eye(3), np.asarray(offset_m, np.float64))

    def set_colours(self, colours: SceneColours) -> None:
        """Colours of the theme."""
        self._colours = colours
        for number, (face, edge) in enumerate(self._shapes):
            hot = number == self._hot
            face.set_colour(mixed(colours.plain, colours.sensor, 0.35 if hot else 0.0))
            edge.set_colour(
                colours.sensor if hot else mixed(colours.muted, colours.background, 0.2)
            )

    def _to_meet(self) -> Sequence[Surface | None]:
        return self.surfaces


def sharp_edges(vertices: NDArray[np.floating], faces: NDArray[np.integer]) -> NDArray[np.int32]:
    """Edges (n, 2) of a surface where it bends or ends, without those within a plane."""
    corners = np.asarray(vertices, np.float64)[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    owner = np.tile(np.arange(len(faces)), 3)
    unique, which, counts = np.unique(edges, axis=0, return_inverse=True, return_counts=True)
    total = np.zeros((len(unique), 3))
    np.add.at(total, which.ravel(), normals[owner])
    # Two unit normals add up to 2 cos(half the angle between them).
    sharp = np.linalg.norm(total, axis=1) < 2.0 * np.sqrt(0.5 * (1.0 + _SHARP_COSINE))
    return unique[sharp | (counts != 2)].astype(np.int32)


def first_meeting(
    eye_m: NDArray[np.float64],
    ray: NDArray[np.float64],
    vertices: NDArray[np.float64],
    faces: NDArray[np.int32],
) -> float:
    """Multiple of a ray at which it first meets a surface; infinite if it never does.

    After T. Möller and B. Trumbore, *Fast, minimum storage ray/triangle intersection*, 1997.
    """
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    across = np.cross(ray, c - a)
    with np.errstate(divide="ignore", invalid="ignore"):
        scale = 1.0 / ((b - a) * across).sum(axis=1)
        u = ((eye_m - a) * across).sum(axis=1) * scale
        up = np.cross(eye_m - a, b - a)
        v = (up @ ray) * scale
        along = (up * (c - a)).sum(axis=1) * scale
        meets = (u >= 0) & (v >= 0) & (u + v <= 1) & (along > _NEAREST_M)
    return float(along[meets].min(initial=np.inf))
