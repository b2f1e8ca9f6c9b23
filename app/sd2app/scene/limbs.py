"""Parts of the body in the scene: named under the pointer, chosen by a click; no VTK."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from PySide6.QtCore import Qt

from sd2app.scene.inertial import InertialHand
from sd2app.scene.scene import Scene
from sd2app.session.limbs import colours_of, part_words
from sd2core.maps import OF

if TYPE_CHECKING:
    # The view alone loads no kernels.
    from sd2app.maps.limbs import LimbsModel

LIMB_HINT = "Click shows its Doppler alone  ·  Ctrl or Shift: several"
_SEVERAL = Qt.KeyboardModifier.ControlModifier | Qt.KeyboardModifier.ShiftModifier


class LimbHand:
    """What the pointer does to the parts of the body; places are pixels of the view."""

    def __init__(self, scene: Scene, surface: InertialHand, model: LimbsModel) -> None:
        self._scene, self._surface, self._model = scene, surface, model

    def part_at(self, x_px: float, y_px: float) -> str | None:
        """Part of the body under the pointer; None beside it, and where that is not known."""
        vertex = self._surface.vertex_at(x_px, y_px)
        return None if vertex is None else self._model.part_of(vertex)

    def words_at(self, x_px: float, y_px: float) -> str:
        """Part of the body under the pointer, in words."""
        part = self.part_at(x_px, y_px)
        return "" if part is None else part_words(part)

    def click(self, x_px: float, y_px: float, keys: Qt.KeyboardModifier) -> None:
        """Choose the part under the pointer, or with nothing there the whole body."""
        self._model.pick(self.part_at(x_px, y_px), adds=bool(keys & _SEVERAL))

    def show(self) -> None:
        """Colour the chosen parts."""
        chosen = self._model.parts
        known = self._model.vertex_parts if chosen else None
        if known is None:
            self._scene.change_colours(limbs=(), vertex_limb=None)
            return
        first = "".join(self._model.persons[:1])
        limb = np.zeros(len(known.names), np.intp)
        for number, part in enumerate(chosen, start=1):
            person, _, own = part.rpartition(OF)
            if part == first:
                limb[:] = number
            elif person == first and own in known.names:
                limb[known.names.index(own)] = number
        self._scene.change_colours(
            limbs=tuple((part_words(one), colour) for one, colour in colours_of(chosen).items()),
            vertex_limb=limb[known.numbers],
        )
