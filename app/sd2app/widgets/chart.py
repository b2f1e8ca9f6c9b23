"""Curves over two axes, read by pointer and keyboard."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from PySide6.QtCore import QEvent, QPointF, QRectF, QSize, Qt
from PySide6.QtGui import (
    QColor,
    QFocusEvent,
    QHelpEvent,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QPen,
    QPolygonF,
)
from PySide6.QtWidgets import QSizePolicy, QToolTip

from sd2app.widgets.canvas import Canvas, Themed, clipped, paint_axes
from sd2app.widgets.time_axis import ticks

ROUND = ((1,), (1, 3), (1, 2, 5), (1, 2, 3, 5, 7), (1, 1.5, 2, 3, 4, 5, 6, 8))
"""Values within a decade, the fewest first; the last ones for axes shorter than a decade."""
_CAP_PX = 3.0


@dataclass(frozen=True)
class Scale:
    """Axis of a chart."""

    low: float
    high: float
    log: bool = False
    whole: bool = False  # ticks at whole numbers only
    values: tuple[float, ...] = ()  # ticks; round numbers where none are given
    text: Callable[[float], str] = lambda value: f"{value:g}".replace("-", "−")  # of a tick

    @classmethod
    def around(
        cls,
        values: Sequence[float],
        room: float,
        least_ratio: float,
        text: Callable[[float], str],
        floor: float = 0.0,
    ) -> Scale:
        """Logarithmic axis around positive values, by a factor of ``room`` beyond either end.

        It spans at least a factor of ``least_ratio``. What lies below ``floor``, zero included,
        stands on its edge.
        """
        shown = [max(value, floor) for value in values if max(value, floor) > 0] or [1.0]
        low, high = min(shown) / room, max(shown) * room
        if high < least_ratio * low:
            middle, half = math.sqrt(low * high), math.sqrt(least_ratio)
            low, high = middle / half, middle * half
        return cls(max(low, floor), high, log=True, text=text)

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
            return log_ticks(0.999 * self.low, 1.001 * self.high, most)
        values = ticks(self.low, self.high, most)
        return [value for value in values if value == round(value)] if self.whole else values


def log_ticks(low: float, high: float, most: int) -> list[float]:
    """Round values of a logarithmic axis, as many of each decade as there is room for."""
    first, last = (math.floor(math.log10(end)) for end in (low, high))
    chosen: list[float] = []
    for steps in ROUND:
        values = [
            step * 10.0**power
            for power in range(first, last + 1)
            for step in steps
            if low <= step * 10.0**power <= high
        ]
        if len(chosen) < len(values) <= most:
            chosen = values
    decades = [10.0**power for power in range(first, last + 1) if low <= 10.0**power <= high]
    return chosen or decades[:: -(-len(decades) // most)]


@dataclass(frozen=True)
class Curve:
    """Line through points, with dots and bars where wanted."""

    name: str  # in the legend; empty: not in it
    colour: str  # its name in the palette
    points: Sequence[tuple[float, float]]
    width_px: float = 2.0  # zero: dots alone
    alpha: int = 255
    dot_px: float = 0.0
    hollow: bool = False  # dots are rings
    bars: Sequence[float] = ()  # half the height of each point's bar
    aside_px: float = 0.0  # shift, so that bars do not cover each other


@dataclass(frozen=True)
class Mark:
    """Point that can be pointed at, and its description."""

    x: float
    y: float
    words: str
    aside_px: float = 0.0
    tip: str = ""  # description on screen, where it says more, such as what can be done
    of: Any = None  # what the point stands for
    pull_px: float = 0.0  # taken before others that are nearer by less than this


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


_ENDS = (Qt.Key.Key_Home, Qt.Key.Key_End)


class ChartView(Canvas):
    """Curves with a legend.

    Left and Right go from mark to mark, Home and End, where they do nothing in the window, to the
    first and the last. Escape gives the keyboard back. ``name`` is for screen readers.
    """

    MARGINS_PX: ClassVar = (48, 26, 12, 38)
    """Left, top, right and bottom margins of the plot."""
    HEIGHTS_PX: ClassVar = (160, 176, 280)
    """Least, preferred and greatest height."""
    REACH_PX: ClassVar = 14.0
    """Distance up to which the pointer is at a scattered mark."""
    STEPS: ClassVar[Mapping[Qt.Key, int]] = {Qt.Key.Key_Left: -1, Qt.Key.Key_Right: 1}
    """Keys that go to a neighbouring mark."""
    KEYS: ClassVar = frozenset({Qt.Key.Key_Escape})
    """Further keys that belong to the chart while it has the keyboard."""

    def __init__(self, display: Themed, name: str, chart: Chart) -> None:
        super().__init__()
        self._display, self._chart = display, chart
        self.pointed: Mark | None = None  # under the pointer, or where the keyboard is
        self.setMouseTracking(True)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setMinimumHeight(self.HEIGHTS_PX[0])
        self.setMaximumHeight(self.HEIGHTS_PX[2])
        self.setAccessibleName(name)
        self.follow(display.theme_changed)

    def sizeHint(self) -> QSize:
        """Size a little wider than high."""
        return QSize(260, self.HEIGHTS_PX[1])

    def show_chart(self, chart: Chart) -> None:
        """Show other curves; what was pointed at stays so."""
        self._chart, before = chart, self.pointed
        if before is not None:
            same = (mark for mark in chart.marks if (mark.x, mark.of) == (before.x, before.of))
            self.pointed = next(same, None)
        self.update()

    def plot_rect(self) -> QRectF:
        """Rectangle of the plot, in pixels."""
        left, top, right, bottom = self.MARGINS_PX
        return QRectF(self.rect()).adjusted(left, top, -right, -bottom)

    def place_of(self, x: float, y: float) -> QPointF:
        """Pixel of a point."""
        plot, chart = self.plot_rect(), self._chart
        return QPointF(
            plot.left() + plot.width() * chart.across.share(x),
            plot.bottom() - plot.height() * chart.upwards.share(y),
        )

    def tip_place(self, mark: Mark) -> QPointF:
        """Pixel of the mark, or half way up the line at it."""
        place = self.place_of(mark.x, mark.y) + QPointF(mark.aside_px, 0)
        return place if self._chart.scattered else QPointF(place.x(), self.plot_rect().center().y())

    # --- pointing -------------------------------------------------------------------------

    @property
    def marks(self) -> Sequence[Mark]:
        """Points that can be pointed at."""
        return self._chart.marks

    def point_at(self, mark: Mark | None) -> None:
        """Point at a mark, or at nothing."""
        if mark is not self.pointed:
            self.pointed = mark
            self.setAccessibleDescription(mark.words if mark is not None else "")
            self.update()

    def explain(self) -> None:
        """Show what is pointed at in words, beside it."""
        mark = self.pointed
        if mark is None:
            QToolTip.hideText()
            return
        place = self.mapToGlobal(self.tip_place(mark).toPoint())
        QToolTip.showText(place, mark.tip or mark.words, self)

    def mark_near(self, where: QPointF) -> Mark | None:
        """The nearest mark, if a pointer at this pixel is at one."""
        plot, scattered = self.plot_rect(), self._chart.scattered

        def far_px(mark: Mark) -> float:
            away = self.tip_place(mark) - where
            far = math.hypot(away.x(), away.y()) if scattered else abs(away.x())
            return far - mark.pull_px

        nearest = min(self.marks, key=far_px, default=None)
        if nearest is not None and scattered:
            is_near = far_px(nearest) <= self.REACH_PX
        else:
            is_near = plot.left() - 4 <= where.x() <= plot.right() + 4
        return nearest if is_near else None

    def along(self, key: Qt.Key) -> Sequence[Mark]:
        """Marks that a key goes through, in order."""
        return self.marks

    def _arrival(self) -> Mark | None:
        """Mark at which the keyboard arrives: the best, or the first one."""
        best = self._chart.best
        return best if best in self.marks else next(iter(self.marks), None)

    # --- painting -------------------------------------------------------------------------

    def paint(self, painter: QPainter) -> None:
        """The chart, in a frame while it has the keyboard."""
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.fillRect(self.rect(), QColor(self._display.palette.panel))
        self.paint_chart(painter)
        if self.hasFocus():
            painter.setPen(QPen(QColor(self._display.palette.accent), 1))
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.drawRect(QRectF(self.rect()).adjusted(0.5, 0.5, -0.5, -0.5))

    def paint_chart(self, painter: QPainter) -> None:
        """Axes, legend, curves, the best mark, and what is pointed at."""
        chart, plot = self._chart, self.plot_rect()
        across, upwards = chart.across, chart.upwards
        widest = max(int(plot.width() / (44 if across.log else 52)), 2)
        most = max(int(plot.height() / (1.8 * painter.fontMetrics().height())), 2)
        at = self.place_of
        columns = [(at(one, upwards.low).x(), across.text(one)) for one in across.ticks(widest)]
        lines = [(at(across.low, one).y(), upwards.text(one)) for one in upwards.ticks(most)]
        paint_axes(painter, plot, self._display.palette, columns, lines, chart.below)
        self._paint_legend(painter)
        with clipped(painter, plot.adjusted(-8, -8, 8, 8)):
            for curve in chart.curves:
                self._paint_curve(painter, curve)
            self.paint_marks(painter)

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
        painter.setBrush(Qt.BrushStyle.NoBrush)
        if curve.width_px:
            painter.setPen(QPen(colour, curve.width_px))
            painter.drawPolyline(QPolygonF(places))
        painter.setPen(QPen(colour, 1))
        for (x, y), half in zip(curve.points, curve.bars, strict=False):
            ends = [self.place_of(x, y + sign * half) + QPointF(aside, 0) for sign in (-1, 1)]
            painter.drawLine(*ends)
            for end in ends:
                painter.drawLine(end - QPointF(_CAP_PX, 0), end + QPointF(_CAP_PX, 0))
        radius_px = curve.dot_px or (2.0 if len(places) == 1 else 0.0)
        if radius_px:
            if not curve.hollow:
                painter.setBrush(colour)
            for (_, y), place in zip(curve.points[::every], places, strict=True):
                if y >= self._chart.upwards.low:
                    painter.drawEllipse(place, radius_px, radius_px)
                else:  # on the edge: an arrow down, its value is off the axis
                    wide = radius_px + 1
                    corners = ((-wide, -radius_px), (wide, -radius_px), (0, wide))
                    painter.drawPolygon(QPolygonF([place + QPointF(*one) for one in corners]))

    def paint_marks(self, painter: QPainter) -> None:
        """Draw a ring around the best mark; a ring, or a line, at the pointed one."""
        palette, best, pointed = self._display.palette, self._chart.best, self.pointed
        painter.setBrush(Qt.BrushStyle.NoBrush)
        if best is not None and math.isfinite(best.y):
            place, radius_px = self.place_of(best.x, best.y), 5.0
            painter.setPen(QPen(QColor(palette.text), 1.5))
            if self._chart.scattered:  # it stands out among many
                radius_px = 7.0
                painter.setBrush(QColor(palette.text))
                painter.drawEllipse(place, 3.0, 3.0)
                painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.drawEllipse(place, radius_px, radius_px)
        if pointed is not None and self._chart.scattered:
            painter.setPen(QPen(QColor(palette.accent), 1.5))
            painter.drawEllipse(self.tip_place(pointed), 6.0, 6.0)
        elif pointed is not None:
            x, plot = self.tip_place(pointed).x(), self.plot_rect()
            painter.setPen(QPen(QColor(palette.accent), 1, Qt.PenStyle.DashLine))
            painter.drawLine(QPointF(x, plot.top()), QPointF(x, plot.bottom()))

    # --- pointer and keyboard ---------------------------------------------------------------

    def event(self, event: QEvent) -> bool:
        """Claim the chart's keys while it has the keyboard."""
        if (
            event.type() == QEvent.Type.ShortcutOverride
            and isinstance(event, QKeyEvent)
            and event.modifiers() == Qt.KeyboardModifier.NoModifier
            and (event.key() in self.KEYS or event.key() in self.STEPS)
            and self.marks
        ):
            event.accept()
            return True
        if isinstance(event, QHelpEvent):
            return True
        return super().event(event)

    def focusInEvent(self, event: QFocusEvent) -> None:
        """Show the keyboard focus."""
        super().focusInEvent(event)
        if event.reason() != Qt.FocusReason.MouseFocusReason:
            self.point_at(self._arrival())
        self.update()

    def focusOutEvent(self, event: QFocusEvent) -> None:
        """Remove the mark of the pointed point."""
        super().focusOutEvent(event)
        self.point_at(None)
        QToolTip.hideText()

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Point at the mark that is nearest to the pointer."""
        self.point_at(self.mark_near(event.position()))
        self.explain()

    def leaveEvent(self, event: QEvent) -> None:
        """Remove the mark of the pointed point."""
        super().leaveEvent(event)
        if not self.hasFocus():
            self.point_at(None)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Go from mark to mark."""
        key = Qt.Key(event.key())
        if not self.marks or key not in {*self.KEYS, *self.STEPS, *_ENDS}:
            super().keyPressEvent(event)
        elif key == Qt.Key.Key_Escape:
            self.clearFocus()
        else:
            self.point_at(self._next(self.along(key), key))
            self.explain()

    def _next(self, along: Sequence[Mark], key: Qt.Key) -> Mark | None:
        """The mark that a key goes to; from one that it does not go through, the nearest."""
        here = self.pointed
        if key in _ENDS:
            return along[0 if key == Qt.Key.Key_Home else -1]
        if here is None:
            return self._arrival()
        if here in along:
            return along[min(max(along.index(here) + self.STEPS[key], 0), len(along) - 1)]
        place = self.tip_place(here)
        return min(along, key=lambda mark: (self.tip_place(mark) - place).manhattanLength())
