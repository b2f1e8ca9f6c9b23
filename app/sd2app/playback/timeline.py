"""The time axis under the tracks, and the whole recording at a glance."""

from __future__ import annotations

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QMouseEvent, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QWidget

from sd2app.labels.model import LabelsModel
from sd2app.labels.painting import paint_strip
from sd2app.maps.map_widget import MapWidget, paint_cursor
from sd2app.session.display import DisplayModel
from sd2app.session.playback import PlaybackModel
from sd2app.session.time_window import VisibleSpanModel
from sd2app.session.tracks import TrackModel
from sd2app.widgets.time_axis import GUTTER_PX, MARGIN_PX, TimeScale, clock_text, tick_step, ticks

_EDGE_PX = 6
_LABELS_PX = 4.0


class TimeRuler(QWidget):
    """Seconds under the tracks; click or drag seeks."""

    def __init__(
        self,
        span: VisibleSpanModel,
        playback: PlaybackModel,
        display: DisplayModel,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self._span = span
        self._playback = playback
        self._display = display
        self.setFixedHeight(24)
        for signal in (
            span.changed,
            playback.frame_changed,
            playback.stretch_changed,
            display.theme_changed,
        ):
            signal.connect(self.update)

    @property
    def scale(self) -> TimeScale:
        """Time axis of this widget."""
        return TimeScale(self._span.start_s, self._span.end_s, self.width())

    def paintEvent(self, event: QPaintEvent) -> None:
        """Ticks with times, and the cursor."""
        with QPainter(self) as painter:
            self._paint(painter)

    def _paint(self, painter: QPainter) -> None:
        colours, scale = self._display.palette, self.scale
        painter.fillRect(self.rect(), QColor(colours.panel))
        self._paint_stretch(painter, scale)
        most = max(int(scale.plot_width_px / 80), 1)
        step = tick_step(self._span.duration_s, most)
        decimals = 0 if step >= 1 else (1 if step >= 0.1 else 2)
        painter.setPen(QColor(colours.muted))
        for time_s in ticks(self._span.start_s, self._span.end_s, most):
            x = scale.x_of(time_s)
            painter.drawLine(QPointF(x, 0), QPointF(x, 4))
            box = QRectF(x - 40, 4, 80, self.height() - 4)
            if box.right() - 20 < self.width():
                painter.drawText(box, Qt.AlignmentFlag.AlignCenter, clock_text(time_s, decimals))
        x = scale.x_of(self._playback.time_s)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(colours.accent))
        painter.drawPolygon([QPointF(x - 5, 0), QPointF(x + 5, 0), QPointF(x, 7)])

    def _paint_stretch(self, painter: QPainter, scale: TimeScale) -> None:
        """A bracket around what is played again and again."""
        if self._playback.stretch_s is None:
            return
        left, right = (
            min(max(scale.x_of(time_s), GUTTER_PX - 2.0), self.width() - MARGIN_PX + 2.0)
            for time_s in self._playback.stretch_s
        )
        band = QColor(self._display.palette.accent)
        band.setAlpha(60)
        painter.fillRect(QRectF(left, 0, right - left, self.height()), band)
        painter.setPen(QPen(QColor(self._display.palette.accent), 2))
        for x, inwards in ((left + 1, 4), (right - 1, -4)):
            painter.drawPolyline(
                [
                    QPointF(x + inwards, 1),
                    QPointF(x, 1),
                    QPointF(x, self.height() - 1),
                    QPointF(x + inwards, self.height() - 1),
                ]
            )

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Seek."""
        self._playback.seek(self.scale.time_of(event.position().x()))

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Scrub."""
        self._playback.seek(self.scale.time_of(event.position().x()))


class Overview(MapWidget):
    """The whole recording; drag the frame to pan, its edges to zoom."""

    def __init__(
        self,
        track: TrackModel,
        span: VisibleSpanModel,
        playback: PlaybackModel,
        display: DisplayModel,
        labels: LabelsModel,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(track, display, parent)
        self._span = span
        self._playback = playback
        self._labels = labels
        self._grab: tuple[str, float] | None = None
        self.setFixedHeight(40)
        for signal in (span.changed, playback.frame_changed, labels.changed):
            signal.connect(self.update)

    def set_track(self, track: TrackModel) -> None:
        """Show another track."""
        self._track.changed.disconnect(self.invalidate)
        self._track = track
        track.changed.connect(self.invalidate)
        self.invalidate()

    @property
    def scale(self) -> TimeScale:
        """Time axis of this widget: always everything."""
        return TimeScale(*self._span.extent_s, self.width())

    def _plot_rect(self) -> QRectF:
        return QRectF(
            GUTTER_PX,
            2,
            max(self.width() - GUTTER_PX - MARGIN_PX, 1),
            max(self.height() - 6, 1),
        )

    def paintEvent(self, event: QPaintEvent) -> None:
        """Small map, spans, frame of the stretch in view, cursor."""
        with QPainter(self) as painter:
            self._paint(painter)

    def _paint(self, painter: QPainter) -> None:
        colours, scale, plot = self._display.palette, self.scale, self._plot_rect()
        painter.fillRect(self.rect(), QColor(colours.panel))
        painter.setPen(QColor(colours.muted))
        painter.drawText(
            QRectF(0, plot.top(), GUTTER_PX - 8, plot.height()),
            Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter,
            "All",
        )
        if self._track.map is not None:
            self.paint_map(painter, plot, *self._span.extent_s)
            self.paint_gaps(painter, plot, scale)
        strip = QRectF(plot.left(), plot.top(), plot.width(), _LABELS_PX)
        paint_strip(painter, strip, scale, self._labels)
        left, right = scale.x_of(self._span.start_s), scale.x_of(self._span.end_s)
        veil = QColor(colours.panel)
        veil.setAlpha(150)
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
        """Take hold of the frame or one of its edges; elsewhere jump there."""
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
        """Drag what is held."""
        x = event.position().x()
        if self._grab is None:
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
