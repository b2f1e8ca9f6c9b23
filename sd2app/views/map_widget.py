"""What the views that draw a Doppler map over time have in common."""

from __future__ import annotations

from PySide6.QtCore import QPointF, QRectF
from PySide6.QtGui import QColor, QImage, QPainter, QPen, QResizeEvent
from PySide6.QtWidgets import QWidget

from sd2app.models.display import DisplayModel
from sd2app.models.tracks import TrackModel
from sd2app.views.heatmap_image import heatmap_image


class MapWidget(QWidget):
    """Keeps the picture of a map until map, stretch, levels, theme or size change."""

    def __init__(
        self, track: TrackModel, display: DisplayModel, parent: QWidget | None = None
    ) -> None:
        super().__init__(parent)
        self._track = track
        self._display = display
        self._image: QImage | None = None
        self.setMouseTracking(True)
        for signal in (track.changed, display.levels_changed, display.theme_changed):
            signal.connect(self.invalidate)

    def invalidate(self) -> None:
        """Draw the map anew."""
        self._image = None
        self.update()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Draw the map anew for the new number of columns."""
        self.invalidate()

    def paint_map(self, painter: QPainter, plot: QRectF, start_s: float, end_s: float) -> None:
        """The map from ``start_s`` to ``end_s``, one column per device pixel."""
        if self._image is None:
            self._image = heatmap_image(
                self._track,
                self._display.levels,
                start_s,
                end_s,
                max(round(plot.width() * self.devicePixelRatioF()), 1),
                QColor(self._display.palette.well).rgb(),
            )
        painter.drawImage(plot, self._image)


def paint_cursor(painter: QPainter, plot: QRectF, x_px: float) -> None:
    """The line of the time on screen, legible on every colour."""
    top, bottom = QPointF(x_px, plot.top()), QPointF(x_px, plot.bottom())
    for pen in (QPen(QColor(0, 0, 0, 140), 3), QPen(QColor(255, 255, 255), 1)):
        painter.setPen(pen)
        painter.drawLine(top, bottom)
