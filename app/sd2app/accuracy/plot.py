"""Error against cost of every plan that was measured, both on logarithmic axes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, ClassVar

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QKeyEvent, QMouseEvent, QPainter, QPen, QPolygonF

from sd2app.accuracy.measurements import cheapest_within, front_at_rest, point_text, serves_at_rest
from sd2app.accuracy.model import AccuracyModel
from sd2app.session.display import DisplayModel
from sd2app.widgets.canvas import faint, tick_text
from sd2app.widgets.chart import Chart, ChartView, Curve, Mark, Scale
from sd2core.numerics.map_accuracy import percent

if TYPE_CHECKING:
    from sd2core.accuracy.results import Measurement, PlanResult

_FLOOR_PERCENT, _CEILING_PERCENT = 0.01, 1e4
"""Errors beyond are drawn here: the axis is logarithmic, and of an empty map they are infinite."""

_USE = frozenset({Qt.Key.Key_Return, Qt.Key.Key_Enter})
_UP_AND_DOWN = {Qt.Key.Key_Up: 1, Qt.Key.Key_Down: -1}


class AccuracyPlot(ChartView):
    """Plot of error over cost with a point per plan.

    Hovering says what a point is, a click uses it. With the keyboard Left and
    Right go along the front, Up and Down over all points by their error, Return
    uses the point, Escape gives the keyboard back.
    """

    MARGINS_PX = (44, 20, 10, 36)
    HEIGHTS_PX = (200, 200, 200)
    REACH_PX = 8.0
    STEPS: ClassVar = {**ChartView.STEPS, **_UP_AND_DOWN}
    KEYS = ChartView.KEYS | _USE

    def __init__(self, accuracy: AccuracyModel, display: DisplayModel) -> None:
        super().__init__(display, "Error against cost of every plan", accuracy_chart(accuracy))
        self._accuracy = accuracy

    def refresh(self) -> None:
        """Show the plans as they are measured."""
        self.show_chart(accuracy_chart(self._accuracy))

    def along(self, key: Qt.Key) -> Sequence[Mark]:
        """The front from the cheapest plan on, or all plans by their error."""
        if key in _UP_AND_DOWN:
            return sorted(self.marks, key=lambda mark: mark.y)
        return [mark for mark in self.marks if mark.pull_px]

    def paint_chart(self, painter: QPainter) -> None:
        """Everything over the tolerance."""
        if self._accuracy.measured.family == "histogram":
            self._paint_tolerance(painter)
        super().paint_chart(painter)

    def paint_marks(self, painter: QPainter) -> None:
        """The tolerance in words, what is in use and what is pointed at."""
        if self._accuracy.measured.family == "histogram":
            self._paint_tolerance_text(painter)
            self._paint_cheapest(painter)
        super().paint_marks(painter)

    def _tolerance_px(self) -> float:
        """Height of the tolerance."""
        return self.place_of(1.0, 100 * self._accuracy.tolerance).y()

    def _paint_tolerance(self, painter: QPainter) -> None:
        colour, plot, y = self._display.palette.accent, self.plot_rect(), self._tolerance_px()
        below = QRectF(plot.left(), y, plot.width(), plot.bottom() - y)
        painter.fillRect(below, faint(colour, 18))
        painter.setPen(QPen(QColor(colour), 1.5, Qt.PenStyle.DashLine))
        painter.drawLine(QPointF(plot.left(), y), QPointF(plot.right(), y))

    def _paint_tolerance_text(self, painter: QPainter) -> None:
        colours, metrics, plot = self._display.palette, painter.fontMetrics(), self.plot_rect()
        text, line_px = f"tolerance {percent(self._accuracy.tolerance)}", metrics.height()
        y, width = self._tolerance_px(), metrics.horizontalAdvance(text) + 6
        above = y - line_px - 1 if y - line_px > plot.top() else y + 1
        box = QRectF(plot.right() - width, above, width, line_px)
        painter.fillRect(box, faint(colours.panel, 220))
        painter.setPen(QColor(colours.accent))
        painter.drawText(box, Qt.AlignmentFlag.AlignCenter, text)

    def _paint_cheapest(self, painter: QPainter) -> None:
        """Draw a diamond around the cheapest point within the tolerance."""
        measurement = self._accuracy.measured.measurement
        if measurement is None:
            return
        result = cheapest_within(measurement, self._accuracy.tolerance)
        mark = next((one for one in self.marks if one.of is result), None)
        if mark is not None:
            at, reach_px = self.tip_place(mark), 9.0
            sides = ((0, -reach_px), (reach_px, 0), (0, reach_px), (-reach_px, 0))
            painter.setPen(QPen(QColor(self._display.palette.accent), 1.5))
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.drawPolygon(QPolygonF([at + QPointF(*side) for side in sides]))

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Point at the nearest point."""
        super().mouseMoveEvent(event)
        shapes = Qt.CursorShape
        self.setCursor(shapes.PointingHandCursor if self.pointed else shapes.ArrowCursor)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Use the point."""
        mark = self.mark_near(event.position())
        if event.button() == Qt.MouseButton.LeftButton and mark is not None:
            self._accuracy.use(mark.of)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Go from point to point; Return uses one."""
        if event.key() not in _USE or not self.marks:
            super().keyPressEvent(event)
        elif self.pointed is not None:
            self._accuracy.use(self.pointed.of)


def accuracy_chart(accuracy: AccuracyModel) -> Chart:
    """Points, their front, and the plan in use; empty before anything was measured."""
    measured, in_use, current = accuracy.measured, accuracy.in_use, accuracy.current_point
    measurement = measured.measurement
    results = measurement.results if measurement is not None else ()
    front = front_at_rest(measurement) if measurement is not None else ()
    marks = [_mark(result, result in front, result is current) for result in results]
    costs = Scale.around([mark.x for mark in marks], 1.5, 10.0, tick_text)
    shown = [100 * accuracy.tolerance, *(mark.y for mark in marks)]
    errors = Scale.around(shown, 1.5, 10.0, _error_text, _FLOOR_PERCENT)
    best = next((mark for mark in marks if mark.of is current), None)
    if best is None and in_use is not None and measured.family == in_use.plan.family:
        # Where it was estimated, which may be off the axes.
        best = Mark(min(in_use.cost_ms, costs.high), min(100 * in_use.error, errors.high), "")
    return Chart(
        costs,
        errors,
        "cost (ms per frame)",
        "error (%)",
        _curves(measurement, marks, costs.high) if measurement is not None else (),
        marks,
        best,
        scattered=True,
    )


def _mark(result: PlanResult, in_front: bool, in_use: bool) -> Mark:
    """Point of a plan; one on the front is pointed at before others as near."""
    words = point_text(result)
    if in_use:
        tip = f"In use\n{words}"
    elif result.plan.family != "histogram":
        tip = f"For comparison\n{words}"
    elif not serves_at_rest(result):
        tip = f"For a sensor that moves\n{words}"
    else:
        tip = f"{words}\nClick to use it"
    pull_px = 2.0 if in_front else 0.0
    x, y = result.cost.all_cores_ms.median, min(100 * result.errors.l1, _CEILING_PERCENT)
    return Mark(x, y, words, tip=tip, of=result, pull_px=pull_px)


def _curves(measurement: Measurement, marks: Sequence[Mark], highest_ms: float) -> list[Curve]:
    """Points of all plans, and the front in steps: it has the error of the cheaper neighbour."""
    colour = "synthetic" if measurement.family == "histogram" else "real"
    if measurement.stale:
        colour = "muted"
    front = [(mark.x, mark.y) for mark in marks if mark.pull_px]
    others = [mark for mark in marks if not mark.pull_px]
    resting = [(mark.x, mark.y) for mark in others if serves_at_rest(mark.of)]
    moving = [(mark.x, mark.y) for mark in others if not serves_at_rest(mark.of)]
    ends = [*(x for x, _ in front[1:]), highest_ms]
    steps = [(x, y) for (start, y), end in zip(front, ends, strict=False) for x in (start, end)]
    return [
        Curve("", "muted", resting, width_px=0, dot_px=1.5),
        Curve("", "muted", moving, width_px=0, dot_px=3.0, hollow=True),
        Curve("", colour, steps, width_px=1.5),
        Curve("", colour, front, width_px=0, dot_px=3.0),
    ]


def _error_text(value: float) -> str:
    return f"{'≤' if value <= _FLOOR_PERCENT * 1.001 else ''}{tick_text(value)}"
