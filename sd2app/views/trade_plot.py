"""Error against cost of every plan that was measured, both on logarithmic axes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtCore import QEvent, QPointF, QRectF, QSize, Qt
from PySide6.QtGui import (
    QColor,
    QFocusEvent,
    QHelpEvent,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QPen,
    QPolygonF,
)
from PySide6.QtWidgets import QSizePolicy, QToolTip, QWidget

from sd2app.models.display import DisplayModel
from sd2app.models.measured import front_at_rest, serves_at_rest
from sd2app.models.plan_words import percent, point_text
from sd2app.models.trade import TradeModel
from sd2app.views.log_axis import LogAxis, tick_text

if TYPE_CHECKING:
    from sd2core.ladder.results import PlanResult

_LEFT_PX, _TOP_PX, _RIGHT_PX, _BOTTOM_PX = 44, 20, 10, 36
_FLOOR_PERCENT = 0.01
_REACH_PX = 8.0
_STEPS = {
    Qt.Key.Key_Left: -1,
    Qt.Key.Key_Right: 1,
    Qt.Key.Key_Up: 1,
    Qt.Key.Key_Down: -1,
}
_TAKES = {Qt.Key.Key_Return, Qt.Key.Key_Enter, Qt.Key.Key_Escape, *_STEPS}


class TradePlot(QWidget):
    """Every plan as a point: the cheaper the further left, the nearer the lower.

    Hovering says what a point is, a click uses it. With the keyboard Left and
    Right go along the front, Up and Down over all points by their error, Return
    uses the point, Escape gives the keyboard back.
    """

    def __init__(
        self, trade: TradeModel, display: DisplayModel, parent: QWidget | None = None
    ) -> None:
        super().__init__(parent)
        self._trade = trade
        self._display = display
        self._pointed: PlanResult | None = None
        self.setMouseTracking(True)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setMinimumHeight(164)
        self.setMaximumHeight(260)
        self.setAccessibleName("Error against cost of every plan")
        trade.changed.connect(self._refresh)
        trade.plan_changed.connect(self._refresh)
        display.theme_changed.connect(self.update)

    def sizeHint(self) -> QSize:
        """A little wider than high."""
        return QSize(260, 164)

    @property
    def pointed(self) -> PlanResult | None:
        """The point under the pointer, or the one the keyboard is at."""
        return self._pointed

    # --- places ---------------------------------------------------------------------------

    def plot_rect(self) -> QRectF:
        """Where points are drawn."""
        return QRectF(self.rect()).adjusted(_LEFT_PX, _TOP_PX, -_RIGHT_PX, -_BOTTOM_PX)

    def point_of(self, result: PlanResult) -> QPointF:
        """Pixel of a plan."""
        costs, errors = self._axes()
        return QPointF(costs.px(result.cost.all_cores_ms.median), errors.px(100 * result.errors.l1))

    def _results(self) -> tuple[PlanResult, ...]:
        measurement = self._trade.measured.measurement
        return measurement.results if measurement is not None else ()

    def _axes(self) -> tuple[LogAxis, LogAxis]:
        plot, results = self.plot_rect(), self._results()
        costs = [result.cost.all_cores_ms.median for result in results]
        errors = [100 * self._trade.tolerance, *(100 * result.errors.l1 for result in results)]
        return (
            LogAxis.around(costs, plot.left(), plot.right()),
            LogAxis.around(errors, plot.bottom(), plot.top(), floor=_FLOOR_PERCENT),
        )

    def _refresh(self) -> None:
        if self._pointed not in self._results():
            self._pointed = None
        self.update()

    # --- painting -------------------------------------------------------------------------

    def paintEvent(self, event: QPaintEvent) -> None:
        """Axes, tolerance, points, front, what is in use."""
        with QPainter(self) as painter:
            painter.setRenderHint(QPainter.RenderHint.Antialiasing)
            painter.fillRect(self.rect(), QColor(self._display.palette.panel))
            if self._results():
                self._paint(painter)

    def _paint(self, painter: QPainter) -> None:
        colours, plot = self._display.palette, self.plot_rect()
        costs, errors = self._axes()
        self._paint_axes(painter, plot, costs, errors)
        self._paint_tolerance(painter, plot, errors)
        measurement = self._trade.measured.measurement
        assert measurement is not None
        accent = QColor(colours.synthetic if measurement.family == "histogram" else colours.real)
        if measurement.stale:
            accent = QColor(colours.muted)
        front = front_at_rest(measurement)
        for result in measurement.results:
            if result not in front:
                self._paint_point(painter, result, QColor(colours.muted), 2.0)
        self._paint_front(painter, plot, front, accent)
        for result in front:
            self._paint_point(painter, result, accent, 3.5)
        self._paint_tolerance_text(painter, plot, errors)
        self._paint_in_use(painter, costs, errors)
        painter.setBrush(Qt.BrushStyle.NoBrush)
        if self._pointed is not None:
            painter.setPen(QPen(QColor(colours.accent), 1.5))
            painter.drawEllipse(self.point_of(self._pointed), 5.5, 5.5)
        if self.hasFocus():
            painter.setPen(QPen(QColor(colours.accent), 1))
            painter.drawRect(QRectF(self.rect()).adjusted(0.5, 0.5, -0.5, -0.5))

    def _paint_axes(self, painter: QPainter, plot: QRectF, costs: LogAxis, errors: LogAxis) -> None:
        colours, line_px = self._display.palette, painter.fontMetrics().height()
        grid, ink = QPen(QColor(colours.border), 1), QColor(colours.muted)
        for value in costs.ticks(max(int(plot.width() / 44), 2)):
            x = costs.px(value)
            painter.setPen(grid)
            painter.drawLine(QPointF(x, plot.top()), QPointF(x, plot.bottom()))
            painter.setPen(ink)
            box = QRectF(x - 30, plot.bottom() + 3, 60, line_px)
            painter.drawText(box, Qt.AlignmentFlag.AlignCenter, tick_text(value))
        for value in errors.ticks(max(int(plot.height() / (1.8 * line_px)), 2)):
            y = errors.px(value)
            painter.setPen(grid)
            painter.drawLine(QPointF(plot.left(), y), QPointF(plot.right(), y))
            painter.setPen(ink)
            box = QRectF(0, y - line_px / 2, _LEFT_PX - 6, line_px)
            right = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
            edge = "≤" if value <= _FLOOR_PERCENT * 1.001 else ""
            painter.drawText(box, right, f"{edge}{tick_text(value)}")
        painter.setPen(QPen(QColor(colours.hatch), 1))
        painter.drawLine(plot.bottomLeft(), plot.bottomRight())
        painter.drawLine(plot.topLeft(), plot.bottomLeft())
        painter.setPen(ink)
        painter.drawText(
            QRectF(plot.left(), plot.bottom() + line_px + 3, plot.width(), line_px),
            Qt.AlignmentFlag.AlignCenter,
            "cost (ms per frame)",
        )
        painter.drawText(
            QRectF(4, 0, plot.width(), line_px + 2), Qt.AlignmentFlag.AlignVCenter, "error (%)"
        )

    def _paint_tolerance(self, painter: QPainter, plot: QRectF, errors: LogAxis) -> None:
        if self._trade.measured.family != "histogram":
            return
        colours, y = self._display.palette, errors.px(100 * self._trade.tolerance)
        below = QColor(colours.accent)
        below.setAlpha(18)
        painter.fillRect(QRectF(plot.left(), y, plot.width(), plot.bottom() - y), below)
        painter.setPen(QPen(QColor(colours.accent), 1.5, Qt.PenStyle.DashLine))
        painter.drawLine(QPointF(plot.left(), y), QPointF(plot.right(), y))

    def _paint_tolerance_text(self, painter: QPainter, plot: QRectF, errors: LogAxis) -> None:
        if self._trade.measured.family != "histogram":
            return
        colours, metrics = self._display.palette, painter.fontMetrics()
        text, line_px = f"tolerance {percent(self._trade.tolerance)}", metrics.height()
        y, width = errors.px(100 * self._trade.tolerance), metrics.horizontalAdvance(text) + 6
        above = y - line_px - 1 if y - line_px > plot.top() else y + 1
        box = QRectF(plot.right() - width, above, width, line_px)
        ground = QColor(colours.panel)
        ground.setAlpha(220)
        painter.fillRect(box, ground)
        painter.setPen(QColor(colours.accent))
        painter.drawText(box, Qt.AlignmentFlag.AlignCenter, text)

    def _paint_in_use(self, painter: QPainter, costs: LogAxis, errors: LogAxis) -> None:
        """Where the plan in use was measured; else where the choice of it found it to be."""
        in_use, current = self._trade.in_use, self._trade.current_point
        if in_use is None or self._trade.measured.family != in_use.plan.family:
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
        self, painter: QPainter, plot: QRectF, front: tuple[PlanResult, ...], colour: QColor
    ) -> None:
        """Stepped: between two points one gets the error of the cheaper."""
        line = QPolygonF()
        for result in front:
            place = self.point_of(result)
            if line:
                line.append(QPointF(place.x(), line[-1].y()))
            line.append(place)
        line.append(QPointF(plot.right(), line[-1].y()))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.setPen(QPen(colour, 1.5))
        painter.drawPolyline(line)

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
            painter.drawPolygon(
                QPolygonF(
                    [
                        place + QPointF(-radius_px - 1, -radius_px),
                        place + QPointF(radius_px + 1, -radius_px),
                        place + QPointF(0, radius_px + 1),
                    ]
                )
            )
        else:
            painter.drawEllipse(place, radius_px, radius_px)

    # --- mouse ----------------------------------------------------------------------------

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Point at the nearest point."""
        self._point_at(self._near(event.position()))
        self.setCursor(
            Qt.CursorShape.PointingHandCursor if self._pointed else Qt.CursorShape.ArrowCursor
        )
        self._explain()

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Use the point."""
        result = self._near(event.position())
        if event.button() == Qt.MouseButton.LeftButton and result is not None:
            self._trade.use(result)

    def leaveEvent(self, event: QEvent) -> None:
        """Point at nothing."""
        self._point_at(None)

    def _near(self, place: QPointF) -> PlanResult | None:
        """The nearest plan within reach; one on the front before others as near."""
        measurement = self._trade.measured.measurement
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

    def _point_at(self, result: PlanResult | None) -> None:
        if result is not self._pointed:
            self._pointed = result
            self.setAccessibleDescription(point_text(result) if result is not None else "")
            self.update()

    def _explain(self) -> None:
        if self._pointed is None:
            QToolTip.hideText()
            return
        place = self.mapToGlobal(self.point_of(self._pointed).toPoint())
        QToolTip.showText(place, self._tip(self._pointed), self)

    def _tip(self, result: PlanResult) -> str:
        current = self._trade.current_point
        if result is current:
            return f"In use\n{point_text(result)}"
        if result.plan.family != "histogram":
            return f"For comparison\n{point_text(result)}"
        if not serves_at_rest(result):
            return f"For a sensor that moves\n{point_text(result)}"
        return f"{point_text(result)}\nClick to use it"

    # --- keyboard -------------------------------------------------------------------------

    def event(self, event: QEvent) -> bool:
        """Arrows and Return belong to the plot while it has the keyboard."""
        if (
            event.type() == QEvent.Type.ShortcutOverride
            and isinstance(event, QKeyEvent)
            and event.modifiers() == Qt.KeyboardModifier.NoModifier
            and event.key() in _TAKES
            and self._results()
        ):
            event.accept()
            return True
        if isinstance(event, QHelpEvent):
            return True
        return super().event(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Go from point to point; Return uses one."""
        measurement, key = self._trade.measured.measurement, event.key()
        if measurement is None or key not in _TAKES:
            super().keyPressEvent(event)
        elif key == Qt.Key.Key_Escape:
            self.clearFocus()
        elif key in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            if self._pointed is not None:
                self._trade.use(self._pointed)
        else:
            along = list(front_at_rest(measurement))
            if key in (Qt.Key.Key_Up, Qt.Key.Key_Down):
                along = sorted(measurement.results, key=lambda result: result.errors.l1)
            self._point_at(self._next(along, _STEPS[Qt.Key(key)]))
            self._explain()

    def _next(self, along: list[PlanResult], step: int) -> PlanResult:
        """The neighbour of the point the keyboard is at; from elsewhere, the nearest."""
        here = self._pointed or self._trade.current_point
        if here is None:
            return along[0]
        if here in along:
            return along[min(max(along.index(here) + step, 0), len(along) - 1)]
        place = self.point_of(here)
        return min(along, key=lambda result: (self.point_of(result) - place).manhattanLength())

    def focusInEvent(self, event: QFocusEvent) -> None:
        """Show where the keyboard is."""
        super().focusInEvent(event)
        if event.reason() != Qt.FocusReason.MouseFocusReason:
            self._point_at(self._trade.current_point)
        self.update()

    def focusOutEvent(self, event: QFocusEvent) -> None:
        """Point at nothing."""
        super().focusOutEvent(event)
        self._point_at(None)
        QToolTip.hideText()
