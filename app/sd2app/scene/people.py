"""Other bodies of a scene: each a lit surface in a colour of its own, found by a ray."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray
from vtkmodules.vtkRenderingCore import vtkRenderer

from sd2app.scene.colours import SceneColours, fractions, mixed
from sd2app.scene.parts import Body
from sd2app.scene.things import Movables
from sd2core.figures.colours import rgb
from sd2core.mesh.sequence import MeshSequence
from sd2core.mesh.things import Surface

PERSON_COLOURS = ("#d08a3c", "#5f9e6e", "#9b74b3", "#c4627c", "#4f98ad")
"""Of the second person of a scene, the third and so on; from the sixth they repeat."""


class People(Movables):
    """Bodies beside the first one, one of which may be lit up or shifted while it is dragged."""

    def __init__(self, renderer: vtkRenderer) -> None:
        super().__init__(renderer)
        self.meshes: tuple[MeshSequence, ...] = ()
        self._shapes: list[Body] = []
        self._there: list[bool] = []
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
        self._there = [shown and bool(mesh.presence.there[frame]) for mesh in self.meshes]
        for mesh, shape, there in zip(self.meshes, self._shapes, self._there, strict=True):
            shape.show(there)
            if there and frame != self._frame:
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
            if there and mesh.faces is not None
            else None
            for mesh, shape, there in zip(self.meshes, self._shapes, self._there, strict=True)
        ]

    def _shown(self) -> list[Body]:
        return [one for one, there in zip(self._shapes, self._there, strict=True) if there]
