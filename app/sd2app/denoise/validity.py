"""Validity of maps: current or of an earlier sensor."""

from __future__ import annotations

from PySide6.QtCore import QObject, Signal

from sd2app.denoise.model import DenoiseModel
from sd2app.maps.model import SynthesisModel
from sd2app.session.maps import MapModel
from sd2app.session.sensor import SensorModel


class MapValidity(QObject):
    """Tells which maps are of the sensor's present place; only these two follow the sensor.

    A map stays on screen until there is a better one, also when the sensor has moved on.
    """

    changed = Signal()

    def __init__(
        self,
        sensor: SensorModel,
        synthesis: SynthesisModel,
        denoise: DenoiseModel,
        synthetic: MapModel,
        denoised: MapModel,
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self._synthesis, self._denoise = synthesis, denoise
        self._synthetic, self._denoised = synthetic, denoised
        for signal in (sensor.changed, synthesis.moving_changed, synthesis.completed):
            signal.connect(self.changed)
        synthesis.painted.connect(lambda _: self.changed.emit())

    def is_current(self, track: MapModel) -> bool:
        """True while a map is of the current sensor and the sensor is not dragged."""
        if track is self._synthetic:
            return self._rests
        if track is self._denoised:
            return self._rests and self._denoise.map.shows_source
        return True

    @property
    def _rests(self) -> bool:
        return not self._synthesis.moving and self._synthesis.shows_sensor
