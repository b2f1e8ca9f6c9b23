"""Bodies beside the first one in the scene, and walls that mirror them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray
from vtkmodules.vtkRenderingCore import vtkRenderer

from sd2app.scene.colours import SceneColours, fractions, mixed
from sd2app.scene.parts import Body, Shape
from sd2app.scene.things import Movables
from sd2core.figures.colours import rgb
from sd2core.mesh.sequence import MeshSequence
from sd2core.mesh.things import Surface
from sd2core.mesh.walls import Wall

PERSON_COLOURS = ("#d08a3c", "#5f9e6e", "#9b74b3", "#c4627c", "#4f98ad")
"""Of the second person of a scene, the third and so on; from the sixth they repeat."""


class People(Movables):
    """Bodies beside the first one, one of which may be lit up or shifted while it is dragged."""

    def __init__(self, renderer: vtkRenderer) -> None:
        super().__init__(renderer)
        self.meshes: tuple[MeshSequence, ...] = ()
        self._shapes: list[Body] = []
        self._present: list[bool] = []
        self._limb_colours: Sequence[str] = ()
        self._limbs: Sequence[NDArray[np.intp] | None] = ()
        self._frame: int | None = None

    @property
    def points_m(self) -> NDArray[np.float64]:
        """All vertices of those that are there, (n, 3)."""
        return np.concatenate([np.zeros((0, 3)), *(one.points for one in self._shown())])

    def set_meshes(self, meshes: tuple[MeshSequence, ...], frame: int, floor_m: float) -> None:
        """Show others, in one of their frames."""
        for shape in self._shapes:
            self._renderer.RemoveActor(shape.actor)
            self._renderer.RemoveActor(shape.shadow)
        self.meshes, self._hot, self._shapes, self._frame = meshes, None, [], None
        for mesh in meshes:
            shape = Body(self._renderer)
            shape.set_topology(mesh.frame(frame), mesh.faces)
            shape.set_floor(floor_m)
            self._shapes.append(shape)
        self.show_frame(frame)
        if self._colours is not None:
            self.set_colours(self._colours)

    def show_frame(self, frame: int, shown: bool = True) -> None:
        """Move all to another frame; nobody is drawn unless ``shown``."""
        self._present = [shown and bool(mesh.presence.present[frame]) for mesh in self.meshes]
        for mesh, shape, present in zip(self.meshes, self._shapes, self._present, strict=True):
            shape.show(present)
            if present and frame != self._frame:
                shape.set_vertices(mesh.frame(frame))
        self._frame = frame if shown else None

    def set_limbs(self, colours: Sequence[str], limbs: Sequence[NDArray[np.intp]]) -> None:
        """Colour limbs of some: of each the number of a colour by vertex, from 1, or 0."""
        self._limb_colours, self._limbs = colours, limbs
        if self._colours is not None:
            self.set_colours(self._colours)

    def vertex_near(self, number: int, place_m: NDArray[np.float64]) -> int:
        """Vertex of one that is nearest to a place."""
        return int(np.linalg.norm(self._shapes[number].points - place_m, axis=1).argmin())

    def shift(self, number: int, offset_m: ArrayLike) -> None:
        """Draw one elsewhere than it is."""
        self._shapes[number].place(np.eye(3), np.asarray(offset_m, np.float64))

    def set_colours(self, colours: SceneColours) -> None:
        """Colours of the theme."""
        self._colours = colours
        for number, shape in enumerate(self._shapes):
            own = PERSON_COLOURS[number % len(PERSON_COLOURS)]
            own = mixed(own, colours.sensor, 0.4 if number == self._hot else 0.0)
            shape.set_colour(own)
            limb = self._limbs[number] if number < len(self._limbs) else None
            if limb is not None and len(limb) == len(shape.points):
                shades = np.stack([rgb(shade) for shade in (own, *self._limb_colours)])
                shape.set_point_colours(shades[limb].astype(np.uint8))
            else:
                shape.clear_point_colours()
            shape.shadow.GetProperty().SetColor(*fractions(colours.shadow))

    def _to_meet(self) -> Sequence[Surface | None]:
        return [
            (shape.points.astype(np.float64), mesh.faces)
            if present and mesh.faces is not None
            else None
            for mesh, shape, present in zip(self.meshes, self._shapes, self._present, strict=True)
        ]

    def _shown(self) -> list[Body]:
        return [one for one, present in zip(self._shapes, self._present, strict=True) if present]


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
    lines = np.stack([steps, steps], axis=1)
    flat = np.concatenate([np.stack([lines, rim], axis=2), np.stack([rim, lines], axis=2)])
    ends = flat.reshape(-1, 2)
    points = middle + ends[:, :1] * across + ends[:, 1:] * along
    segments = np.arange(len(points), dtype=np.int32).reshape(-1, 2)
    first, last = 0, 2 * _CELLS  # the outermost lines one way
    corners = [[first, first + 1, last + 1], [first, last + 1, last]]
    return points, segments, np.array(corners, np.int32)
