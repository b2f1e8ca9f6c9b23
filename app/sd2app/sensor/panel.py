"""The sensor in numbers: position, beam, visible share and limits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any, Literal

import numpy as np
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QComboBox, QFormLayout, QGridLayout, QLabel, QWidget

from sd2app.feature import Shell
from sd2app.maps.model import SynthesisModel
from sd2app.sensor.placements import PlacementsModel
from sd2app.session.session import Session
from sd2app.widgets.dialogs import ask_file
from sd2app.widgets.inputs import CheckBox, Choice, NumberBox, action_button, option_box
from sd2app.widgets.layouts import STRETCH, column_of, form_of, grid_of, pane, row_of
from sd2app.widgets.panel import rule, sentence, show_words, title
from sd2core.cli.importing import Content, SensorPlace
from sd2core.errors import Sd2Error
from sd2core.io.beam_files import read_beam
from sd2core.radar_config import RadarConfig, range_in_words
from sd2core.radar_profiles import BEAMS
from sd2core.sensor import (
    Beam,
    VirtualSensor,
    aimed_at,
    position_from_spherical,
    spherical_from_position,
)

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


_CHANNELS: tuple[Literal["receiver", "transmitter"], ...] = ("receiver", "transmitter")
_CLUTTER_TEXT = {
    "regression": "regression over chirps",
    "mean": "mean over chirps",
    "moving": "moving average over frames",
    "none": "keep",
}
_LIMITS: dict[str, tuple[str, Callable[[RadarConfig], str]]] = {
    "λ": ("Wavelength at the centre frequency", lambda radar: f"{1e3 * radar.wavelength_m:.2f} mm"),
    "v max": (
        "Largest unambiguous velocity, λ / 4 T_c",
        lambda radar: f"±{radar.v_max_mps:.2f} m/s",
    ),
    "Δv": ("Velocity resolution", lambda radar: f"{radar.velocity_resolution_mps:.3f} m/s"),
    "ΔR": ("Range resolution, c / 2 B", lambda radar: range_in_words(radar.range_resolution_m, 2)),
    "R max": ("Largest unambiguous range", lambda radar: range_in_words(radar.range_max_m)),
}
"""Limits of a radar: their meaning and value."""


class SensorPanel(QWidget):
    """Type a placement; read range, visible share and limits."""

    def __init__(
        self, session: Session, synthesis: SynthesisModel, placements: PlacementsModel, shell: Shell
    ) -> None:
        super().__init__()
        self.setObjectName("page")
        self._session, self._synthesis, self._placements = session, synthesis, placements
        self._too_far = sentence("", "warning")
        short = ("align", "Find…"), ("aim_sensor", "Aim at body"), ("sensor_to_camera", "To camera")
        find, *buttons = (
            action_button(shell.action(name), text, outlined=True) for name, text in short
        )
        self._capture = self._capture_part(find)
        head = row_of(title("Placement"), STRETCH, *buttons)
        placement = head, self._placement_form(), self._too_far, BeamForm(session, shell.warn)
        seen = title("What it sees"), self._readout_form()
        parts = *placement, rule(), *seen, self._capture, STRETCH
        self.setLayout(column_of(*parts, spacing_px=5, margins_px=(8, 4, 8, 4)))
        session.sensor.changed.connect(self._refresh_placement)
        synthesis.frame_changed.connect(self._refresh_placement)
        synthesis.readout_changed.connect(self._refresh_readout)
        session.document.changed.connect(self._refresh_capture)
        self._refresh_readout()
        self._refresh_capture()

    # --- building -------------------------------------------------------------------------

    def _placement_form(self) -> QGridLayout:
        grid = grid_of(gaps_px=(6, 3), wide=(1, 3))
        self._xyz = [
            NumberBox(-2000.0, 2000.0, " m", f"Sensor position, {axis}: {meaning}")
            for axis, meaning in (("x", "to the right"), ("y", "down"), ("z", "forward"))
        ]
        self._spherical = [
            option_box(SensorPlace, "range_m", " m", decimals=2, step=0.1),
            option_box(SensorPlace, "azimuth_deg", "°", decimals=1),
            option_box(SensorPlace, "elevation_deg", "°", decimals=1),
        ]
        for left, names, boxes, place in (
            (0, ("x", "y", "z"), self._xyz, self._place_by_xyz),
            (2, ("range", "azim.", "elev."), self._spherical, self._place_by_angles),
        ):
            for line, (name, box) in enumerate(zip(names, boxes, strict=True)):
                label = QLabel(name, self)
                label.setObjectName("muted")
                label.setToolTip(box.toolTip())
                grid.addWidget(label, line, left)
                grid.addWidget(box, line, left + 1)
                box.valueChanged.connect(place)
        return grid

    def _readout_form(self) -> QFormLayout:
        self._torso, self._visible, self._beyond, self._within = (
            _value(self, tip)
            for tip in (
                "Distance from the sensor to the body's median vertex",
                "Share of the vertices that the sensor sees in this frame",
                "Share of what the sensor sees in this frame that is faster than the axis",
                "Share of this frame's echo from within the cone of the beam's half power",
            )
        )
        self._beyond_name = QLabel(self)
        self._expected = CheckBox(
            "expected map", self,
            lambda on: self._session.edits.choose_count("expected" if on else "plain"),
            "Spread each vertex as badly as its velocity is known; otherwise it counts in one bin",
        )  # fmt: skip
        self._readouts = form = _form_of(
            ("Range to torso", self._torso),
            ("Visible", self._visible),
            (self._beyond_name, self._beyond),
            ("In the beam", self._within),
            ("Counting", self._expected),
        )
        return form

    def _capture_part(self, find: QWidget) -> QWidget:
        edits = self._session.edits
        self._capture_title, self._radar_name = title("Radar capture"), sentence("")
        self._offset = option_box(Content, "radar_offset_s", " s", decimals=3, step=0.01)
        self._offset.valueChanged.connect(edits.set_radar_offset)
        self._clutter = Choice(
            "How echoes that do not move are removed", self, _CLUTTER_TEXT, edits.set_clutter
        )
        self._clutter.setMinimumContentsLength(8)
        self._clutter.setSizeAdjustPolicy(
            QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon
        )
        offset = pane(row_of((self._offset, 1), find, spacing_px=6, margins_px=0))
        self._channels = {
            of: Choice(f"{of.capitalize()} whose signal is shown", self) for of in _CHANNELS
        }
        for of, choice in self._channels.items():
            choice.currentIndexChanged.connect(
                lambda place, of=of: edits.change(f"Choose {of}", {f"radar_{of}": place or None})
            )
        channels = [(of.capitalize(), choice) for of, choice in self._channels.items()]
        self._capture_form = form = _form_of(
            ("Offset", offset), ("Clutter", self._clutter), *channels
        )
        limits = grid_of(gaps_px=(12, 3), wide=(1, 3))
        self._limits = {name: _value(self, tip) for name, (tip, _) in _LIMITS.items()}
        for place, (name, label) in enumerate(self._limits.items()):
            line, left = divmod(place, 2)
            limits.addWidget(QLabel(name, self), line, 2 * left)
            limits.addWidget(label, line, 2 * left + 1)
        self._warning = sentence("", "warning")
        return pane(
            *(rule(), self._capture_title, self._radar_name, form, limits, self._warning),
            spacing_px=5,
        )

    # --- typing ---------------------------------------------------------------------------

    def _place_by_xyz(self) -> None:
        x, y, z = (box.value() for box in self._xyz)
        now = self._session.sensor.sensor
        if not np.allclose((x, y, z), now.position_m, rtol=0, atol=5e-3):
            self._session.edits.place_sensor(replace(now, position_m=(x, y, z)))

    def _place_by_angles(self) -> None:
        target = self._synthesis.torso_m
        if target is None:
            return
        sensor = self._session.sensor.sensor
        range_m, azimuth_deg, elevation_deg = wanted = [box.value() for box in self._spherical]
        now = spherical_from_position(target, sensor.position_m)
        if not np.allclose(wanted, now, rtol=0, atol=(5e-3, 0.05, 0.05)):
            position = position_from_spherical(target, range_m, azimuth_deg, elevation_deg)
            self._session.edits.place_sensor(aimed_at(replace(sensor, position_m=position), target))

    # --- showing --------------------------------------------------------------------------

    def _refresh_placement(self) -> None:
        position, target = self._session.sensor.sensor.position_m, self._synthesis.torso_m
        for box, value in zip(self._xyz, position, strict=True):
            box.show_value(value)
        for box in self._spherical:
            box.setEnabled(target is not None)
        if target is not None:
            spherical = spherical_from_position(target, position)
            for box, value in zip(self._spherical, spherical, strict=True):
                box.show_value(value)
            self._mark_range(float(spherical[0]))
        else:
            self._mark_range(0.0)

    def _mark_range(self, range_m: float) -> None:
        """Mark a range at which the radar in use sees the body elsewhere."""
        radar = self._placements.radar
        too_far = range_m > radar.range_max_m
        self._spherical[0].mark(too_far)
        words = (
            f"{range_m:.2f} m is beyond R max of {radar.name}, {radar.range_max_m:.1f} m: it would"
            " see the body at another range."
        )
        show_words(self._too_far, words if too_far else "")

    def _refresh_readout(self) -> None:
        readout, texts = self._synthesis.readout(), ("–", "–", "–")
        if readout is not None:
            texts = (
                f"{readout.torso_range_m:.2f} m",
                f"{100 * readout.visible_share:.1f} %",
                f"{100 * readout.beyond_share:.1f} %",
            )
        self._beyond_name.setText(f"Beyond ±{self._synthesis.v_max_mps:g} m/s")
        for label, text in zip((self._torso, self._visible, self._beyond), texts, strict=True):
            label.setText(text)
        share = None if readout is None else readout.share_in_beam
        self._readouts.setRowVisible(self._within, self._session.sensor.sensor.beam is not None)
        self._within.setText("–" if share is None else f"{100 * share:.0f} % of the echo")

    def _refresh_capture(self) -> None:
        self._refresh_placement()
        document = self._session.document
        self._expected.show_checked(document.count == "expected")
        stated = document.mesh is not None and document.mesh.uncertainty is not None
        self._readouts.setRowVisible(self._expected, stated)
        capture, recording, radar_map = document.capture, document.recording, document.radar_map
        self._capture.setVisible(capture is not None)
        if capture is None or recording is None:
            return
        self._capture_title.setText("Simulated radar" if capture.simulated else "Real radar")
        self._radar_name.setText(capture.config.name)
        self._offset.show_value(recording.radar_offset_s)
        self._clutter.show_value(document.clutter)
        config = capture.config
        for of, choice in self._channels.items():
            count, chosen = getattr(config, f"{of}s"), getattr(recording, f"radar_{of}")
            numbers = [str(number) for number in range(1, count + 1)]
            choice.offer(["all (mean power)", *numbers], chosen or 0)
            # A number that this capture does not have can be replaced.
            self._capture_form.setRowVisible(choice, count > 1 or chosen is not None)
        for name, (_, text_of) in _LIMITS.items():
            self._limits[name].setText(text_of(config))
        blind = len(radar_map.unseen_bins) if radar_map is not None else 0
        self._warning.setVisible(blind > 0)
        self._warning.setText(
            f"The axis goes beyond this radar's v max: it cannot see {blind} of the bins."
        )


def _form_of(*rows: tuple[str | QWidget, QWidget]) -> QFormLayout:
    form = form_of(*rows, gaps_px=(12, 3))
    form.setLabelAlignment(Qt.AlignmentFlag.AlignLeft)
    return form


def _value(parent: QWidget, tip: str) -> QLabel:
    label = QLabel("–", parent)
    label.setToolTip(tip)
    label.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
    return label
