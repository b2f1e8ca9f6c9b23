"""Axes of plots, and the colours that they are drawn in."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Protocol

from PySide6.QtCore import QPointF, QRectF, Qt, SignalInstance
from PySide6.QtGui import QColor, QPainter, QPen

from sd2app.palette import Palette
from sd2app.widgets.canvas import AT_RIGHT

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
        painter.drawText(box, AT_RIGHT, text)
    painter.setPen(QPen(QColor(colours.hatch), 1))
    painter.drawLine(plot.bottomLeft(), plot.bottomRight())
    painter.drawLine(plot.topLeft(), plot.bottomLeft())
    painter.setPen(ink)
    name = QRectF(plot.left(), plot.bottom() + line_px + 3, plot.width(), line_px)
    painter.drawText(name, Qt.AlignmentFlag.AlignCenter, below)
