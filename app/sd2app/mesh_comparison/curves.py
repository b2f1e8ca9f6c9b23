"""Velocity of one joint towards the sensor, from both meshes, on the shared time axis."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QMouseEvent, QPainter, QPaintEvent, QPen, QPolygonF
from PySide6.QtWidgets import QWidget

from sd2app.mesh_comparison.model import ComparisonModel
from sd2app.mesh_comparison.pictures import colour_of
from sd2app.session.display import DisplayModel
from sd2app.session.playback import PlaybackModel
from sd2app.session.time_window import TimeWindow
from sd2app.widgets.time_axis import GUTTER_PX, MARGIN_PX, TimeScale, signed_text, ticks
from sd2core.mesh.presence import runs

_TITLE_PX = 24
_LEAST_MPS = 0.2
"""Smallest range of the velocity axis."""


class JointCurves(QWidget):
    """Plot of both velocities; click or drag seeks."""

    def __init__(
        self,
        comparison: ComparisonModel,
        span: TimeWindow,
        playback: PlaybackModel,
        display: DisplayModel,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self._comparison = comparison
        self._span = span
        self._playback = playback
        self._display = display
        self.setMinimumHeight(96)
        self.setCursor(Qt.CursorShape.CrossCursor)
        for signal in (
            comparison.changed,
            span.changed,
            playback.frame_changed,
            display.theme_changed,
        ):
            signal.connect(self.update)

    def sizeHint(self) -> QSize:
        """Width of the maps above."""
        return QSize(640, 140)

    @property
    def scale(self) -> TimeScale:
        """Time axis of this widget."""
        return TimeScale(self._span.start_s, self._span.end_s, self.width())

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Seek."""
        if event.button() == Qt.MouseButton.LeftButton:
            self._playback.seek(self.scale.time_of(event.position().x()))

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Seek."""
        if event.buttons() & Qt.MouseButton.LeftButton:
            self._playback.seek(self.scale.time_of(event.position().x()))

    def paintEvent(self, event: QPaintEvent) -> None:
        """Title, axis, lines, cursor."""
        with QPainter(self) as painter:
            self._paint(painter)

    def _paint(self, painter: QPainter) -> None:
        colours = self._display.palette
        painter.fillRect(self.rect(), QColor(colours.panel))
        self._paint_title(painter)
        plot = QRectF(
            GUTTER_PX,
            _TITLE_PX,
            max(self.width() - GUTTER_PX - MARGIN_PX, 1),
            max(self.height() - _TITLE_PX - 4, 1),
        )
        curves = [self._comparison.curve(number) for number in (0, 1)]
        known = np.concatenate([velocity[np.isfinite(velocity)] for _, velocity in curves])
        limit = max(1.1 * float(np.abs(known).max(initial=0.0)), _LEAST_MPS)
        self._paint_axis(painter, plot, limit)
        painter.save()
        painter.setClipRect(plot)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        for number, (times_s, velocity) in enumerate(curves):
            reference = number == self._comparison.reference
            painter.setPen(QPen(colour_of(self._display, number), 2.0 if reference else 1.5))
            for line in self._lines(times_s, velocity, plot, limit):
                painter.drawPolyline(line)
        painter.setPen(QPen(QColor(colours.muted), 1))
        x = self.scale.x_of(self._playback.time_s)
        painter.drawLine(QPointF(x, plot.top()), QPointF(x, plot.bottom()))
        painter.restore()

    def _paint_title(self, painter: QPainter) -> None:
        colours = self._display.palette
        font = painter.font()
        font.setBold(True)
        painter.setFont(font)
        painter.setPen(QColor(colours.text))
        box = QRectF(8, 0, self.width() - 16, _TITLE_PX)
        painter.drawText(box, Qt.AlignmentFlag.AlignVCenter, joint_words(self._comparison.joint))
        font.setBold(False)
        painter.setFont(font)
        painter.setPen(QColor(colours.muted))
        flags = Qt.AlignmentFlag.AlignVCenter | Qt.AlignmentFlag.AlignRight
        painter.drawText(box, flags, "towards the sensor +  /  away −   m/s")

    def _paint_axis(self, painter: QPainter, plot: QRectF, limit: float) -> None:
        colours = self._display.palette
        painter.setPen(QPen(QColor(colours.border), 1))
        painter.drawRect(plot.adjusted(-0.5, -0.5, 0.5, 0.5))
        line_px = painter.fontMetrics().height()
        for velocity in ticks(-limit, limit, max(int(plot.height() / (line_px * 1.8)), 2)):
            y = plot.center().y() - velocity / limit * plot.height() / 2
            painter.setPen(QPen(QColor(colours.border), 1))
            painter.drawLine(QPointF(plot.left(), y), QPointF(plot.right(), y))
            painter.setPen(QColor(colours.muted))
            painter.drawText(
                QRectF(0, y - line_px / 2, GUTTER_PX - 8, line_px),
                Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter,
                signed_text(round(velocity, 6)),
            )

    def _lines(
        self, times_s: np.ndarray, velocity: np.ndarray, plot: QRectF, limit: float
    ) -> list[QPolygonF]:
        """The stretches without a gap, in pixels."""
        scale = self.scale
        return [
            QPolygonF(
                [
                    QPointF(
                        scale.x_of(float(times_s[k])),
                        plot.center().y() - float(velocity[k]) / limit * plot.height() / 2,
                    )
                    for k in range(start, stop)
                ]
            )
            for start, stop in runs(np.isfinite(velocity))
        ]


def joint_words(name: str) -> str:
    """``hand.R`` as ``Right hand``."""
    part, _, side = name.partition(".")
    words = {"L": f"left {part}", "R": f"right {part}"}.get(side, part)
    return words[0].upper() + words[1:]
