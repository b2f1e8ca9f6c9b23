"""The beam of the sensor's antennas, and where it looks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

from PySide6.QtWidgets import QWidget

from sd2app.session.session import Session
from sd2app.widgets.dialogs import ask_file
from sd2app.widgets.inputs import Choice, NumberBox
from sd2app.widgets.layouts import form_of, pane, row_of
from sd2core.errors import Sd2Error
from sd2core.io.beam_files import read_beam
from sd2core.radar_profiles import BEAMS
from sd2core.sensor import Beam, VirtualSensor

_NONE, _WIDTHS, _TABLE = "none", "widths", "table"
_TEXTS = {
    _NONE: "all directions alike",
    _WIDTHS: "by half-power widths",
    **{name: f"{name.upper()}'s board" for name in BEAMS},
    _TABLE: "from a table…",
}
_USUAL = Beam(60.0, 60.0)


class BeamForm(QWidget):
    """Choose a beam, type its widths and where it looks; ``warn`` says why a table is not read."""

    def __init__(self, session: Session, warn: Callable[[str], None]) -> None:
        super().__init__()
        self._session, self._warn = session, warn
        tip = "How the antennas, transmitter and receiver alike, weigh directions"
        self._kind = Choice(tip, self, _TEXTS, self._choose)
        self._widths = [
            NumberBox(1.0, 360.0, unit, f"Full width at half power, {plane}", decimals=1, step=1.0)
            for plane, unit in (("across", "° across"), ("in height", "° high"))
        ]
        self._aims = [
            NumberBox(-low, low, unit, f"Direction of the boresight, {way}", decimals=1, step=1.0)
            for low, way, unit in ((180.0, "to the right", "° right"), (90.0, "upwards", "° up"))
        ]
        for boxes, typed in ((self._widths, self._widen), (self._aims, self._turn)):
            for plane, box in zip(("azimuth", "elevation"), boxes, strict=True):
                box.valueChanged.connect(partial(typed, plane))
        widths, aims = (
            pane(row_of(*boxes, spacing_px=6, margins_px=0)) for boxes in (self._widths, self._aims)
        )
        self._form = form_of(
            ("Beam", self._kind), ("Widths", widths), ("Looks", aims), gaps_px=(12, 3)
        )
        self._form.setContentsMargins(0, 0, 0, 0)
        self._rows = widths, aims
        self.setLayout(self._form)
        session.sensor.changed.connect(self._refresh)
        self._refresh()

    def _choose(self, kind: str) -> None:
        sensor = self._session.sensor.sensor
        now = sensor.beam
        beam = None if kind == _NONE else BEAMS.get(kind, now or _USUAL)
        if kind == _WIDTHS:
            beam = replace(now or _USUAL, cuts=())
        if kind == _TABLE:
            path = ask_file(self, "Table of the beam", "Tables (*.csv *.txt);;All files (*)")
            try:
                beam = now if path is None else read_beam(path)
            except Sd2Error as error:
                beam = now
                self._warn(str(error))
        self._place(replace(sensor, beam=beam), "Set beam")

    def _widen(self, plane: str, width_deg: float) -> None:
        now = self._session.sensor.sensor
        assert now.beam is not None
        typed: dict[str, Any] = {f"{plane}_width_deg": width_deg}
        self._place(replace(now, beam=replace(now.beam, **typed)), "Set beam")

    def _turn(self, plane: str, angle_deg: float) -> None:
        typed: dict[str, Any] = {f"{plane}_deg": angle_deg}
        self._place(replace(self._session.sensor.sensor, **typed), "Turn sensor")

    def _place(self, sensor: VirtualSensor, text: str) -> None:
        self._session.edits.place_sensor(sensor, text)
        self._refresh()

    def _refresh(self) -> None:
        sensor = self._session.sensor.sensor
        beam = sensor.beam
        for row in self._rows:
            self._form.setRowVisible(row, beam is not None)
        if beam is None:
            self._kind.show_value(_NONE)
            return
        named = next((name for name, known in BEAMS.items() if known == beam), _WIDTHS)
        self._kind.show_value(_TABLE if beam.cuts else named)
        for box, width in zip(
            self._widths, (beam.azimuth_width_deg, beam.elevation_width_deg), strict=True
        ):
            box.show_value(width)
            box.setEnabled(not beam.cuts)
        azimuth_deg = (sensor.azimuth_deg + 180.0) % 360.0 - 180.0
        for box, angle in zip(self._aims, (azimuth_deg, sensor.elevation_deg), strict=True):
            box.show_value(angle)
