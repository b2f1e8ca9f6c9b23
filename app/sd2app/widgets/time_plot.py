"""Base of the widgets that draw over the shared time axis, and what is drawn over them."""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar, NamedTuple

from PySide6.QtCore import QRectF, SignalInstance
from PySide6.QtGui import QPainter

from sd2app.widgets.canvas import Canvas
from sd2app.widgets.time_axis import GUTTER_PX, MARGIN_PX, ShownTime, TimeScale


class Overlay(NamedTuple):
    """Painter of something over a map, such as labels, and the signals after which it differs."""

    paint: Callable[[QPainter, QRectF, TimeScale], None]
    changed: tuple[SignalInstance, ...] = ()


class TimePlot(Canvas):
    """Widget with a plot over the shared time axis."""

    TOP_PX: ClassVar[int] = 0
    """Room above the plot."""
    BOTTOM_PX: ClassVar[int] = 0
    """Room below the plot."""

    def __init__(self, span: ShownTime) -> None:
        super().__init__()
        self._shown = span

    @property
    def scale(self) -> TimeScale:
        """Time axis of this widget."""
        return TimeScale(self._shown.start_s, self._shown.end_s, self.width())

    def plot_rect(self) -> QRectF:
        """Rectangle of the plot, in pixels."""
        width, height = self.width() - GUTTER_PX - MARGIN_PX, self.height() - self.TOP_PX
        return QRectF(GUTTER_PX, self.TOP_PX, max(width, 1), max(height - self.BOTTOM_PX, 1))
