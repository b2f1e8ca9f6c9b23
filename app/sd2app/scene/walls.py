"""Walls and floors in the scene: a translucent grid each, around the body's nearest point."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from vtkmodules.vtkRenderingCore import vtkRenderer

from sd2app.scene.colours import SceneColours, mixed
from sd2app.scene.parts import Shape
from sd2core.mesh.walls import Wall

_OPACITY = 0.12
_CELLS, _CELL_M = 8, 0.5


class Walls:
    """Pieces of planes; nothing is picked of them."""

    def __init__(self, renderer: vtkRenderer) -> None:
        self._renderer = renderer
        self.shapes: list[Shape] = []
        self._colours: SceneColours | None = None

    def set_walls(self, walls: Sequence[Wall], around_m: NDArray[np.float64]) -> None:
        """Show other walls, each about the foot of the perpendicular from a point."""
        for shape in self.shapes:
            self._renderer.RemoveActor(shape.actor)
        self.shapes = []
        for wall in walls:
            points, segments, triangles = grid_on(wall, around_m)
            face = Shape(self._renderer, points, triangles=triangles)
            face.look.SetOpacity(_OPACITY)
            face.look.LightingOff()
            lines = Shape(self._renderer, points, segments=segments)
            lines.look.SetOpacity(0.3)
            self.shapes += [face, lines]
        if self._colours is not None:
            self.set_colours(self._colours)

    def set_colours(self, colours: SceneColours) -> None:
        """Colours of the theme."""
        self._colours = colours
        for shape in self.shapes:
            shape.set_colour(mixed(colours.muted, colours.sensor, 0.25))


def grid_on(
    wall: Wall, around_m: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.int32], NDArray[np.int32]]:
    """Points (n, 3), lines (m, 2) and triangles (2, 3) of a square grid on a wall."""
    outward = wall.outward
    middle = around_m + wall.before_m(around_m) * outward
    level = np.array([0.0, 0.0, 1.0]) if abs(outward[1]) > 0.9 else np.array([0.0, 1.0, 0.0])
    across = np.cross(level, outward)
    across /= np.linalg.norm(across)
    along = np.cross(outward, across)
    steps = (np.arange(_CELLS + 1) - 0.5 * _CELLS) * _CELL_M
    rim = np.stack([np.full_like(steps, steps[0]), np.full_like(steps, steps[-1])], axis=1)
    there = np.stack([steps, steps], axis=1)
    flat = np.concatenate([np.stack([there, rim], axis=2), np.stack([rim, there], axis=2)])
    ends = flat.reshape(-1, 2)
    points = middle + ends[:, :1] * across + ends[:, 1:] * along
    segments = np.arange(len(points), dtype=np.int32).reshape(-1, 2)
    first, last = 0, 2 * _CELLS  # the outermost lines one way
    corners = [[first, first + 1, last + 1], [first, last + 1, last]]
    return points, segments, np.array(corners, np.int32)
