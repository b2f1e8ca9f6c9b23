"""The spectrum of the current frame: every track as a curve over velocity."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from PySide6.QtCore import QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QBrush, QColor, QFontMetrics, QPainter, QPaintEvent, QPen, QPolygonF
from PySide6.QtWidgets import QWidget

from sd2app.session.display import DisplayModel
from sd2app.session.maps import MapModel, PointerModel
from sd2app.session.playback import PlaybackModel
from sd2app.widgets.time_axis import signed_text, ticks
from sd2core.maps import DopplerMap

_LEFT_PX, _TOP_PX, _RIGHT_PX, _BOTTOM_PX = 48, 30, 12, 40
_LEGEND_PX = 20


@dataclass(frozen=True)
class Curve:
    """A track and the name of its colour in the palette."""

    track: MapModel
    colour: str


class SpectrumView(QWidget):
    """Level to the right, velocity upwards like in the heatmaps beside it."""

    def __init__(
        self,
        curves: tuple[Curve, ...],
        playback: PlaybackModel,
        display: DisplayModel,
        pointer: PointerModel,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self._curves = curves
        self._playback = playback
        self._display = display
        self._pointer = pointer
        self.setMinimumSize(180, 160)
        for curve in curves:
            curve.track.changed.connect(self.update)
        for signal in (
            playback.frame_changed,
            display.levels_changed,
            display.theme_changed,
            pointer.changed,
        ):
            signal.connect(self.update)

    def sizeHint(self) -> QSize:
        """Width of the level bar below."""
        return QSize(240, 280)

    def _shown(self) -> list[Curve]:
        return [curve for curve in self._curves if curve.track.map is not None]

    def paintEvent(self, event: QPaintEvent) -> None:
        """Axes, marked bins and curves."""
        with QPainter(self) as painter:
            self._paint(painter)

    def _paint(self, painter: QPainter) -> None:
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        colours = self._display.palette
        painter.fillRect(self.rect(), QColor(colours.panel))
        legend = self._legend(painter.fontMetrics(), self._shown())
        rows = 1 + max((row for _, row, _, _ in legend), default=0)
        plot = QRectF(self.rect()).adjusted(
            _LEFT_PX, _TOP_PX + _LEGEND_PX * rows, -_RIGHT_PX, -_BOTTOM_PX
        )
        font = painter.font()
        font.setBold(True)
        painter.setFont(font)
        painter.setPen(QColor(colours.text))
        painter.drawText(
            QRectF(8, 0, self.width(), 24), Qt.AlignmentFlag.AlignVCenter, "This frame"
        )
        font.setBold(False)
        painter.setFont(font)
        shown = self._shown()
        if not shown:
            return
        v_max = shown[0].track.map.axis.v_max_mps  # type: ignore[union-attr]
        self._paint_axes(painter, plot, v_max)
        painter.save()
        painter.setClipRect(plot)
        for curve in shown:
            self._paint_curve(painter, plot, curve, v_max)
        if self._pointer.velocity_mps is not None:
            y = _y_of(plot, self._pointer.velocity_mps, v_max)
            painter.setPen(QPen(QColor(colours.muted), 1, Qt.PenStyle.DotLine))
            painter.drawLine(QPointF(plot.left(), y), QPointF(plot.right(), y))
        painter.restore()
        self._paint_legend(painter, legend)

    def _paint_axes(self, painter: QPainter, plot: QRectF, v_max: float) -> None:
        colours, levels = self._display.palette, self._display.levels
        doppler_map = self._shown()[0].track.map
        assert doppler_map is not None
        edges = doppler_map.axis.edges_mps
        for index in doppler_map.null_bins:
            top, bottom = _y_of(plot, edges[index + 1], v_max), _y_of(plot, edges[index], v_max)
            painter.fillRect(
                QRectF(plot.left(), top, plot.width(), bottom - top),
                QBrush(QColor(colours.border), Qt.BrushStyle.BDiagPattern),
            )
        line_px = painter.fontMetrics().height()
        for velocity in ticks(-v_max, v_max, max(int(plot.height() / (2 * line_px)), 2)):
            y = _y_of(plot, velocity, v_max)
            painter.setPen(QPen(QColor(colours.border), 1))
            painter.drawLine(QPointF(plot.left(), y), QPointF(plot.right(), y))
            painter.setPen(QColor(colours.muted))
            painter.drawText(
                QRectF(0, y - line_px / 2, _LEFT_PX - 6, line_px),
                Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter,
                signed_text(velocity),
            )
        if levels.scale == "dB":
            low, high, unit = levels.low_db, levels.high_db, "dB"
        else:
            low, high, unit = 0.0, 100.0 * 10.0 ** (levels.high_db / 10.0), "%"
        for level in ticks(low, high, 4):
            x = plot.left() + plot.width() * (level - low) / (high - low)
            painter.setPen(QPen(QColor(colours.border), 1))
            painter.drawLine(QPointF(x, plot.top()), QPointF(x, plot.bottom()))
            painter.setPen(QColor(colours.muted))
            painter.drawText(
                QRectF(x - 30, plot.bottom() + 2, 60, line_px),
                Qt.AlignmentFlag.AlignCenter,
                f"{level:g}".replace("-", "−"),
            )
        painter.drawText(
            QRectF(plot.left(), plot.bottom() + line_px + 2, plot.width(), line_px),
            Qt.AlignmentFlag.AlignCenter,
            f"level ({unit} of the reference)",
        )

    def _paint_curve(self, painter: QPainter, plot: QRectF, curve: Curve, v_max: float) -> None:
        doppler_map = curve.track.map
        assert doppler_map is not None
        frame = curve.track.frame_at(self._playback.time_s)
        if frame is None or _nobody_in(doppler_map, frame):
            return
        self._paint_band(painter, plot, curve, frame, v_max)
        shades = curve.track.shade(doppler_map.values[:, frame], self._display.levels)
        points: list[QPointF] = []
        for velocity, shade in zip(doppler_map.axis.centres_mps, np.asarray(shades), strict=True):
            points.append(
                QPointF(plot.left() + plot.width() * float(shade), _y_of(plot, velocity, v_max))
            )
        colour = QColor(getattr(self._display.palette, curve.colour))
        area = QPolygonF(points)
        area.append(QPointF(plot.left(), points[-1].y()))
        area.append(QPointF(plot.left(), points[0].y()))
        fill = QColor(colour)
        fill.setAlpha(40)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(fill)
        painter.drawPolygon(area)
        painter.setPen(QPen(colour, 2))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawPolyline(QPolygonF(points))

    def _paint_band(
        self, painter: QPainter, plot: QRectF, curve: Curve, frame: int, v_max: float
    ) -> None:
        """Paint one standard deviation up and down, where it is known."""
        doppler_map, known = curve.track.map, curve.track.uncertainty
        if known is None or doppler_map is None:
            return
        value, sd = known.expected[:, frame], known.sd[:, frame]
        centres = doppler_map.axis.centres_mps
        band = QPolygonF()
        for ends, order in ((value + sd, 1), (np.maximum(value - sd, 0.0), -1)):
            shades = curve.track.shade(ends, self._display.levels)
            for velocity, shade in zip(centres[::order], shades[::order], strict=True):
                x = plot.left() + plot.width() * float(shade)
                band.append(QPointF(x, _y_of(plot, velocity, v_max)))
        colour = QColor(getattr(self._display.palette, curve.colour))
        colour.setAlpha(90)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QBrush(colour, Qt.BrushStyle.Dense4Pattern))
        painter.drawPolygon(band)

    def _paint_legend(self, painter: QPainter, entries: list[tuple[float, int, str, str]]) -> None:
        for x, row, text, colour in entries:
            top = 24.0 + _LEGEND_PX * row
            painter.setPen(QPen(QColor(getattr(self._display.palette, colour)), 2))
            painter.drawLine(QPointF(x, top + 10), QPointF(x + 13, top + 10))
            painter.setPen(QColor(self._display.palette.muted))
            box = QRectF(x + 18, top, self.width() - x - 18, 20)
            painter.drawText(box, Qt.AlignmentFlag.AlignVCenter, text)

    def _legend(
        self, metrics: QFontMetrics, shown: list[Curve]
    ) -> list[tuple[float, int, str, str]]:
        """Place, row, text and colour of every entry; what does not fit begins a new row."""
        entries: list[tuple[float, int, str, str]] = []
        x, row = 8.0, 0
        for curve in shown:
            text = curve.track.title.lower()
            frame, doppler_map = curve.track.frame_at(self._playback.time_s), curve.track.map
            if frame is not None and doppler_map is not None and _nobody_in(doppler_map, frame):
                text += ": no person"
            width = 20 + metrics.horizontalAdvance(text)
            if entries and x + width > self.width() - 4:
                x, row = 8.0, row + 1
            entries.append((x, row, text, curve.colour))
            x += width + 12
        return entries


def _nobody_in(doppler_map: DopplerMap, frame: int) -> bool:
    return doppler_map.present is not None and not doppler_map.present[frame]


def _y_of(plot: QRectF, velocity_mps: float, v_max_mps: float) -> float:
    return plot.top() + plot.height() * (v_max_mps - velocity_mps) / (2.0 * v_max_mps)
