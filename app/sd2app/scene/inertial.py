"""Inertial sensors and parts of the bodies in the scene, named under the pointer; no VTK."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QMenu

from sd2app.imu.model import ImuModel, place_words
from sd2app.scene.navigation import Navigator
from sd2app.scene.scene import Scene
from sd2app.session.maps import colours_of, part_words
from sd2app.session.session import Session
from sd2core.maps import OF
from sd2core.mesh.vertex_parts import VertexParts

if TYPE_CHECKING:
    # The view alone loads no kernels.
    from sd2app.maps.limbs import LimbsModel

PLACING_HINT = "A click on the body places an inertial sensor  ·  Esc cancels"
_REACH_PX = 9.0
_THIN_M = 0.05
"""Depth behind the surface at which a marker counts as hidden."""


class InertialHand:
    """Hand on the inertial sensors; places are pixels of the view."""

    def __init__(self, scene: Scene, session: Session, model: ImuModel) -> None:
        self._scene, self._session, self._model = scene, session, model

    @property
    def placing(self) -> bool:
        """True while a click on the body places a sensor."""
        return self._session.placing.active

    def vertex_at(self, x_px: float, y_px: float) -> int | None:
        """Vertex of the surface under the pointer; None beside it."""
        mesh, scene = self._session.document.mesh, self._scene
        if mesh is None or mesh.faces is None or not scene.mesh_shown:
            return None
        hit = scene.pose.foremost((scene.body.points, mesh.faces), x_px, y_px)
        return None if hit is None else hit[1]

    def sensor_at(self, x_px: float, y_px: float) -> str | None:
        """Place of the sensor whose marker is under the pointer, the nearest to it."""
        points, places = self._scene.inertial.points, list(self._model.vertices)
        if not self._scene.mesh_shown or not len(points) or len(points) != len(places):
            return None
        pose = self._scene.pose
        nearest = pose.nearest(points, x_px, y_px, _REACH_PX)
        if nearest is None:
            return None
        front = self.vertex_at(x_px, y_px)
        if front is not None:  # it may be on the far side
            front_m, marker_m = pose.project([self._scene.body.points[front], points[nearest]])[
                :, 2
            ]
            if marker_m > front_m + _THIN_M:
                return None
        return places[nearest]

    def words_at(self, x_px: float, y_px: float) -> str:
        """Sensor under the pointer, or the one that a click would place, in words."""
        if self.placing:
            vertex = self.vertex_at(x_px, y_px)
            place = None if vertex is None else self._model.place_at(vertex)
        else:
            place = self.sensor_at(x_px, y_px)
        return "" if place is None else f"inertial sensor at {place_words(place)}"

    def click(self, x_px: float, y_px: float) -> None:
        """Place a sensor if one is to be placed, and the body is there."""
        vertex = self.vertex_at(x_px, y_px) if self.placing else None
        if vertex is not None:
            self._model.place(vertex)

    def offer(self, menu: QMenu, x_px: float, y_px: float) -> bool:
        """Offer in a context menu what can be done at a place; False where nothing can."""
        model, sensor = self._model, self.sensor_at(x_px, y_px)
        if sensor is not None:
            if sensor != model.current:
                menu.addAction(f"S&how sensor at {place_words(sensor)}", lambda: model.show(sensor))
            menu.addAction(
                f"&Remove inertial sensor at {place_words(sensor)}", lambda: model.remove(sensor)
            )
            return True
        vertex = self.vertex_at(x_px, y_px)
        if vertex is None:
            return False
        words = place_words(model.place_at(vertex))
        menu.addAction(f"Place &inertial sensor at {words}", lambda: model.place(vertex))
        return True


LIMB_HINT = "Click shows its Doppler alone  ·  Ctrl or Shift: several"
_SEVERAL = Qt.KeyboardModifier.ControlModifier | Qt.KeyboardModifier.ShiftModifier


class LimbHand:
    """Hand on the parts of the bodies; places are pixels of the view."""

    def __init__(
        self, scene: Scene, navigator: Navigator, surface: InertialHand, model: LimbsModel
    ) -> None:
        self._scene, self._navigator, self._surface = scene, navigator, surface
        self._model = model

    def part_at(self, x_px: float, y_px: float) -> str | None:
        """Part of a body under the pointer; None beside it, and where that is not known."""
        target = self._navigator.target
        if target is None:
            vertex = self._surface.vertex_at(x_px, y_px)
            return None if vertex is None else self._model.part_of(vertex)
        other = self._scene.movables.person_of(target.number)
        if target.kind != "movable" or other is None:
            return None
        return self._model.part_of(target.vertex, other + 1)

    def click(self, x_px: float, y_px: float, keys: Qt.KeyboardModifier) -> None:
        """Choose the part under the pointer, or with nothing there everybody."""
        self._model.pick(self.part_at(x_px, y_px), adds=bool(keys & _SEVERAL))

    def show(self) -> None:
        """Colour the chosen parts."""
        chosen = self._model.parts
        known = self._model.vertex_parts if chosen else None
        if known is None:
            self._scene.set_limbs((), ())
            return
        persons = self._model.persons or ("",)
        self._scene.set_limbs(
            tuple((part_words(one), colour) for one, colour in colours_of(chosen).items()),
            [
                _chosen_of(parts, person, chosen)
                for parts, person in zip((known, *known.others), persons, strict=False)
            ],
        )


def _chosen_of(parts: VertexParts, person: str, chosen: Sequence[str]) -> NDArray[np.intp]:
    """Which of the chosen parts, from 1, each vertex of a person belongs to; 0: none of them."""
    limb = np.zeros(len(parts.names), np.intp)
    for number, part in enumerate(chosen, start=1):
        of, _, own = part.rpartition(OF)
        if part == person:
            limb[:] = number
        elif of == person and own in parts.names:
            limb[parts.names.index(own)] = number
    return limb[parts.numbers]
