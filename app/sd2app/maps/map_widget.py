"""Base class of the views that draw a Doppler map over time."""

from __future__ import annotations

from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QBrush, QColor, QImage, QPainter, QResizeEvent
from PySide6.QtWidgets import QWidget

from sd2app.maps.heatmap_image import heatmap_image
from sd2app.session.display import DisplayModel
from sd2app.session.maps import MapModel
from sd2app.widgets.time_axis import TimeScale
from sd2app.widgets.time_plot import TimePlot

_NOBODY = "no person"


class MapWidget(TimePlot):
    """Keeps the picture of a map until map, stretch, levels, theme or size change."""

    def __init__(
        self, track: MapModel, display: DisplayModel, parent: QWidget | None = None
    ) -> None:
        super().__init__(parent)
        self._track = track
        self._display = display
        self._image: QImage | None = None
        self.setMouseTracking(True)
        for signal in (track.changed, display.levels_changed, display.theme_changed):
            signal.connect(self.invalidate)

    def invalidate(self) -> None:
        """Draw the map again."""
        self._image = None
        self.update()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Draw the map again for the new number of columns."""
        self.invalidate()

    def paint_map(self, painter: QPainter, plot: QRectF, start_s: float, end_s: float) -> None:
        """The map from ``start_s`` to ``end_s``, one column per device pixel."""
        if self._image is None:
            columns = max(round(plot.width() * self.devicePixelRatioF()), 1)
            self._image = self.make_image(start_s, end_s, columns)
        painter.drawImage(plot, self._image)

    def make_image(self, start_s: float, end_s: float, columns: int) -> QImage:
        """Image of the time window, one pixel per column and bin."""
        background = QColor(self._display.palette.well).rgb()
        return heatmap_image(self._track, self._display.levels, start_s, end_s, columns, background)

    def paint_gaps(self, painter: QPainter, plot: QRectF, scale: TimeScale) -> None:
        """Hatch the frames without a person."""
        colours = self._display.palette
        painter.save()
        painter.setClipRect(plot)
        for start_s, end_s in self._track.gaps_s:
            left, right = scale.x_of(start_s), scale.x_of(end_s)
            # The narrowest is still seen.
            box = QRectF(left, plot.top(), max(right - left, 1.0), plot.height())
            if not box.intersects(plot):
                continue
            painter.fillRect(box, QColor(colours.well))
            painter.fillRect(box, QBrush(QColor(colours.hatch), Qt.BrushStyle.FDiagPattern))
            self._name_gap(painter, box & plot)
        painter.restore()

    def _name_gap(self, painter: QPainter, box: QRectF) -> None:
        size = painter.fontMetrics().size(Qt.TextFlag.TextSingleLine, _NOBODY)
        if box.width() < size.width() + 24 or box.height() < 2 * size.height():
            return
        label = QRectF(0, 0, size.width() + 12, size.height() + 6)
        label.moveCenter(box.center())
        painter.fillRect(label, QColor(self._display.palette.well))
        painter.setPen(QColor(self._display.palette.muted))
        painter.drawText(label, Qt.AlignmentFlag.AlignCenter, _NOBODY)
