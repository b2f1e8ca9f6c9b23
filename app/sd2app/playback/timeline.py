"""The time axis under the tracks, and the whole recording at a glance."""

from __future__ import annotations

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QMouseEvent, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QWidget

from sd2app.session.display import DisplayModel
from sd2app.session.playback import PlaybackModel
from sd2app.session.time_window import TimeWindow
from sd2app.widgets.time_axis import (
    GUTTER_PX,
    MARGIN_PX,
    TimeScale,
    clock_text,
    tick_step,
    ticks,
)


class TimeRuler(QWidget):
    """Seconds under the tracks; click or drag seeks."""

    def __init__(
        self,
        span: TimeWindow,
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
        """Paint a bracket around the repeated time range."""
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
        """Seek."""
        self._playback.seek(self.scale.time_of(event.position().x()))
