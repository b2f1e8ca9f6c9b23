"""Recall of classifiers against the amount of real data, with and without synthetic data."""

from __future__ import annotations

import math

from PySide6.QtCore import QPointF, Qt
from PySide6.QtGui import QColor, QMouseEvent, QPainter, QPen, QPolygonF
from PySide6.QtWidgets import QWidget

from sd2app.classify.result import ClassResult, CurvePoint
from sd2app.session.display import DisplayModel
from sd2app.widgets.plot import SteppedPlot
from sd2app.widgets.time_axis import ticks

_PAD = 1.15
_ASIDE_PX = 8
"""Shift between curves, so that their bars do not cover each other."""
_NEAR_PX = 14.0


class LearningCurve(SteppedPlot):
    """Mean recall with bars of one standard deviation over the share of real data.

    Hovering reads a point, as the keyboard does.
    """

    MARGINS_PX = (44, 26, 12, 38)
    HEIGHTS_PX = (180, 240, 420)

    def __init__(
        self, result: ClassResult, display: DisplayModel, parent: QWidget | None = None
    ) -> None:
        super().__init__(display, "Learning curve", parent)
        self._curves, self._kind = result.curves, result.kind
        points = self.points()
        self._least = min(point.share for point in points) / _PAD
        low = min(point.recall.mean - point.recall.sd for point in points)
        high = max(point.recall.mean + point.recall.sd for point in points)
        self._low = max(math.floor(10 * low) / 10, 0.0)
        self._high = max(min(math.ceil(10 * high) / 10, 1.0), self._low + 0.1)

    def points(self) -> list[CurvePoint]:
        """Points of all curves."""
        return [point for curve in self._curves for point in curve]

    def first_point(self) -> CurvePoint:
        """Point with the least real data and nothing added."""
        return self.points()[0]

    def tip_place(self, point: CurvePoint) -> QPointF:
        """Pixel of the point."""
        return self._beside(point, point.recall.mean)

    def _beside(self, point: CurvePoint, recall: float) -> QPointF:
        """A recall after learning from a point's share, a little aside of the other curves'."""
        titles = [curve[0].title for curve in self._curves]
        aside_px = _ASIDE_PX * (titles.index(point.title) - (len(titles) - 1) / 2)
        return self.place_of(point.share, recall) + QPointF(aside_px, 0)

    def words_of(self, point: CurvePoint) -> str:
        """Recall at a point in words."""
        return (
            f"{point.title}, {100 * point.share:g} % of the {self._kind} radar's data\n"
            f"Mean recall {point.recall.text()} %"
        )

    def place_of(self, share: float, recall: float) -> QPointF:
        """Pixel of a recall after learning from a share."""
        plot = self.plot_rect()
        along = math.log(share / self._least) / math.log(_PAD / self._least)
        up = (recall - self._low) / (self._high - self._low)
        return QPointF(plot.left() + along * plot.width(), plot.bottom() - up * plot.height())

    # --- painting -------------------------------------------------------------------------

    def _colours(self) -> list[str]:
        palette = self._display.palette
        return [palette.real, palette.synthetic, palette.denoised, palette.before]

    def paint_plot(self, painter: QPainter) -> None:
        """Axes, curves with their bars, and what is pointed at."""
        across = sorted({point.share for point in self.points()})
        upwards = ticks(100 * self._low, 100 * self._high, self.most_upwards(painter))
        self.paint_axes(
            painter,
            [(self.place_of(share, self._low).x(), f"{100 * share:g} %") for share in across],
            [(self.place_of(1.0, value / 100).y(), f"{value:g}") for value in upwards],
            f"share of the {self._kind} radar's data that is learnt from",
        )
        titles = [curve[0].title for curve in self._curves]
        names = list(zip(titles, self._colours(), strict=False))
        self.paint_legend(painter, "mean recall, %", names)
        for curve, colour in zip(self._curves, self._colours(), strict=False):
            self._paint_curve(painter, curve, QColor(colour))
        if self.pointed is not None:
            painter.setPen(QPen(QColor(self._display.palette.accent), 1.5))
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.drawEllipse(self.tip_place(self.pointed), 6.0, 6.0)

    def _paint_curve(
        self, painter: QPainter, curve: tuple[CurvePoint, ...], colour: QColor
    ) -> None:
        painter.setPen(QPen(colour, 2))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawPolyline(QPolygonF([self.tip_place(point) for point in curve]))
        for point in curve:
            top = self._beside(point, point.recall.mean + point.recall.sd)
            bottom = self._beside(point, point.recall.mean - point.recall.sd)
            painter.setPen(QPen(colour, 1))
            painter.drawLine(top, bottom)
            for end in (top, bottom):
                painter.drawLine(end - QPointF(3, 0), end + QPointF(3, 0))
            painter.setBrush(colour)
            painter.drawEllipse(self.tip_place(point), 3.0, 3.0)

    # --- pointing -------------------------------------------------------------------------

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Read the point under the pointer."""
        where = event.position()

        def far(point: CurvePoint) -> float:
            away = self.tip_place(point) - where
            return math.hypot(away.x(), away.y())

        nearest = min(self.points(), key=far)
        self.point_at(nearest if far(nearest) <= _NEAR_PX else None)
        self.explain()
