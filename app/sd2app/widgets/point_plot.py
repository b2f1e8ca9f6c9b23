"""A plot whose points are told about when hovered over, and reached with the keyboard."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, ClassVar

from PySide6.QtCore import QEvent, QPointF, QRectF, QSize, Qt
from PySide6.QtGui import (
    QColor,
    QFocusEvent,
    QHelpEvent,
    QKeyEvent,
    QPainter,
    QPaintEvent,
    QPen,
)
from PySide6.QtWidgets import QSizePolicy, QToolTip, QWidget

from sd2app.session.display import DisplayModel

Tick = tuple[float, str]
"""A pixel along an axis, and what is written there."""


class PointPlot(QWidget):
    """Axes, the point that is pointed at, and who has the keyboard.

    A plot says what its points are, where they stand and what they mean, and draws them.

    Parameters
    ----------
    display : DisplayModel
    name : str
        What a screen reader calls it.
    """

    MARGINS_PX: ClassVar[tuple[int, int, int, int]]
    """Left, top, right and bottom of what is drawn on."""
    HEIGHTS_PX: ClassVar[tuple[int, int, int]]
    """Least, preferred and greatest."""
    KEYS: ClassVar[frozenset[Qt.Key]]
    """Those that belong to the plot while it has the keyboard."""

    def __init__(self, display: DisplayModel, name: str, parent: QWidget | None = None) -> None:
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
        """A little wider than high."""
        return QSize(260, self.HEIGHTS_PX[1])

    # --- what a plot says of itself -------------------------------------------------------

    def points(self) -> Sequence[Any]:
        """All that can be pointed at."""
        raise NotImplementedError

    def first_point(self) -> Any:
        """The point at which the keyboard arrives, or None."""
        raise NotImplementedError

    def tip_place(self, point: Any) -> QPointF:
        """The pixel beside which a point is explained."""
        raise NotImplementedError

    def words_of(self, point: Any) -> str:
        """What a point means."""
        raise NotImplementedError

    def tip_of(self, point: Any) -> str:
        """The same on screen, perhaps with what can be done."""
        return self.words_of(point)

    def paint_plot(self, painter: QPainter) -> None:
        """Draw everything but the ground and the focus."""
        raise NotImplementedError

    # --- painting -------------------------------------------------------------------------

    def plot_rect(self) -> QRectF:
        """Where points are drawn."""
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
        colours, plot = self._display.palette, self.plot_rect()
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
        painter.drawText(
            QRectF(plot.left(), plot.bottom() + line_px + 3, plot.width(), line_px),
            Qt.AlignmentFlag.AlignCenter,
            below,
        )

    def most_upwards(self, painter: QPainter) -> int:
        """How many numbers have room beside each other on the axis to the left."""
        return max(int(self.plot_rect().height() / (1.8 * painter.fontMetrics().height())), 2)

    # --- pointing -------------------------------------------------------------------------

    @property
    def pointed(self) -> Any:
        """The point under the pointer, or the one the keyboard is at."""
        return self._pointed

    def point_at(self, point: Any) -> None:
        """Point at one, or at nothing."""
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
        """Keys of the plot are not those of the window while it has the keyboard."""
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
        """Show where the keyboard is."""
        super().focusInEvent(event)
        if event.reason() != Qt.FocusReason.MouseFocusReason:
            self.point_at(self.first_point())
        self.update()

    def focusOutEvent(self, event: QFocusEvent) -> None:
        """Point at nothing."""
        super().focusOutEvent(event)
        self.point_at(None)
        QToolTip.hideText()
