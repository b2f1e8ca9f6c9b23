"""Narrow map of the whole recording."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QColor, QMouseEvent, QPainter, QPen

from sd2app.maps.heatmap_image import MapWidget
from sd2app.session.maps import MapModel
from sd2app.session.session import Session
from sd2app.widgets.canvas import AT_RIGHT, Overlay, faint
from sd2app.widgets.time_axis import GUTTER_PX, TimeScale, paint_cursor

_EDGE_PX = 6
_LABELS_PX = 4.0


class Overview(MapWidget):
    """The whole recording; drag the frame to pan, its edges to zoom."""

    TOP_PX = 2

    def __init__(self, session: Session, overlays: Sequence[Overlay] = ()) -> None:
        super().__init__(session.maps.synthetic, session, overlays)
        self.setFixedHeight(20)
        self.follow(self._span.changed)

    def set_track(self, track: MapModel) -> None:
        """Show another track."""
        self.track.changed.disconnect(self._redraw_map)
        self.track = track
        track.changed.connect(self._redraw_map)
        self.invalidate()

    @property
    def scale(self) -> TimeScale:
        """Time axis of this widget: always everything."""
        return TimeScale(*self._span.extent_s, self.width())

    def paint(self, painter: QPainter) -> None:
        """Small map, spans, frame around the time window, cursor."""
        colours, scale, plot = self._display.palette, self.scale, self.plot_rect()
        painter.fillRect(self.rect(), QColor(colours.panel))
        painter.setPen(QColor(colours.muted))
        painter.drawText(QRectF(0, plot.top(), GUTTER_PX - 8, plot.height()), AT_RIGHT, "All")
        if self.track.map is not None:
            self.paint_map(painter, plot, *self._span.extent_s)
            self.paint_gaps(painter, plot, scale)
        strip = QRectF(plot.left(), plot.top(), plot.width(), _LABELS_PX)
        for overlay in self._overlays:
            overlay.paint(painter, strip, scale)
        left, right = scale.x_of(self._span.start_s), scale.x_of(self._span.end_s)
        veil = faint(colours.panel, 150)
        painter.fillRect(QRectF(plot.left(), plot.top(), left - plot.left(), plot.height()), veil)
        painter.fillRect(QRectF(right, plot.top(), plot.right() - right, plot.height()), veil)
        painter.setPen(QPen(QColor(colours.accent), 2))
        painter.drawRoundedRect(
            QRectF(left, plot.top(), right - left, plot.height()).adjusted(0, 1, 0, -1), 2, 2
        )
        paint_cursor(painter, plot, scale.x_of(self._playback.time_s))

    def _handle_at(self, x: float) -> str:
        scale = self.scale
        left, right = scale.x_of(self._span.start_s), scale.x_of(self._span.end_s)
        if abs(x - left) <= _EDGE_PX:
            return "left"
        if abs(x - right) <= _EDGE_PX:
            return "right"
        return "pan" if left < x < right else "centre"

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Start to drag the frame or an edge; elsewhere seek."""
        if event.button() != Qt.MouseButton.LeftButton:
            return
        x = event.position().x()
        handle = self._handle_at(x)
        if handle == "centre":
            middle = 0.5 * (self._span.start_s + self._span.end_s)
            self._span.pan(self.scale.time_of(x) - middle)
            handle = "pan"
        if handle == "pan" and self._span.duration_s >= (
            self._span.extent_s[1] - self._span.extent_s[0]
        ):
            handle = "seek"
            self._playback.seek(self.scale.time_of(x))
        self._grab = (handle, x)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Drag the frame or the edge."""
        x = event.position().x()
        if self._grab is None or not event.buttons():
            edge = self._handle_at(x) in ("left", "right")
            self.setCursor(
                Qt.CursorShape.SizeHorCursor if edge else Qt.CursorShape.PointingHandCursor
            )
            return
        handle, last_x = self._grab
        time_s = self.scale.time_of(x)
        if handle == "seek":
            self._playback.seek(time_s)
        elif handle == "pan":
            self._span.pan((x - last_x) * self.scale.seconds_per_px)
        elif handle == "left":
            self._span.set_span(min(time_s, self._span.end_s - 0.2), self._span.end_s)
        else:
            self._span.set_span(self._span.start_s, max(time_s, self._span.start_s + 0.2))
        self._grab = (handle, x)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """Let go."""
        self._grab = None
