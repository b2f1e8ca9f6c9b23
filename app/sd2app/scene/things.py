"""Things and other people in the scene, found by the pointer."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray
from vtkmodules.vtkFiltersCore import vtkFeatureEdges
from vtkmodules.vtkRenderingCore import vtkRenderer

from sd2app.palette import Palette
from sd2app.scene.camera import EyePose, Surface
from sd2app.scene.colours import fractions, mixed
from sd2app.scene.parts import Body, Shape
from sd2core.figures.colours import rgb
from sd2core.mesh.sequence import MeshSequence
from sd2core.mesh.things import Thing
from sd2core.mesh.walls import Wall

_OPACITY = 0.38
_SHARP_DEG = 25.0


class ThingShapes:
    """A thing, grey and translucent, with its edges."""

    def __init__(self, renderer: vtkRenderer, thing: Thing, surface: Surface) -> None:
        self.thing, self.surface, self.present = thing, surface, True
        vertices, faces = surface
        self.points = vertices
        self._face = Shape(renderer, vertices, triangles=faces, lit=True)
        self._face.look.SetInterpolationToFlat()
        self._face.look.SetOpacity(_OPACITY)
        sharp = vtkFeatureEdges()  # where it bends or ends
        sharp.SetInputData(self._face.data)
        sharp.SetFeatureAngle(_SHARP_DEG)
        sharp.ColoringOff()
        self._edge = Shape(renderer)
        self._edge.actor.GetMapper().SetInputConnection(sharp.GetOutputPort())
        self.shapes = self._face, self._edge
        self.actors = tuple(shape.actor for shape in self.shapes)

    def place(self, linear: NDArray[np.float64], offset: NDArray[np.float64]) -> None:
        """Draw it elsewhere than it is."""
        for shape in self.shapes:
            shape.place(linear, offset)

    def set_colours(self, colours: Palette, hot: bool) -> None:
        """Colours of the theme; ``hot`` while the pointer is on it or drags it."""
        self._face.set_colour(mixed(colours.plain, colours.accent, 0.35 if hot else 0.0))
        faint = mixed(colours.muted, colours.backdrop, 0.2)
        self._edge.set_colour(colours.accent if hot else faint)


class Movables:
    """Things, then people beside the first one, by their numbers.

    The pointer finds one, which is lit up while it is on it or drags it.
    """

    def __init__(self, renderer: vtkRenderer, colours: Palette) -> None:
        self._renderer, self._colours = renderer, colours
        self.things: tuple[ThingShapes, ...] = ()
        self.people: tuple[Person, ...] = ()
        self._hot: int | None = None

    @property
    def _all(self) -> tuple[ThingShapes | Person, ...]:
        return *self.things, *self.people

    @property
    def points_m(self) -> NDArray[np.float64]:
        """All vertices of those that are there, (n, 3)."""
        return np.concatenate([np.zeros((0, 3)), *(one.points for one in self._all if one.present)])

    def set_things(self, surfaces: Sequence[Surface], things: Sequence[Thing]) -> None:
        """Show other things, which have these surfaces."""
        self._remove(self.things)
        self.things = tuple(
            ThingShapes(self._renderer, thing, surface)
            for thing, surface in zip(things, surfaces, strict=True)
        )
        self.set_colours(self._colours)

    def set_people(self, meshes: Sequence[MeshSequence], frame: int, floor_m: float) -> None:
        """Show other people, in one of their frames."""
        self._remove(self.people)
        self.people = tuple(
            Person(self._renderer, mesh, number, frame, floor_m)
            for number, mesh in enumerate(meshes)
        )
        self.set_colours(self._colours)

    def _remove(self, gone: Sequence[ThingShapes | Person]) -> None:
        self._hot = None
        for one in gone:
            for actor in one.actors:
                self._renderer.RemoveActor(actor)

    def person_of(self, number: int) -> int | None:
        """Number of a person among the people, from 0; None of a thing."""
        return number - len(self.things) if number >= len(self.things) else None

    def under(
        self, pose: EyePose, x_px: float, y_px: float
    ) -> tuple[int, int, NDArray[np.float64]] | None:
        """Number of the foremost at a pixel, its vertex and the place there; None beside all."""
        met = [
            (*hit, number)
            for number, one in enumerate(self._all)
            if one.surface is not None and (hit := pose.foremost(one.surface, x_px, y_px))
        ]
        if not met:
            return None
        depth, vertex, number = min(met)
        return number, vertex, pose.position + depth * pose.ray(x_px, y_px)

    def shift(self, number: int, offset_m: ArrayLike) -> None:
        """Draw one elsewhere than it is."""
        self._all[number].place(np.eye(3), np.asarray(offset_m, np.float64))

    def set_hot(self, number: int | None) -> None:
        """Light up the one that the pointer is on or drags."""
        if number != self._hot:
            self._hot = number
            self.set_colours(self._colours)

    def set_colours(self, colours: Palette) -> None:
        """Colours of the theme."""
        self._colours = colours
        for number, one in enumerate(self._all):
            one.set_colours(colours, number == self._hot)


PERSON_COLOURS = ("#d08a3c", "#5f9e6e", "#9b74b3", "#c4627c", "#4f98ad")
"""Of the second person of a scene, the third and so on; from the sixth they repeat."""


class Person(Body):
    """A body beside the first one."""

    def __init__(
        self, renderer: vtkRenderer, mesh: MeshSequence, number: int, frame: int, floor_m: float
    ) -> None:
        super().__init__(renderer)
        self.mesh, self.actors = mesh, (self.actor, self.shadow)
        self._own_colour = PERSON_COLOURS[number % len(PERSON_COLOURS)]
        self._limb_colours: Sequence[str] = ()
        self._limb: NDArray[np.intp] | None = None
        self._frame: int | None = None
        self.present = False
        self.set_topology(mesh.frame(frame), mesh.faces)
        self.set_floor(floor_m)
        self.show_frame(frame)

    @property
    def surface(self) -> Surface | None:
        """Vertices and faces as they are drawn; None where nothing can be met."""
        faces = self.mesh.faces
        return (self.points, faces) if self.present and faces is not None else None

    def show_frame(self, frame: int, shown: bool = True) -> None:
        """Move to another frame; nobody is drawn unless ``shown``."""
        self.present = shown and bool(self.mesh.presence.present[frame])
        self.show(self.present)
        if self.present and frame != self._frame:
            self.set_points(self.mesh.frame(frame))
        self._frame = frame if shown else None

    def set_limbs(self, colours: Sequence[str], limb: NDArray[np.intp] | None) -> None:
        """Colour limbs: the number of a colour by vertex, from 1, or 0; None: no limb."""
        self._limb_colours, self._limb = colours, limb

    def set_colours(self, colours: Palette, hot: bool) -> None:
        """Colours of the theme; ``hot`` while the pointer is on it or drags it."""
        own = mixed(self._own_colour, colours.accent, 0.4 if hot else 0.0)
        self.set_colour(own)
        if self._limb is not None and len(self._limb) == len(self.points):
            shades = np.stack([rgb(shade) for shade in (own, *self._limb_colours)])
            self.set_point_colours(shades[self._limb].astype(np.uint8))
        else:
            self.clear_point_colours()
        self.shadow.GetProperty().SetColor(*fractions(colours.shadow))


_BODY_OPACITY = 0.12
_CELLS, _CELL_M = 8, 0.5


class Walls:
    """Pieces of planes; nothing is picked of them."""

    def __init__(self, renderer: vtkRenderer, colours: Palette) -> None:
        self._renderer, self._colours = renderer, colours
        self.shapes: list[Shape] = []

    def set_walls(self, walls: Sequence[Wall], around_m: NDArray[np.float64]) -> None:
        """Show other walls, each about the foot of the perpendicular from a point."""
        for shape in self.shapes:
            self._renderer.RemoveActor(shape.actor)
        self.shapes = []
        for wall in walls:
            points, segments, triangles = grid_on(wall, around_m)
            face = Shape(self._renderer, points, triangles=triangles)
            face.look.SetOpacity(_BODY_OPACITY)
            face.look.LightingOff()
            lines = Shape(self._renderer, points, segments=segments)
            lines.look.SetOpacity(0.3)
            self.shapes += [face, lines]
        self.set_colours(self._colours)

    def set_colours(self, colours: Palette) -> None:
        """Colours of the theme."""
        self._colours = colours
        for shape in self.shapes:
            shape.set_colour(mixed(colours.muted, colours.accent, 0.25))


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
