"""The sensor in numbers: position, visible share and limits."""

from __future__ import annotations

from dataclasses import replace

from PySide6.QtCore import QSignalBlocker, Qt
from PySide6.QtGui import QAction
from PySide6.QtWidgets import (
    QComboBox,
    QFormLayout,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from sd2app.maps.model import SynthesisModel
from sd2app.session.content import CLUTTER_CHOICES
from sd2app.session.document import DocumentModel
from sd2app.session.sensor import SensorModel
from sd2app.session.undo import Edits
from sd2app.widgets.inputs import Choice, NumberBox
from sd2app.widgets.panel import rule, title
from sd2core.sensor import aimed_at, position_from_spherical, spherical_from_position

_CLUTTER_TEXT = {
    "mean": "mean over chirps",
    "moving": "moving average over frames",
    "none": "keep",
}


class SensorPanel(QWidget):
    """Type a placement; read range, visible share and limits."""

    def __init__(
        self,
        sensor: SensorModel,
        document: DocumentModel,
        synthesis: SynthesisModel,
        edits: Edits,
        to_camera: QAction,
        aim: QAction,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self.setObjectName("page")
        self._sensor = sensor
        self._document = document
        self._synthesis = synthesis
        self._edits = edits
        layout = QVBoxLayout(self)
        layout.setContentsMargins(8, 4, 8, 4)
        layout.setSpacing(5)
        head = QHBoxLayout()
        head.addWidget(title("Placement"))
        head.addStretch(1)
        for action, text in ((aim, "Aim at body"), (to_camera, "To camera")):
            button = QToolButton(self)
            button.setObjectName("outlined")
            button.setText(text)
            button.setToolTip(action.toolTip())
            button.clicked.connect(action.trigger)
            button.setFocusPolicy(Qt.FocusPolicy.NoFocus)
            button.setEnabled(action.isEnabled())
            action.enabledChanged.connect(button.setEnabled)
            head.addWidget(button)
        layout.addLayout(head)
        layout.addLayout(self._placement_form())
        layout.addWidget(rule())
        layout.addWidget(title("What it sees"))
        layout.addLayout(self._readout_form())
        self._capture = self._capture_part()
        layout.addWidget(self._capture)
        layout.addStretch(1)
        sensor.changed.connect(self._refresh_placement)
        synthesis.frame_changed.connect(self._refresh_placement)
        synthesis.readout_changed.connect(self._refresh_readout)
        document.changed.connect(self._refresh_capture)
        self._refresh_placement()
        self._refresh_readout()
        self._refresh_capture()

    # --- building -------------------------------------------------------------------------

    def _placement_form(self) -> QGridLayout:
        grid = QGridLayout()
        grid.setHorizontalSpacing(6)
        grid.setVerticalSpacing(3)
        self._xyz = [
            NumberBox(-100.0, 100.0, " m", f"Sensor position, {axis}: {meaning}")
            for axis, meaning in (("x", "to the right"), ("y", "down"), ("z", "forward"))
        ]
        self._spherical = [
            NumberBox(0.05, 100.0, " m", "Range: distance from the body's centre"),
            NumberBox(
                -180.0, 180.0, "°",
                "Azimuth: 0° is between body and camera, positive to the right",
                decimals=1, step=1.0,
            ),
            NumberBox(
                -90.0, 90.0, "°", "Elevation: positive is above the body's centre",
                decimals=1, step=1.0,
            ),
        ]  # fmt: skip
        names = (("x", "range"), ("y", "azim."), ("z", "elev."))
        for row, (left, right) in enumerate(names):
            for column, (name, box) in enumerate(
                ((left, self._xyz[row]), (right, self._spherical[row]))
            ):
                label = QLabel(name, self)
                label.setObjectName("muted")
                label.setToolTip(box.toolTip())
                grid.addWidget(label, row, 2 * column)
                grid.addWidget(box, row, 2 * column + 1)
                grid.setColumnStretch(2 * column + 1, 1)
        for box in self._xyz:
            box.valueChanged.connect(self._place_by_xyz)
        for box in self._spherical:
            box.valueChanged.connect(self._place_by_angles)
        return grid

    def _readout_form(self) -> QFormLayout:
        form = _form()
        self._torso = _value(self, "Distance from the sensor to the body's median vertex")
        self._visible = _value(self, "Share of the vertices that the sensor sees in this frame")
        self._beyond = _value(
            self, "Share of what the sensor sees in this frame that is faster than the axis"
        )
        form.addRow("Range to torso", self._torso)
        form.addRow("Visible", self._visible)
        self._beyond_name = QLabel(self)
        form.addRow(self._beyond_name, self._beyond)
        field = _value(self, "The cone is drawn for orientation; every direction counts alike")
        field.setText("drawn, not applied")
        form.addRow("Field of view", field)
        return form

    def _capture_part(self) -> QWidget:
        part = QWidget(self)
        layout = QVBoxLayout(part)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(5)
        layout.addWidget(rule())
        self._capture_title = title("Radar capture")
        layout.addWidget(self._capture_title)
        form = _form()
        self._offset = NumberBox(
            -1e5, 1e5, " s", "Time of the first radar frame here", decimals=3, step=0.01
        )
        self._offset.valueChanged.connect(self._edits.set_radar_offset)
        form.addRow("Offset", self._offset)
        self._clutter = Choice("How echoes that do not move are removed", self)
        for choice in CLUTTER_CHOICES:
            self._clutter.addItem(_CLUTTER_TEXT[choice], choice)
        self._clutter.setMinimumContentsLength(8)
        self._clutter.setSizeAdjustPolicy(
            QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon
        )
        self._clutter.currentIndexChanged.connect(
            lambda _: self._edits.set_clutter(self._clutter.currentData())
        )
        form.addRow("Clutter", self._clutter)
        self._limits = {
            name: _value(self, tip)
            for name, tip in (
                ("λ", "Wavelength at the centre frequency"),
                ("v max", "Largest unambiguous velocity, λ / 4 T_c"),
                ("Δv", "Velocity resolution"),
                ("ΔR", "Range resolution, c / 2 B"),
                ("R max", "Largest unambiguous range"),
            )
        }
        layout.addLayout(form)
        limits = QGridLayout()
        limits.setHorizontalSpacing(12)
        limits.setVerticalSpacing(3)
        for place, (name, label) in enumerate(self._limits.items()):
            row, column = divmod(place, 2)
            limits.addWidget(QLabel(name, self), row, 2 * column)
            limits.addWidget(label, row, 2 * column + 1)
            limits.setColumnStretch(2 * column + 1, 1)
        layout.addLayout(limits)
        self._warning = QLabel(part)
        self._warning.setObjectName("warning")
        self._warning.setWordWrap(True)
        layout.addWidget(self._warning)
        return part

    # --- typing ---------------------------------------------------------------------------

    def _place_by_xyz(self) -> None:
        x, y, z = (box.value() for box in self._xyz)
        now = self._sensor.sensor
        if any(abs(a - b) > 5e-3 for a, b in zip((x, y, z), now.position_m, strict=True)):
            self._edits.place_sensor(replace(now, position_m=(x, y, z)))

    def _place_by_angles(self) -> None:
        target = self._synthesis.torso_m
        if target is None:
            return
        range_m, azimuth_deg, elevation_deg = wanted = [box.value() for box in self._spherical]
        now = spherical_from_position(target, self._sensor.sensor.position_m)
        if any(
            abs(a - b) > tolerance
            for a, b, tolerance in zip(wanted, now, (5e-3, 0.05, 0.05), strict=True)
        ):
            position = position_from_spherical(target, range_m, azimuth_deg, elevation_deg)
            moved = replace(self._sensor.sensor, position_m=position)
            self._edits.place_sensor(aimed_at(moved, target))

    # --- showing --------------------------------------------------------------------------

    def _refresh_placement(self) -> None:
        position = self._sensor.sensor.position_m
        target = self._synthesis.torso_m
        for box in self._spherical:
            box.setEnabled(target is not None)
        shown = [*zip(self._xyz, position, strict=True)]
        if target is not None:
            spherical = spherical_from_position(target, position)
            shown += [*zip(self._spherical, spherical, strict=True)]
        for box, value in shown:
            box.show_value(value)
        self._refresh_readout()

    def _refresh_readout(self) -> None:
        readout = self._synthesis.readout()
        self._beyond_name.setText(f"Beyond ±{self._synthesis.v_max_mps:g} m/s")
        for label, text in (
            (self._torso, f"{readout.torso_range_m:.2f} m" if readout else "–"),
            (self._visible, _percent(readout.visible_share) if readout else "–"),
            (self._beyond, _percent(readout.beyond_share) if readout else "–"),
        ):
            label.setText(text)

    def _refresh_capture(self) -> None:
        capture, recording = self._document.capture, self._document.recording
        self._capture.setVisible(capture is not None)
        if capture is None or recording is None:
            return
        kind = "Simulated radar" if capture.simulated else "Real radar"
        self._capture_title.setText(kind)
        self._capture_title.setToolTip(capture.config.name)
        self._offset.show_value(recording.radar_offset_s)
        with QSignalBlocker(self._clutter):
            self._clutter.setCurrentIndex(CLUTTER_CHOICES.index(self._document.clutter))
        config = capture.config
        for name, text in (
            ("λ", f"{1e3 * config.wavelength_m:.2f} mm"),
            ("v max", f"±{config.v_max_mps:.2f} m/s"),
            ("Δv", f"{config.velocity_resolution_mps:.3f} m/s"),
            ("ΔR", f"{config.range_resolution_m:.2f} m"),
            ("R max", f"{config.range_max_m:.1f} m"),
        ):
            self._limits[name].setText(text)
        radar_map = self._document.radar_map
        blind = len(radar_map.unseen_bins) if radar_map is not None else 0
        self._warning.setVisible(blind > 0)
        self._warning.setText(
            f"The axis goes beyond this radar's v max: it cannot see {blind} of the bins."
        )


def _percent(share: float) -> str:
    return f"{100.0 * share:.1f} %"


def _form() -> QFormLayout:
    form = QFormLayout()
    form.setHorizontalSpacing(12)
    form.setVerticalSpacing(3)
    form.setLabelAlignment(Qt.AlignmentFlag.AlignLeft)
    return form


def _value(parent: QWidget, tip: str) -> QLabel:
    label = QLabel("–", parent)
    label.setToolTip(tip)
    label.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
    return label
