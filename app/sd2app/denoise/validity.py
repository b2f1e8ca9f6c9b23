"""Validity of maps: current or of an earlier sensor."""

from __future__ import annotations

from PySide6.QtCore import QObject, Signal

from sd2app.denoise.model import DenoiseModel
from sd2app.maps.model import SynthesisModel
from sd2app.session.maps import MapModel
from sd2app.session.session import Session


class MapValidity(QObject):
    """Tells which maps are of the sensor's present place; only these two follow the sensor.

    A map stays on screen until there is a better one, also when the sensor has moved on.
    """

    changed = Signal()

    def __init__(
        self, session: Session, synthesis: SynthesisModel, denoise: DenoiseModel, parent: QObject
    ) -> None:
        super().__init__(parent)
        self._maps, self._synthesis, self._denoise = session.maps, synthesis, denoise
        for signal in (
            session.sensor.changed,
            synthesis.moving_changed,
            synthesis.completed,
            synthesis.painted,
        ):
            signal.connect(self.changed)

    def is_current(self, track: MapModel) -> bool:
        """True while a map is of the current sensor and the sensor is not dragged."""
        rests = not self._synthesis.moving and self._synthesis.shows_sensor
        if track is self._maps.synthetic:
            return rests
        if track is self._maps.denoised:
            return rests and self._denoise.map.shows_source
        return True
