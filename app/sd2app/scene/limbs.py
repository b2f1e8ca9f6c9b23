"""Parts of the bodies in the scene: named under the pointer, chosen by a click; no VTK."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import Qt

from sd2app.scene.inertial import InertialHand
from sd2app.scene.navigation import Navigator
from sd2app.scene.scene import Scene
from sd2app.session.limbs import colours_of, part_words
from sd2core.maps import OF
from sd2core.mesh.vertex_parts import VertexParts

if TYPE_CHECKING:
    # The view alone loads no kernels.
    from sd2app.maps.limbs import LimbsModel

LIMB_HINT = "Click shows its Doppler alone  ·  Ctrl or Shift: several"
_SEVERAL = Qt.KeyboardModifier.ControlModifier | Qt.KeyboardModifier.ShiftModifier


class LimbHand:
    """What the pointer does to the parts of the bodies; places are pixels of the view."""

    def __init__(
        self, scene: Scene, navigator: Navigator, surface: InertialHand, model: LimbsModel
    ) -> None:
        self._scene, self._navigator, self._surface = scene, navigator, surface
        self._model = model

    def part_at(self, x_px: float, y_px: float) -> str | None:
        """Part of a body under the pointer; None beside it, and where that is not known."""
        found = self._navigator.thing_at(x_px, y_px)
        if found is None:
            vertex = self._surface.vertex_at(x_px, y_px)
            return None if vertex is None else self._model.part_of(vertex)
        other = self._scene.person_of(found[0])
        if other is None:
            return None
        return self._model.part_of(self._scene.people.vertex_near(other, found[1]), other + 1)

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
