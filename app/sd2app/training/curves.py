"""Errors of a training run over its epochs, on a logarithmic axis."""

from __future__ import annotations

import math
from dataclasses import dataclass

from PySide6.QtCore import QEvent, QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QMouseEvent, QPainter, QPen, QPolygonF
from PySide6.QtWidgets import QWidget

from sd2app.session.display import DisplayModel
from sd2app.training.history import EpochPoint, TrainingHistory
from sd2app.training.model import TrainingModel
from sd2app.training.text import point_text
from sd2app.widgets.plot import LogAxis, SteppedPlot, tick_text
from sd2app.widgets.time_axis import ticks

_PAD = 1.12
_LEAST_RATIO = 1.6
_ROUND = ((1,), (1, 3), (1, 2, 5), (1, 2, 3, 5, 7), (1, 1.5, 2, 3, 4, 5, 6, 8))


@dataclass(frozen=True)
class _Scale:
    """Map from epochs and errors to pixels, computed once per paint."""

    left_px: float
    per_epoch_px: float
    errors: LogAxis

    def x_of(self, epoch: float) -> float:
        return self.left_px + self.per_epoch_px * epoch

    def place_of(self, epoch: float, rmse: float) -> QPointF:
        return QPointF(self.x_of(epoch), self.errors.px(rmse))


class TrainingCurves(SteppedPlot):
    """Training and validation, the best epoch marked.

    Hovering says what an epoch came to, as the keyboard does.
    """

    MARGINS_PX = (48, 24, 10, 36)
    HEIGHTS_PX = (160, 176, 280)

    def __init__(
        self, training: TrainingModel, display: DisplayModel, parent: QWidget | None = None
    ) -> None:
        super().__init__(display, "Errors over the epochs", parent)
        self._training = training
        training.changed.connect(self._refresh)

    def points(self) -> list[EpochPoint]:
        """The epochs that have ended."""
        return self._history.epoch_points

    def first_point(self) -> EpochPoint | None:
        """The best epoch."""
        return self._history.best

    def tip_place(self, point: EpochPoint) -> QPointF:
        """Pixel half way up the line at an epoch."""
        return QPointF(self._scale().x_of(point.epoch), self.plot_rect().center().y())

    def words_of(self, point: EpochPoint) -> str:
        """Errors of an epoch in words."""
        return point_text(point)

    @property
    def pointed(self) -> EpochPoint | None:
        """Current errors of the pointed epoch."""
        if self._pointed is None:
            return None
        return next((one for one in self.points() if one.epoch == self._pointed.epoch), None)

    @property
    def _history(self) -> TrainingHistory:
        run = self._training.run
        return run.history if run is not None else TrainingHistory()

    # --- places ---------------------------------------------------------------------------

    def place_of(self, epoch: float, rmse: float) -> QPointF:
        """Pixel of an error after so many epochs."""
        return self._scale().place_of(epoch, rmse)

    def _scale(self) -> _Scale:
        plot = self.plot_rect()
        return _Scale(plot.left(), plot.width() / self._last_epoch(), self._errors())

    def _last_epoch(self) -> float:
        history = self._history
        shown = [float(point.epoch) for point in history.epoch_points[-1:]]
        shown += [point.at for point in history.step_points[-1:]]
        return max(shown, default=1.0) or 1.0

    def _errors(self) -> LogAxis:
        history, plot = self._history, self.plot_rect()
        values = [
            value
            for point in history.epoch_points
            for value in (point.train_rmse, point.validation_rmse)
        ]
        if len(history.epoch_points) < 2:
            values += [point.train_rmse for point in history.step_points]
        shown = [value for value in values if math.isfinite(value) and value > 0] or [0.1, 1.0]
        low, high = min(shown) / _PAD, max(shown) * _PAD
        if high < _LEAST_RATIO * low:
            middle = math.sqrt(low * high)
            low, high = middle / math.sqrt(_LEAST_RATIO), middle * math.sqrt(_LEAST_RATIO)
        return LogAxis(low, high, plot.bottom(), plot.top())

    def _refresh(self) -> None:
        if self.pointed is None:
            self._pointed = None
        self.update()

    # --- painting -------------------------------------------------------------------------

    def paint_plot(self, painter: QPainter) -> None:
        """Axes, curves, the best epoch, and what is pointed at."""
        colours, plot, history = self._display.palette, self.plot_rect(), self._history
        scale = self._scale()
        self._paint_axes(painter, plot, scale)
        self.paint_legend(
            painter, "RMSE", [("training", colours.synthetic), ("validation", colours.real)]
        )
        painter.save()
        painter.setClipRect(plot.adjusted(-6, -6, 6, 6))
        faint = QColor(colours.synthetic)
        faint.setAlpha(80)
        # No more of them than there are pixels.
        every = max(1, round(len(history.step_points) / max(plot.width(), 1.0)))
        steps = [(point.at, point.train_rmse) for point in history.step_points[::every]]
        self._paint_line(painter, steps, QPen(faint, 1), scale)
        for colour, name in ((colours.synthetic, "train_rmse"), (colours.real, "validation_rmse")):
            points = [(float(one.epoch), getattr(one, name)) for one in history.epoch_points]
            self._paint_line(painter, points, QPen(QColor(colour), 2), scale)
        self._paint_marks(painter, plot, scale)
        painter.restore()

    def _paint_axes(self, painter: QPainter, plot: QRectF, scale: _Scale) -> None:
        last = self._last_epoch()
        whole = [
            value
            for value in ticks(0.0, last, max(int(plot.width() / 48), 2))
            if value == round(value) or last < 2
        ]
        errors = error_ticks(scale.errors, self.most_upwards(painter))
        self.paint_axes(
            painter,
            [(scale.x_of(value), f"{value:g}") for value in whole],
            [(scale.errors.px(value), tick_text(value)) for value in errors],
            "epochs",
        )

    def _paint_line(
        self, painter: QPainter, points: list[tuple[float, float]], pen: QPen, scale: _Scale
    ) -> None:
        line = [scale.place_of(at, rmse) for at, rmse in points if math.isfinite(rmse) and rmse > 0]
        painter.setPen(pen)
        if len(line) == 1:
            painter.setBrush(pen.color())
            painter.drawEllipse(line[0], 2.0, 2.0)
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawPolyline(QPolygonF(line))

    def _paint_marks(self, painter: QPainter, plot: QRectF, scale: _Scale) -> None:
        """Draw a ring around the best epoch and a line at the pointed one."""
        colours, best, pointed = self._display.palette, self._history.best, self.pointed
        painter.setBrush(Qt.BrushStyle.NoBrush)
        if best is not None and best.validation_rmse > 0:
            painter.setPen(QPen(QColor(colours.text), 1.5))
            painter.drawEllipse(scale.place_of(best.epoch, best.validation_rmse), 5.0, 5.0)
        if pointed is not None:
            x = scale.x_of(pointed.epoch)
            painter.setPen(QPen(QColor(colours.accent), 1, Qt.PenStyle.DashLine))
            painter.drawLine(QPointF(x, plot.top()), QPointF(x, plot.bottom()))

    # --- mouse ----------------------------------------------------------------------------

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Point at the epoch under the pointer."""
        plot, points = self.plot_rect(), self.points()
        x, scale = event.position().x(), self._scale()
        inside = plot.left() - 4 <= x <= plot.right() + 4
        nearest = min(points, key=lambda one: abs(scale.x_of(one.epoch) - x), default=None)
        self.point_at(nearest if inside else None)
        self.explain()

    def leaveEvent(self, event: QEvent) -> None:
        """Remove the mark of the pointed point."""
        super().leaveEvent(event)
        if not self.hasFocus():
            self.point_at(None)


def error_ticks(axis: LogAxis, most: int) -> list[float]:
    """Round tick values that fit into the axis, also over less than a decade."""
    first, last = (math.floor(math.log10(end)) for end in (axis.low, axis.high))
    found: list[float] = []
    for steps in _ROUND:
        values = [
            step * 10.0**power
            for power in range(first, last + 1)
            for step in steps
            if axis.low <= step * 10.0**power <= axis.high
        ]
        if len(found) < len(values) <= most:
            found = values
    return found or axis.ticks(most)
