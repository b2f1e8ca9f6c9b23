"""Curves over two axes, read by pointer and keyboard."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from PySide6.QtCore import QEvent, QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QKeyEvent, QMouseEvent, QPainter, QPen, QPolygonF

from sd2app.widgets.plot import PointPlot, Themed, log_ticks
from sd2app.widgets.time_axis import ticks

_STEPS = {Qt.Key.Key_Left: -1, Qt.Key.Key_Right: 1}
ROUND = ((1,), (1, 3), (1, 2, 5), (1, 2, 3, 5, 7), (1, 1.5, 2, 3, 4, 5, 6, 8))
"""Values within a decade, the fewest first; the last ones for axes shorter than a decade."""
_NEAR_PX = 14.0
_CAP_PX = 3.0


@dataclass(frozen=True)
class Scale:
    """Axis of a chart."""

    low: float
    high: float
    log: bool = False
    whole: bool = False  # ticks at whole numbers only
    values: tuple[float, ...] = ()  # ticks; round numbers where none are given
    text: Callable[[float], str] = "{:g}".format  # of a tick

    def share(self, value: float) -> float:
        """Place of a value: 0 at the low end, 1 at the high one."""
        if self.log:
            return math.log(max(value, self.low) / self.low) / math.log(self.high / self.low)
        return (value - self.low) / (self.high - self.low)

    def ticks(self, most: int) -> Sequence[float]:
        """Values to write."""
        if self.values:
            return self.values
        if self.log:
            return log_ticks(self.low, self.high, most, ROUND)
        found = ticks(self.low, self.high, most)
        return [value for value in found if value == round(value)] if self.whole else found


@dataclass(frozen=True)
class Curve:
    """Line through points, with dots and bars where wanted."""

    name: str  # in the legend; empty: not in it
    colour: str  # its name in the palette
    points: Sequence[tuple[float, float]]
    width_px: float = 2.0
    alpha: int = 255
    dot_px: float = 0.0
    bars: Sequence[float] = ()  # half the height of each point's bar
    aside_px: float = 0.0  # shift, so that bars do not cover each other


@dataclass(frozen=True)
class Mark:
    """Point that can be pointed at, and its description."""

    x: float
    y: float
    words: str
    aside_px: float = 0.0


@dataclass(frozen=True)
class Chart:
    """Content of a :class:`ChartView`."""

    across: Scale
    upwards: Scale
    below: str  # name of the lower axis
    unit: str  # of the left axis
    curves: Sequence[Curve] = ()
    marks: Sequence[Mark] = ()
    best: Mark | None = None  # ringed; the keyboard arrives there
    scattered: bool = False  # marks stand above each other: the nearest is not just that across


class ChartView(PointPlot):
    """Curves with a legend.

    Left and Right go from mark to mark, Home and End to the first and the last. Escape gives
    the keyboard back.
    """

    MARGINS_PX = (48, 26, 12, 38)
    HEIGHTS_PX = (160, 176, 280)
    KEYS = frozenset({Qt.Key.Key_Home, Qt.Key.Key_End, Qt.Key.Key_Escape, *_STEPS})

    def __init__(self, display: Themed, name: str, chart: Chart) -> None:
        super().__init__(display, name)
        self._chart = chart

    def show_chart(self, chart: Chart) -> None:
        """Show other curves; what was pointed at stays so."""
        self._chart = chart
        if self._pointed is not None:
            here = self._pointed.x
            self._pointed = next((mark for mark in chart.marks if mark.x == here), None)
        self.update()

    def points(self) -> Sequence[Mark]:
        """The marks."""
        return self._chart.marks

    def first_point(self) -> Mark | None:
        """The best mark, or the first one."""
        return self._chart.best or next(iter(self._chart.marks), None)

    def words_of(self, point: Mark) -> str:
        """Description of a mark."""
        return point.words

    def tip_place(self, point: Mark) -> QPointF:
        """Pixel of the mark, or half way up the line at it."""
        place = self.place_of(point.x, point.y) + QPointF(point.aside_px, 0)
        return place if self._chart.scattered else QPointF(place.x(), self.plot_rect().center().y())

    def place_of(self, x: float, y: float) -> QPointF:
        """Pixel of a point."""
        plot, chart = self.plot_rect(), self._chart
        return QPointF(
            plot.left() + plot.width() * chart.across.share(x),
            plot.bottom() - plot.height() * chart.upwards.share(y),
        )

    # --- painting -------------------------------------------------------------------------

    def paint_plot(self, painter: QPainter) -> None:
        """Axes, legend, curves, the best mark, and what is pointed at."""
        chart, plot = self._chart, self.plot_rect()
        across, upwards = chart.across, chart.upwards
        self.paint_axes(
            painter,
            [
                (self.place_of(value, upwards.low).x(), across.text(value))
                for value in across.ticks(max(int(plot.width() / 52), 2))
            ],
            [
                (self.place_of(across.low, value).y(), upwards.text(value))
                for value in upwards.ticks(self.most_upwards(painter))
            ],
            chart.below,
        )
        self._paint_legend(painter)
        painter.save()
        painter.setClipRect(plot.adjusted(-6, -6, 6, 6))
        for curve in chart.curves:
            self._paint_curve(painter, curve)
        self._paint_marks(painter)
        painter.restore()

    def _paint_legend(self, painter: QPainter) -> None:
        """Paint over the plot the unit on the left, each curve's line and name on the right."""
        palette, metrics = self._display.palette, painter.fontMetrics()
        centred = Qt.AlignmentFlag.AlignVCenter
        painter.setPen(QColor(palette.muted))
        painter.drawText(QRectF(4, 0, 120, 20), centred, self._chart.unit)
        x = self.plot_rect().right()
        for curve in reversed(self._chart.curves):
            if curve.name:
                width = metrics.horizontalAdvance(curve.name)
                x -= width
                painter.setPen(QColor(palette.muted))
                painter.drawText(QRectF(x, 0, width + 2, 20), centred, curve.name)
                painter.setPen(QPen(QColor(getattr(palette, curve.colour)), 2))
                painter.drawLine(QPointF(x - 18, 10), QPointF(x - 5, 10))
                x -= 30

    def _paint_curve(self, painter: QPainter, curve: Curve) -> None:
        colour, aside = QColor(getattr(self._display.palette, curve.colour)), curve.aside_px
        colour.setAlpha(curve.alpha)
        # Hardly more of them than there are pixels.
        every = max(1, int(len(curve.points) / max(self.plot_rect().width(), 1.0)))
        places = [self.place_of(x, y) + QPointF(aside, 0) for x, y in curve.points[::every]]
        painter.setPen(QPen(colour, curve.width_px))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawPolyline(QPolygonF(places))
        painter.setPen(QPen(colour, 1))
        for (x, y), half in zip(curve.points, curve.bars, strict=False):
            ends = [self.place_of(x, y + sign * half) + QPointF(aside, 0) for sign in (-1, 1)]
            painter.drawLine(*ends)
            for end in ends:
                painter.drawLine(end - QPointF(_CAP_PX, 0), end + QPointF(_CAP_PX, 0))
        radius_px = curve.dot_px or (2.0 if len(places) == 1 else 0.0)
        if radius_px:
            painter.setBrush(colour)
            for place in places:
                painter.drawEllipse(place, radius_px, radius_px)

    def _paint_marks(self, painter: QPainter) -> None:
        """Draw a ring around the best mark; a ring, or a line, at the pointed one."""
        palette, best, pointed = self._display.palette, self._chart.best, self.pointed
        painter.setBrush(Qt.BrushStyle.NoBrush)
        if best is not None and math.isfinite(best.y):
            painter.setPen(QPen(QColor(palette.text), 1.5))
            painter.drawEllipse(self.place_of(best.x, best.y), 5.0, 5.0)
        if pointed is not None and self._chart.scattered:
            painter.setPen(QPen(QColor(palette.accent), 1.5))
            painter.drawEllipse(self.tip_place(pointed), 6.0, 6.0)
        elif pointed is not None:
            x, plot = self.tip_place(pointed).x(), self.plot_rect()
            painter.setPen(QPen(QColor(palette.accent), 1, Qt.PenStyle.DashLine))
            painter.drawLine(QPointF(x, plot.top()), QPointF(x, plot.bottom()))

    # --- pointer and keyboard ---------------------------------------------------------------

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Point at the mark that is nearest to the pointer."""
        where, plot = event.position(), self.plot_rect()

        def far_px(mark: Mark) -> float:
            away = self.tip_place(mark) - where
            return math.hypot(away.x(), away.y()) if self._chart.scattered else abs(away.x())

        nearest = min(self.points(), key=far_px, default=None)
        if nearest is not None and self._chart.scattered:
            there = far_px(nearest) <= _NEAR_PX
        else:
            there = plot.left() - 4 <= where.x() <= plot.right() + 4
        self.point_at(nearest if there else None)
        self.explain()

    def leaveEvent(self, event: QEvent) -> None:
        """Remove the mark of the pointed point."""
        super().leaveEvent(event)
        if not self.hasFocus():
            self.point_at(None)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Go from mark to mark."""
        points, key = list(self.points()), event.key()
        if not points or key not in self.KEYS:
            super().keyPressEvent(event)
        elif key == Qt.Key.Key_Escape:
            self.clearFocus()
        else:
            here = self.pointed or self.first_point() or points[-1]
            at = points.index(here)
            if key in (Qt.Key.Key_Home, Qt.Key.Key_End):
                at = 0 if key == Qt.Key.Key_Home else len(points) - 1
            elif self.pointed is not None:
                at = min(max(at + _STEPS[Qt.Key(key)], 0), len(points) - 1)
            self.point_at(points[at])
            self.explain()
