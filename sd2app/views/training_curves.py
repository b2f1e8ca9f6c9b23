"""Errors of a training run over its epochs, on a logarithmic axis."""

from __future__ import annotations

import math
from dataclasses import dataclass

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
from sd2app.models.training import TrainingModel
from sd2app.models.training_history import EpochPoint, TrainingHistory
from sd2app.models.training_words import point_text
from sd2app.views.log_axis import LogAxis, tick_text
from sd2app.views.time_axis import ticks

_LEFT_PX, _TOP_PX, _RIGHT_PX, _BOTTOM_PX = 48, 24, 10, 36
_PAD = 1.12
_LEAST_RATIO = 1.6
_ROUND = ((1,), (1, 3), (1, 2, 5), (1, 2, 3, 5, 7), (1, 1.5, 2, 3, 4, 5, 6, 8))
_STEPS = {Qt.Key.Key_Left: -1, Qt.Key.Key_Right: 1}
_TAKES = {Qt.Key.Key_Home, Qt.Key.Key_End, Qt.Key.Key_Escape, *_STEPS}


@dataclass(frozen=True)
class _Scale:
    """Epochs and errors to pixels; worked out once for all that is drawn."""

    left_px: float
    per_epoch_px: float
    errors: LogAxis

    def x_of(self, epoch: float) -> float:
        return self.left_px + self.per_epoch_px * epoch

    def place_of(self, epoch: float, rmse: float) -> QPointF:
        return QPointF(self.x_of(epoch), self.errors.px(rmse))


class TrainingCurves(QWidget):
    """Training and validation, the best epoch marked.

    Hovering says what an epoch came to; with the keyboard Left and Right go from epoch
    to epoch, Home and End to the first and the last, Escape gives the keyboard back.
    """

    def __init__(
        self, training: TrainingModel, display: DisplayModel, parent: QWidget | None = None
    ) -> None:
        super().__init__(parent)
        self._training = training
        self._display = display
        self._pointed: int | None = None
        self.setMouseTracking(True)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setMinimumHeight(160)
        self.setMaximumHeight(280)
        self.setAccessibleName("Errors over the epochs")
        training.changed.connect(self._refresh)
        display.theme_changed.connect(self.update)

    def sizeHint(self) -> QSize:
        """A little wider than high."""
        return QSize(260, 176)

    @property
    def pointed(self) -> EpochPoint | None:
        """The epoch under the pointer, or the one the keyboard is at."""
        points = self._history.epoch_points
        return next((point for point in points if point.epoch == self._pointed), None)

    @property
    def _history(self) -> TrainingHistory:
        run = self._training.run
        return run.history if run is not None else TrainingHistory()

    # --- places ---------------------------------------------------------------------------

    def plot_rect(self) -> QRectF:
        """Where curves are drawn."""
        return QRectF(self.rect()).adjusted(_LEFT_PX, _TOP_PX, -_RIGHT_PX, -_BOTTOM_PX)

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

    def paintEvent(self, event: QPaintEvent) -> None:
        """Axes, curves, the best epoch, and what is pointed at."""
        with QPainter(self) as painter:
            painter.setRenderHint(QPainter.RenderHint.Antialiasing)
            painter.fillRect(self.rect(), QColor(self._display.palette.panel))
            self._paint(painter)

    def _paint(self, painter: QPainter) -> None:
        colours, plot, history = self._display.palette, self.plot_rect(), self._history
        scale = self._scale()
        self._paint_axes(painter, plot, scale)
        self._paint_legend(painter, plot)
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
        if self.hasFocus():
            painter.setPen(QPen(QColor(colours.accent), 1))
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.drawRect(QRectF(self.rect()).adjusted(0.5, 0.5, -0.5, -0.5))

    def _paint_axes(self, painter: QPainter, plot: QRectF, scale: _Scale) -> None:
        colours, line_px = self._display.palette, painter.fontMetrics().height()
        grid, ink = QPen(QColor(colours.border), 1), QColor(colours.muted)
        last = self._last_epoch()
        for value in ticks(0.0, last, max(int(plot.width() / 48), 2)):
            if value != round(value) and last >= 2:
                continue
            x = scale.x_of(value)
            painter.setPen(grid)
            painter.drawLine(QPointF(x, plot.top()), QPointF(x, plot.bottom()))
            painter.setPen(ink)
            box = QRectF(x - 30, plot.bottom() + 3, 60, line_px)
            painter.drawText(box, Qt.AlignmentFlag.AlignCenter, f"{value:g}")
        for value in error_ticks(scale.errors, max(int(plot.height() / (1.8 * line_px)), 2)):
            y = scale.errors.px(value)
            painter.setPen(grid)
            painter.drawLine(QPointF(plot.left(), y), QPointF(plot.right(), y))
            painter.setPen(ink)
            box = QRectF(0, y - line_px / 2, _LEFT_PX - 6, line_px)
            right = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
            painter.drawText(box, right, tick_text(value))
        painter.setPen(QPen(QColor(colours.hatch), 1))
        painter.drawLine(plot.bottomLeft(), plot.bottomRight())
        painter.drawLine(plot.topLeft(), plot.bottomLeft())
        painter.setPen(ink)
        painter.drawText(
            QRectF(plot.left(), plot.bottom() + line_px + 3, plot.width(), line_px),
            Qt.AlignmentFlag.AlignCenter,
            "epochs",
        )

    def _paint_legend(self, painter: QPainter, plot: QRectF) -> None:
        colours, metrics = self._display.palette, painter.fontMetrics()
        painter.setPen(QColor(colours.muted))
        painter.drawText(QRectF(4, 0, 60, 20), Qt.AlignmentFlag.AlignVCenter, "RMSE")
        x = plot.right()
        for text, colour in (("validation", colours.real), ("training", colours.synthetic)):
            width = metrics.horizontalAdvance(text)
            x -= width
            painter.setPen(QColor(colours.muted))
            painter.drawText(QRectF(x, 0, width + 2, 20), Qt.AlignmentFlag.AlignVCenter, text)
            painter.setPen(QPen(QColor(colour), 2))
            painter.drawLine(QPointF(x - 18, 10), QPointF(x - 5, 10))
            x -= 30

    def _paint_line(
        self, painter: QPainter, points: list[tuple[float, float]], pen: QPen, scale: _Scale
    ) -> None:
        line = QPolygonF(
            [scale.place_of(at, rmse) for at, rmse in points if math.isfinite(rmse) and rmse > 0]
        )
        painter.setPen(pen)
        if len(line) == 1:
            painter.setBrush(pen.color())
            painter.drawEllipse(line[0], 2.0, 2.0)
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawPolyline(line)

    def _paint_marks(self, painter: QPainter, plot: QRectF, scale: _Scale) -> None:
        """A ring around the best epoch; a line where somebody points."""
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
        """Say what the epoch under the pointer came to."""
        plot, points = self.plot_rect(), self._history.epoch_points
        x, scale = event.position().x(), self._scale()
        inside = plot.left() - 4 <= x <= plot.right() + 4
        nearest = min(points, key=lambda one: abs(scale.x_of(one.epoch) - x), default=None)
        self._point_at(nearest if inside else None)
        self._explain()

    def leaveEvent(self, event: QEvent) -> None:
        """Point at nothing."""
        super().leaveEvent(event)
        if not self.hasFocus():
            self._point_at(None)

    def _point_at(self, point: EpochPoint | None) -> None:
        epoch = point.epoch if point is not None else None
        if epoch != self._pointed:
            self._pointed = epoch
            self.setAccessibleDescription(point_text(point) if point is not None else "")
            self.update()

    def _explain(self) -> None:
        point = self.pointed
        if point is None:
            QToolTip.hideText()
            return
        place = QPointF(self._scale().x_of(point.epoch), self.plot_rect().center().y())
        QToolTip.showText(self.mapToGlobal(place.toPoint()), point_text(point), self)

    # --- keyboard -------------------------------------------------------------------------

    def event(self, event: QEvent) -> bool:
        """Arrows belong to the plot while it has the keyboard."""
        if (
            event.type() == QEvent.Type.ShortcutOverride
            and isinstance(event, QKeyEvent)
            and event.modifiers() == Qt.KeyboardModifier.NoModifier
            and event.key() in _TAKES
            and self._history.epoch_points
        ):
            event.accept()
            return True
        if isinstance(event, QHelpEvent):
            return True
        return super().event(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Go from epoch to epoch."""
        points, key = self._history.epoch_points, event.key()
        if not points or key not in _TAKES:
            super().keyPressEvent(event)
        elif key == Qt.Key.Key_Escape:
            self.clearFocus()
        else:
            here = self.pointed or self._history.best or points[-1]
            at = points.index(here)
            if key in (Qt.Key.Key_Home, Qt.Key.Key_End):
                at = 0 if key == Qt.Key.Key_Home else len(points) - 1
            elif self.pointed is not None:
                at = min(max(at + _STEPS[Qt.Key(key)], 0), len(points) - 1)
            self._point_at(points[at])
            self._explain()

    def focusInEvent(self, event: QFocusEvent) -> None:
        """Show where the keyboard is."""
        super().focusInEvent(event)
        if event.reason() != Qt.FocusReason.MouseFocusReason:
            self._point_at(self._history.best)
        self.update()

    def focusOutEvent(self, event: QFocusEvent) -> None:
        """Point at nothing."""
        super().focusOutEvent(event)
        self._point_at(None)
        QToolTip.hideText()


def error_ticks(axis: LogAxis, most: int) -> list[float]:
    """As many round values as there is room for, also on less than a decade."""
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
