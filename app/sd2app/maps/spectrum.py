"""The spectrum of the current frame: every track as a curve over velocity."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QBrush, QColor, QFontMetrics, QPainter, QPen, QPolygonF

from sd2app.maps.heatmap import paint_velocity_labels, velocity_labels, y_of
from sd2app.maps.stack import MapStack
from sd2app.session.maps import MapModel, colours_of, part_words, title_of
from sd2app.session.session import Session
from sd2app.widgets.canvas import AT_LEFT, Canvas, clipped, faint, paint_axes
from sd2app.widgets.time_axis import paint_title, ticks
from sd2core.maps import DopplerMap

_LEFT_PX, _TOP_PX, _RIGHT_PX, _BOTTOM_PX = 48, 30, 12, 40
_LEGEND_PX = 20


@dataclass(frozen=True)
class _Curve:
    """One frame of a map."""

    track: MapModel
    map: DopplerMap
    frame: int | None  # None outside the map
    colour: QColor
    part: str = ""  # of the body, of several

    @property
    def values(self) -> NDArray[np.float32]:
        """Values on screen, (bins, frames)."""
        return self.track.split[self.part] if self.part else self.track.values

    @property
    def words(self) -> str:
        """Name in the legend."""
        return part_words(self.part) if self.part else title_of(self.track).lower()

    @property
    def nobody(self) -> bool:
        """True in a frame without a person."""
        return self.frame is not None and not self.map.present_mask[self.frame]


class SpectrumView(Canvas):
    """Level to the right, velocity upwards on the axis of a map beside it."""

    USUAL_PX = 240, 280

    def __init__(self, session: Session) -> None:
        super().__init__()
        self._maps, self._playback = session.maps, session.playback
        self._display, self._pointer = session.display, session.pointer
        self._stack: MapStack | None = None
        self.setMinimumSize(160, 160)
        self.setAccessibleName("This frame")
        self.follow(
            session.playback.frame_changed,
            session.display.levels_changed,
            session.display.theme_changed,
            session.pointer.changed,
            *(track.changed for track in session.maps.all),
        )

    def stand_beside(self, stack: MapStack) -> None:
        """Share the velocity axis of the leading map of a stack."""
        self._stack = stack
        self.follow(stack.arranged)

    def plot_rect(self) -> QRectF:
        """Rectangle of the plot, in pixels: as high as the leading map, in its place."""
        whole = QRectF(self.rect()).adjusted(_LEFT_PX, _TOP_PX, -_RIGHT_PX, -_BOTTOM_PX)
        view = self._stack.leading if self._stack is not None else None
        if view is None:
            return whole
        plot = view.plot_rect()
        top = QPointF(self.mapFromGlobal(view.mapToGlobal(plot.topLeft()))).y()
        return QRectF(whole.left(), top, whole.width(), plot.height())

    def _curves(self) -> list[_Curve]:
        time_s, palette = self._playback.time_s, self._display.palette
        curves = []
        for name, track in vars(self._maps).items():
            if track.map is None:
                continue
            # The palette has a colour for each map, by the map's name.
            colours = {"": getattr(palette, name)}
            if len(parts := track.split) > 1:
                colours = colours_of(parts)
            frame = track.frame_at(time_s)
            curves += [
                _Curve(track, track.map, frame, QColor(colour), part)
                for part, colour in colours.items()
            ]
        return curves

    def paint(self, painter: QPainter) -> None:
        """Axes, marked bins and curves."""
        curves = self._curves()
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        colours = self._display.palette
        painter.fillRect(self.rect(), QColor(colours.panel))
        plot = self.plot_rect()
        paint_title(painter, QRectF(8, 0, self.width() - 8, 24), "This frame", colours.text)
        if not curves:
            return
        v_max = curves[0].map.axis.v_max_mps
        self._paint_axes(painter, plot, curves[0].map)
        with clipped(painter, plot):
            for curve in curves:
                if curve.frame is not None and not curve.nobody:
                    self._paint_curve(painter, plot, curve, curve.frame, v_max)
            if self._pointer.velocity_mps is not None and not self.still:
                y = y_of(plot, self._pointer.velocity_mps, v_max)
                painter.setPen(QPen(QColor(colours.muted), 1, Qt.PenStyle.DotLine))
                painter.drawLine(QPointF(plot.left(), y), QPointF(plot.right(), y))
        self._paint_legend(painter, curves, plot)

    def _paint_axes(self, painter: QPainter, plot: QRectF, doppler_map: DopplerMap) -> None:
        colours, levels = self._display.palette, self._display.levels
        edges, v_max = doppler_map.axis.edges_mps, doppler_map.axis.v_max_mps
        for index in doppler_map.null_bins:
            top, bottom = y_of(plot, edges[index + 1], v_max), y_of(plot, edges[index], v_max)
            painter.fillRect(
                QRectF(plot.left(), top, plot.width(), bottom - top),
                QBrush(QColor(colours.border), Qt.BrushStyle.BDiagPattern),
            )
        low, high, unit = levels.ends
        across = [
            (plot.left() + plot.width() * (level - low) / (high - low), f"{level:g}")
            for level in ticks(low, high, 4)
        ]
        line_px = painter.fontMetrics().height()
        upwards = velocity_labels(v_max, plot.height(), line_px)
        paint_axes(
            painter,
            plot,
            colours,
            [(x, "" if self._is_tight(plot) else text.replace("-", "−")) for x, text in across],
            [(y_of(plot, velocity, v_max), "") for velocity, _ in upwards],
            "" if self._is_tight(plot) else f"level ({unit} of the reference)",
        )
        paint_velocity_labels(painter, plot, upwards)
        if self._is_tight(plot):
            for x, text in across[:-1]:
                box = QRectF(x + 3, plot.bottom() - line_px - 2, 60, line_px)
                painter.drawText(box, AT_LEFT, f"{text} {unit}".replace("-", "−"))

    def _is_tight(self, plot: QRectF) -> bool:
        """True where the map takes all the height: the scale then stands in the plot."""
        return plot.bottom() + _BOTTOM_PX > self.height()

    def _paint_curve(
        self, painter: QPainter, plot: QRectF, curve: _Curve, frame: int, v_max: float
    ) -> None:
        def line(values: np.ndarray, order: int = 1) -> list[QPointF]:
            shades = curve.track.shade(values, self._display.levels)[::order]
            xs = plot.left() + plot.width() * shades.astype(float)
            ys = y_of(plot, curve.map.axis.centres_mps[::order], v_max)
            return list(map(QPointF, xs.tolist(), ys.tolist()))

        known = curve.track.uncertainty
        if known is not None and not curve.track.parts:
            # One standard deviation up and down.
            value, sd = known.expected[:, frame], known.sd[:, frame]
            band = line(value + sd) + line(np.maximum(value - sd, 0.0), -1)
            _fill(painter, band, curve.colour, 90, Qt.BrushStyle.Dense4Pattern)
        points = line(curve.values[:, frame])
        feet = [QPointF(plot.left(), end.y()) for end in (points[-1], points[0])]
        _fill(painter, points + feet, curve.colour, 40, Qt.BrushStyle.SolidPattern)
        painter.setPen(QPen(curve.colour, 2))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawPolyline(QPolygonF(points))

    def _paint_legend(self, painter: QPainter, curves: list[_Curve], plot: QRectF) -> None:
        metrics, colours = painter.fontMetrics(), self._display.palette
        top, width = plot.bottom() + _BOTTOM_PX, self.width()
        entries, bottom = self._legend(metrics, curves, QRectF(8, top, width - 12, 0))
        if bottom > self.height():
            inside = plot.adjusted(8, 2, -2, 0)
            entries, bottom = self._legend(metrics, curves, inside)
            room = QRectF(plot.left() + 1, inside.top(), plot.width(), bottom - inside.top())
            # It is read over the curves, which are still seen.
            painter.fillRect(room, faint(colours.panel, 215))
        for place, text, colour in entries:
            middle = place.y() + _LEGEND_PX / 2
            painter.setPen(QPen(colour, 2))
            painter.drawLine(QPointF(place.x(), middle), QPointF(place.x() + 13, middle))
            painter.setPen(QColor(colours.muted))
            box = QRectF(place.x() + 18, place.y(), width - place.x() - 18, _LEGEND_PX)
            painter.drawText(box, Qt.AlignmentFlag.AlignVCenter, text)

    def _legend(
        self, metrics: QFontMetrics, curves: list[_Curve], room: QRectF
    ) -> tuple[list[tuple[QPointF, str, QColor]], float]:
        """Place, text and colour of every entry, and their bottom; rows are as long as fits."""
        entries: list[tuple[QPointF, str, QColor]] = []
        x, y = room.left(), room.top()
        for curve in curves:
            text = curve.words + (": no person" if curve.nobody else "")
            width = 20 + metrics.horizontalAdvance(text)
            if x > room.left() and x + width > room.right():
                x, y = room.left(), y + _LEGEND_PX
            entries.append((QPointF(x, y), text, curve.colour))
            x += width + 12
        return entries, y + _LEGEND_PX


def _fill(
    painter: QPainter, points: list[QPointF], colour: QColor, alpha: int, style: Qt.BrushStyle
) -> None:
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(QBrush(faint(colour, alpha), style))
    painter.drawPolygon(QPolygonF(points))
