"""Pose of the virtual sensor."""

from __future__ import annotations

from PySide6.QtCore import QObject, Signal

from sd2core.sensor import VirtualSensor


class SensorModel(QObject):
    """Virtual sensor, and a flag while it or a thing is dragged."""

    changed = Signal()
    dragging_changed = Signal(bool)

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.sensor = VirtualSensor()
        self.dragging = False  # true while the sensor or a thing is dragged

    def set_sensor(self, sensor: VirtualSensor) -> None:
        """Place the sensor."""
        if sensor != self.sensor:
            self.sensor = sensor
            self.changed.emit()

    def set_dragging(self, dragging: bool) -> None:
        """Note that a drag began or ended."""
        if dragging != self.dragging:
            self.dragging = dragging
            self.dragging_changed.emit(dragging)
