"""The Sensor panel: the one sensor, and the places where others are planned."""

from __future__ import annotations

from PySide6.QtWidgets import QVBoxLayout, QWidget

from sd2app.widgets.pages import InnerPage, InnerPages


class SensorPages(QWidget):
    """The sensor, or the placements."""

    def __init__(self, sensor: QWidget, placements: QWidget, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("page")
        self._pages = InnerPages(
            (
                InnerPage("Sensor", "Where the sensor is and what it sees", sensor),
                InnerPage("Placements", "Many places around the body, for a map each", placements),
            ),
            parent=self,
        )
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 6, 0, 0)
        layout.addWidget(self._pages)

    def show_sensor(self) -> None:
        """Show the sensor."""
        self._pages.turn_to(0)

    def show_placements(self) -> None:
        """Show the placements."""
        self._pages.turn_to(1)
