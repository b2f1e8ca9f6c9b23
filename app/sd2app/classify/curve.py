"""Recall of a classifier while it learns, on the people held out to choose the best."""

from __future__ import annotations

from PySide6.QtCore import QPointF, Qt
from PySide6.QtGui import QColor, QMouseEvent, QPainter, QPen, QPolygonF
from PySide6.QtWidgets import QWidget

from sd2app.classify.run import CheckPoint, ClassHistory
from sd2app.classify.training import ClassTraining
from sd2app.session.display import DisplayModel
from sd2app.widgets.plot import SteppedPlot
from sd2app.widgets.time_axis import ticks


class ClassCurve(SteppedPlot):
    """Recall in per cent and, faint, the loss as a share of the first one, over the steps.

    Hovering says what a look came to, as the keyboard does.
    """

    MARGINS_PX = (40, 24, 10, 36)
    HEIGHTS_PX = (140, 168, 260)

    def __init__(
        self, training: ClassTraining, display: DisplayModel, parent: QWidget | None = None
    ) -> None:
        super().__init__(display, "Recall over the steps", parent)
        self._training = training
        training.changed.connect(self.update)

    @property
    def _history(self) -> ClassHistory:
        run = self._training.run
        return run.history if run is not None else ClassHistory()

    def points(self) -> list[CheckPoint]:
        """The validation checks so far."""
        return self._history.checks

    def first_point(self) -> CheckPoint | None:
        """The best one."""
        return self._history.best

    def tip_place(self, point: CheckPoint) -> QPointF:
        """At the point."""
        return self.place_of(point.step, point.recall)

    def words_of(self, point: CheckPoint) -> str:
        """Recall at a check in words."""
        best = ", better than all before" if point.best else ""
        return f"Step {point.step}{best}\nRecall {100 * point.recall:.1f} %"

    def place_of(self, step: float, share: float) -> QPointF:
        """Pixel of a share after so many steps."""
        plot, total = self.plot_rect(), max(self._history.total, 1)
        return QPointF(
            plot.left() + plot.width() * step / total, plot.bottom() - plot.height() * share
        )

    # --- painting -------------------------------------------------------------------------

    def paint_plot(self, painter: QPainter) -> None:
        """Axes, loss, recall, the best, and what is pointed at."""
        colours, history = self._display.palette, self._history
        total = max(history.total, 1)
        across = ticks(0.0, float(total), max(int(self.plot_rect().width() / 56), 2))
        self.paint_axes(
            painter,
            [(self.place_of(value, 0.0).x(), f"{value:g}") for value in across],
            [(self.place_of(0.0, share / 100).y(), f"{share}") for share in (0, 25, 50, 75, 100)],
            "steps",
        )
        self.paint_legend(
            painter, "%", [("loss", colours.synthetic), ("recall, validation", colours.real)]
        )
        if history.losses:
            first = max(history.losses[0].loss, 1e-9)
            faint = QColor(colours.synthetic)
            faint.setAlpha(110)
            places = [self.place_of(one.step, min(one.loss / first, 1.0)) for one in history.losses]
            painter.setPen(QPen(faint, 1))
            painter.drawPolyline(QPolygonF(places))
        painter.setPen(QPen(QColor(colours.real), 2))
        places = [self.place_of(one.step, one.recall) for one in history.checks]
        painter.drawPolyline(QPolygonF(places))
        painter.setBrush(QColor(colours.real))
        for place in places:
            painter.drawEllipse(place, 2.0, 2.0)
        painter.setBrush(Qt.BrushStyle.NoBrush)
        for point, colour in ((history.best, colours.text), (self.pointed, colours.accent)):
            if point is not None:
                painter.setPen(QPen(QColor(colour), 1.5))
                painter.drawEllipse(self.place_of(point.step, point.recall), 5.0, 5.0)

    # --- pointing -------------------------------------------------------------------------

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Point at the check nearest to the pointer."""
        x, points = event.position().x(), self.points()
        nearest = min(
            points, key=lambda one: abs(self.place_of(one.step, 0.0).x() - x), default=None
        )
        self.point_at(nearest if self.plot_rect().contains(event.position()) else None)
        self.explain()
