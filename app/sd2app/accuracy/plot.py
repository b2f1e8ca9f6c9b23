"""Error against cost of every plan that was measured, both on logarithmic axes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtCore import QEvent, QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QKeyEvent, QMouseEvent, QPainter, QPen, QPolygonF
from PySide6.QtWidgets import QWidget

from sd2app.accuracy.measurements import front_at_rest, serves_at_rest
from sd2app.accuracy.model import AccuracyModel
from sd2app.accuracy.text import point_text
from sd2app.session.display import DisplayModel
from sd2app.widgets.plot import LogAxis, PointPlot, tick_text
from sd2app.widgets.text import percent

if TYPE_CHECKING:
    from sd2core.accuracy.results import Measurement, PlanResult

_FLOOR_PERCENT = 0.01
_REACH_PX = 8.0
_STEPS = {
    Qt.Key.Key_Left: -1,
    Qt.Key.Key_Right: 1,
    Qt.Key.Key_Up: 1,
    Qt.Key.Key_Down: -1,
}


class AccuracyPlot(PointPlot):
    """Plot of error over cost with a point per plan.

    Hovering says what a point is, a click uses it. With the keyboard Left and
    Right go along the front, Up and Down over all points by their error, Return
    uses the point, Escape gives the keyboard back.
    """

    MARGINS_PX = (44, 20, 10, 36)
    HEIGHTS_PX = (164, 164, 260)
    KEYS = frozenset({Qt.Key.Key_Return, Qt.Key.Key_Enter, Qt.Key.Key_Escape, *_STEPS})

    def __init__(
        self, accuracy: AccuracyModel, display: DisplayModel, parent: QWidget | None = None
    ) -> None:
        super().__init__(display, "Error against cost of every plan", parent)
        self._accuracy = accuracy
        accuracy.changed.connect(self._refresh)
        accuracy.plan_changed.connect(self._refresh)

    @property
    def _measurement(self) -> Measurement | None:
        return self._accuracy.measured.measurement

    def points(self) -> tuple[PlanResult, ...]:
        """All plans that were measured."""
        return self._measurement.results if self._measurement is not None else ()

    def first_point(self) -> PlanResult | None:
        """The plan in use."""
        return self._accuracy.current_point

    def tip_place(self, point: PlanResult) -> QPointF:
        """Pixel of the plan."""
        return self.point_of(point)

    def words_of(self, point: PlanResult) -> str:
        """Error and cost of a plan."""
        return point_text(point)

    def tip_of(self, point: PlanResult) -> str:
        """The same, and whether it can be used."""
        if point is self._accuracy.current_point:
            return f"In use\n{point_text(point)}"
        if point.plan.family != "histogram":
            return f"For comparison\n{point_text(point)}"
        if not serves_at_rest(point):
            return f"For a sensor that moves\n{point_text(point)}"
        return f"{point_text(point)}\nClick to use it"

    # --- places ---------------------------------------------------------------------------

    def point_of(self, result: PlanResult) -> QPointF:
        """Pixel of a plan."""
        costs, errors = self._axes()
        return QPointF(costs.px(result.cost.all_cores_ms.median), errors.px(100 * result.errors.l1))

    def _axes(self) -> tuple[LogAxis, LogAxis]:
        plot, results = self.plot_rect(), self.points()
        costs = [result.cost.all_cores_ms.median for result in results]
        errors = [100 * self._accuracy.tolerance, *(100 * result.errors.l1 for result in results)]
        return (
            LogAxis.around(costs, plot.left(), plot.right()),
            LogAxis.around(errors, plot.bottom(), plot.top(), floor=_FLOOR_PERCENT),
        )

    def _refresh(self) -> None:
        if self._pointed not in self.points():
            self._pointed = None
        self.update()

    # --- painting -------------------------------------------------------------------------

    def paint_plot(self, painter: QPainter) -> None:
        """Axes, tolerance, points, front, what is in use."""
        measurement = self._measurement
        if measurement is None or not measurement.results:
            return
        colours, (costs, errors) = self._display.palette, self._axes()
        counting = measurement.family == "histogram"
        self._paint_scales(painter, costs, errors)
        if counting:
            self._paint_tolerance(painter, errors)
        accent = QColor(colours.synthetic if counting else colours.real)
        if measurement.stale:
            accent = QColor(colours.muted)
        front = front_at_rest(measurement)
        for result in measurement.results:
            if result not in front:
                self._paint_point(painter, result, QColor(colours.muted), 2.0)
        self._paint_front(painter, front, accent)
        for result in front:
            self._paint_point(painter, result, accent, 3.5)
        if counting:
            self._paint_tolerance_text(painter, errors)
        self._paint_in_use(painter, costs, errors)
        painter.setBrush(Qt.BrushStyle.NoBrush)
        if self._pointed is not None:
            painter.setPen(QPen(QColor(colours.accent), 1.5))
            painter.drawEllipse(self.point_of(self._pointed), 5.5, 5.5)

    def _paint_scales(self, painter: QPainter, costs: LogAxis, errors: LogAxis) -> None:
        width = self.plot_rect().width()
        across = costs.ticks(max(int(width / 44), 2))
        upwards = errors.ticks(self.most_upwards(painter))
        self.paint_axes(
            painter,
            [(costs.px(value), tick_text(value)) for value in across],
            [(errors.px(value), _error_text(value)) for value in upwards],
            "cost (ms per frame)",
        )
        box = QRectF(4, 0, width, painter.fontMetrics().height() + 2)
        painter.drawText(box, Qt.AlignmentFlag.AlignVCenter, "error (%)")

    def _paint_tolerance(self, painter: QPainter, errors: LogAxis) -> None:
        colours, plot = self._display.palette, self.plot_rect()
        y, below = errors.px(100 * self._accuracy.tolerance), QColor(colours.accent)
        below.setAlpha(18)
        painter.fillRect(QRectF(plot.left(), y, plot.width(), plot.bottom() - y), below)
        painter.setPen(QPen(QColor(colours.accent), 1.5, Qt.PenStyle.DashLine))
        painter.drawLine(QPointF(plot.left(), y), QPointF(plot.right(), y))

    def _paint_tolerance_text(self, painter: QPainter, errors: LogAxis) -> None:
        colours, metrics, plot = self._display.palette, painter.fontMetrics(), self.plot_rect()
        text, line_px = f"tolerance {percent(self._accuracy.tolerance)}", metrics.height()
        y, width = errors.px(100 * self._accuracy.tolerance), metrics.horizontalAdvance(text) + 6
        above = y - line_px - 1 if y - line_px > plot.top() else y + 1
        box = QRectF(plot.right() - width, above, width, line_px)
        ground = QColor(colours.panel)
        ground.setAlpha(220)
        painter.fillRect(box, ground)
        painter.setPen(QColor(colours.accent))
        painter.drawText(box, Qt.AlignmentFlag.AlignCenter, text)

    def _paint_in_use(self, painter: QPainter, costs: LogAxis, errors: LogAxis) -> None:
        """Mark the plan in use where it was measured, otherwise where it was estimated."""
        in_use, current = self._accuracy.in_use, self._accuracy.current_point
        if in_use is None or self._accuracy.measured.family != in_use.plan.family:
            return
        place = QPointF(costs.px(in_use.cost_ms), errors.px(100 * in_use.error))
        if current is not None:
            place = self.point_of(current)
        colour = QColor(self._display.palette.text)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(colour)
        painter.drawEllipse(place, 3.5, 3.5)
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.setPen(QPen(colour, 2))
        painter.drawEllipse(place, 7.0, 7.0)

    def _paint_front(
        self, painter: QPainter, front: tuple[PlanResult, ...], colour: QColor
    ) -> None:
        """Paint the front in steps: between two points holds the error of the cheaper."""
        line: list[QPointF] = []
        for result in front:
            place = self.point_of(result)
            if line:
                line.append(QPointF(place.x(), line[-1].y()))
            line.append(place)
        line.append(QPointF(self.plot_rect().right(), line[-1].y()))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.setPen(QPen(colour, 1.5))
        painter.drawPolyline(QPolygonF(line))

    def _paint_point(
        self, painter: QPainter, result: PlanResult, colour: QColor, radius_px: float
    ) -> None:
        place, (_, errors) = self.point_of(result), self._axes()
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(colour)
        if not serves_at_rest(result):
            painter.setPen(QPen(colour, 1))
            painter.setBrush(Qt.BrushStyle.NoBrush)
            radius_px = 3.0
        if errors.is_below(100 * result.errors.l1):
            # On the edge: an arrow down, its value is off the axis.
            wide = radius_px + 1
            corners = ((-wide, -radius_px), (wide, -radius_px), (0, wide))
            painter.drawPolygon(QPolygonF([place + QPointF(*corner) for corner in corners]))
        else:
            painter.drawEllipse(place, radius_px, radius_px)

    # --- mouse ----------------------------------------------------------------------------

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Point at the nearest point."""
        self.point_at(self._near(event.position()))
        self.setCursor(
            Qt.CursorShape.PointingHandCursor if self._pointed else Qt.CursorShape.ArrowCursor
        )
        self.explain()

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Use the point."""
        result = self._near(event.position())
        if event.button() == Qt.MouseButton.LeftButton and result is not None:
            self._accuracy.use(result)

    def leaveEvent(self, event: QEvent) -> None:
        """Remove the mark of the pointed point."""
        self.point_at(None)

    def _near(self, place: QPointF) -> PlanResult | None:
        """The nearest plan within reach; one on the front before others as near."""
        measurement = self._measurement
        if measurement is None:
            return None
        front = set(map(id, front_at_rest(measurement)))

        def distance_px(result: PlanResult) -> float:
            offset = self.point_of(result) - place
            return float((offset.x() ** 2 + offset.y() ** 2) ** 0.5) - (
                2.0 if id(result) in front else 0.0
            )

        best = min(measurement.results, key=distance_px, default=None)
        return best if best is not None and distance_px(best) <= _REACH_PX else None

    # --- keyboard -------------------------------------------------------------------------

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Go from point to point; Return uses one."""
        measurement, key = self._measurement, event.key()
        if measurement is None or key not in self.KEYS:
            super().keyPressEvent(event)
        elif key == Qt.Key.Key_Escape:
            self.clearFocus()
        elif key in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            if self._pointed is not None:
                self._accuracy.use(self._pointed)
        else:
            along = list(front_at_rest(measurement))
            if key in (Qt.Key.Key_Up, Qt.Key.Key_Down):
                along = sorted(measurement.results, key=lambda result: result.errors.l1)
            self.point_at(self._next(along, _STEPS[Qt.Key(key)]))
            self.explain()

    def _next(self, along: list[PlanResult], step: int) -> PlanResult:
        """The neighbour of the point the keyboard is at; from elsewhere, the nearest."""
        here = self._pointed or self._accuracy.current_point
        if here is None:
            return along[0]
        if here in along:
            return along[min(max(along.index(here) + step, 0), len(along) - 1)]
        place = self.point_of(here)
        return min(along, key=lambda result: (self.point_of(result) - place).manhattanLength())


def _error_text(value: float) -> str:
    return f"{'≤' if value <= _FLOOR_PERCENT * 1.001 else ''}{tick_text(value)}"
