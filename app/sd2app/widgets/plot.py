"""Base classes of plots: axes, points under the pointer and points reached by keyboard."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol

from PySide6.QtCore import QEvent, QPointF, QRectF, QSize, Qt, SignalInstance
from PySide6.QtGui import QColor, QFocusEvent, QHelpEvent, QKeyEvent, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QSizePolicy, QToolTip, QWidget

from sd2app.palette import Palette

Tick = tuple[float, str]
"""A pixel along an axis, and its text."""


class Themed(Protocol):
    """Colours of the window, which the user may change."""

    @property
    def palette(self) -> Palette:
        """Colours in use."""

    @property
    def theme_changed(self) -> SignalInstance:
        """Emitted when they change."""


@dataclass(frozen=True)
class LogAxis:
    """Values from ``low`` to ``high`` on pixels from ``start_px`` to ``end_px``.

    What lies below ``low``, zero included, stands on the edge.
    """

    low: float
    high: float
    start_px: float
    end_px: float

    @classmethod
    def around(
        cls, values: list[float], start_px: float, end_px: float, *, floor: float = 0.0
    ) -> LogAxis:
        """An axis with some room around positive values; nothing below ``floor`` is shown."""
        shown = [max(value, floor) for value in values if max(value, floor) > 0] or [1.0]
        low, high = min(shown) / 1.5, max(shown) * 1.5
        return cls(max(low, floor), max(high, 10 * max(low, floor)), start_px, end_px)

    def px(self, value: float) -> float:
        """Pixel of a value."""
        clamped = min(max(value, self.low), self.high)
        share = math.log(clamped / self.low) / math.log(self.high / self.low)
        return self.start_px + share * (self.end_px - self.start_px)

    def is_below(self, value: float) -> bool:
        """True if a value lies below the axis and is drawn on its edge."""
        return value < self.low

    def ticks(self, most: int) -> list[float]:
        """Values to write: decades, and 2 and 5 times them where there is room."""
        return log_ticks(0.999 * self.low, 1.001 * self.high, most, ((1,), (1, 3), (1, 2, 5)))


def log_ticks(low: float, high: float, most: int, choice: Sequence[Sequence[float]]) -> list[float]:
    """Values of a logarithmic axis: of each decade these ones, as many as there is room for."""
    first, last = (math.floor(math.log10(end)) for end in (low, high))
    found: list[float] = []
    for steps in choice:
        values = [
            step * 10.0**power
            for power in range(first, last + 1)
            for step in steps
            if low <= step * 10.0**power <= high
        ]
        if len(found) < len(values) <= most:
            found = values
    decades = [10.0**power for power in range(first, last + 1) if low <= 10.0**power <= high]
    return found or decades[:: -(-len(decades) // most)]


def tick_text(value: float) -> str:
    """Short text of a tick, without exponents."""
    return f"{value:.10f}".rstrip("0").rstrip(".")


def paint_axes(
    painter: QPainter,
    plot: QRectF,
    colours: Palette,
    across: Iterable[Tick],
    upwards: Iterable[Tick],
    below: str,
) -> None:
    """Paint both axes with their grid and the name of the lower one; the pen is muted then."""
    line_px = painter.fontMetrics().height()
    grid, ink = QPen(QColor(colours.border), 1), QColor(colours.muted)
    for x, text in across:
        painter.setPen(grid)
        painter.drawLine(QPointF(x, plot.top()), QPointF(x, plot.bottom()))
        painter.setPen(ink)
        box = QRectF(x - 30, plot.bottom() + 3, 60, line_px)
        painter.drawText(box, Qt.AlignmentFlag.AlignCenter, text)
    for y, text in upwards:
        painter.setPen(grid)
        painter.drawLine(QPointF(plot.left(), y), QPointF(plot.right(), y))
        painter.setPen(ink)
        box = QRectF(0, y - line_px / 2, plot.left() - 6, line_px)
        right = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
        painter.drawText(box, right, text)
    painter.setPen(QPen(QColor(colours.hatch), 1))
    painter.drawLine(plot.bottomLeft(), plot.bottomRight())
    painter.drawLine(plot.topLeft(), plot.bottomLeft())
    painter.setPen(ink)
    name = QRectF(plot.left(), plot.bottom() + line_px + 3, plot.width(), line_px)
    painter.drawText(name, Qt.AlignmentFlag.AlignCenter, below)


class PointPlot(QWidget):
    """Base of plots of points with axes, a point under the pointer and a keyboard focus.

    A plot says what its points are, where they stand and what they mean, and draws them.
    ``name`` is for screen readers.
    """

    MARGINS_PX: ClassVar[tuple[int, int, int, int]]
    """Left, top, right and bottom margins of the plot."""
    HEIGHTS_PX: ClassVar[tuple[int, int, int]]
    """Least, preferred and greatest height."""
    KEYS: ClassVar[frozenset[Qt.Key]]
    """Keys that belong to the plot while it has the keyboard."""

    def __init__(self, display: Themed, name: str, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._display = display
        self._pointed: Any = None
        self.setMouseTracking(True)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setMinimumHeight(self.HEIGHTS_PX[0])
        self.setMaximumHeight(self.HEIGHTS_PX[2])
        self.setAccessibleName(name)
        display.theme_changed.connect(self.update)

    def sizeHint(self) -> QSize:
        """Size a little wider than high."""
        return QSize(260, self.HEIGHTS_PX[1])

    # --- what a plot says of itself -------------------------------------------------------

    def points(self) -> Sequence[Any]:
        """Points that can be pointed at."""
        raise NotImplementedError

    def first_point(self) -> Any:
        """The point at which the keyboard arrives, or None."""
        raise NotImplementedError

    def tip_place(self, point: Any) -> QPointF:
        """The pixel beside which a point is explained."""
        raise NotImplementedError

    def words_of(self, point: Any) -> str:
        """Description of a point, for the screen reader."""
        raise NotImplementedError

    def tip_of(self, point: Any) -> str:
        """Description of a point on screen, perhaps with possible actions."""
        return self.words_of(point)

    def paint_plot(self, painter: QPainter) -> None:
        """Draw everything but the ground and the focus."""
        raise NotImplementedError

    # --- painting -------------------------------------------------------------------------

    def plot_rect(self) -> QRectF:
        """Rectangle of the plot, in pixels."""
        left, top, right, bottom = self.MARGINS_PX
        return QRectF(self.rect()).adjusted(left, top, -right, -bottom)

    def paintEvent(self, event: QPaintEvent) -> None:
        """The plot, in a frame while it has the keyboard."""
        with QPainter(self) as painter:
            painter.setRenderHint(QPainter.RenderHint.Antialiasing)
            painter.fillRect(self.rect(), QColor(self._display.palette.panel))
            self.paint_plot(painter)
            if self.hasFocus():
                painter.setPen(QPen(QColor(self._display.palette.accent), 1))
                painter.setBrush(Qt.BrushStyle.NoBrush)
                painter.drawRect(QRectF(self.rect()).adjusted(0.5, 0.5, -0.5, -0.5))

    def paint_axes(
        self, painter: QPainter, across: Iterable[Tick], upwards: Iterable[Tick], below: str
    ) -> None:
        """Both axes with their grid and what the lower one is called; the pen is muted then."""
        paint_axes(painter, self.plot_rect(), self._display.palette, across, upwards, below)

    def most_upwards(self, painter: QPainter) -> int:
        """Number of ticks for which the left axis has room."""
        return max(int(self.plot_rect().height() / (1.8 * painter.fontMetrics().height())), 2)

    # --- pointing -------------------------------------------------------------------------

    @property
    def pointed(self) -> Any:
        """The point under the pointer, or the one the keyboard is at."""
        return self._pointed

    def point_at(self, point: Any) -> None:
        """Point at a point, or at nothing."""
        if point is not self._pointed:
            self._pointed = point
            self.setAccessibleDescription(self.words_of(point) if point is not None else "")
            self.update()

    def explain(self) -> None:
        """Show what is pointed at in words, beside it."""
        point = self.pointed
        if point is None:
            QToolTip.hideText()
            return
        QToolTip.showText(
            self.mapToGlobal(self.tip_place(point).toPoint()), self.tip_of(point), self
        )

    # --- keyboard -------------------------------------------------------------------------

    def event(self, event: QEvent) -> bool:
        """Claim the plot's keys while it has the keyboard."""
        if (
            event.type() == QEvent.Type.ShortcutOverride
            and isinstance(event, QKeyEvent)
            and event.modifiers() == Qt.KeyboardModifier.NoModifier
            and event.key() in self.KEYS
            and self.points()
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
            self.point_at(self.first_point())
        self.update()

    def focusOutEvent(self, event: QFocusEvent) -> None:
        """Remove the mark of the pointed point."""
        super().focusOutEvent(event)
        self.point_at(None)
        QToolTip.hideText()
