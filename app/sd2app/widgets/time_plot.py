"""Base of the widgets that draw over the shared time axis, and what is drawn over them."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from PySide6.QtCore import QRectF, SignalInstance
from PySide6.QtGui import QPainter
from PySide6.QtWidgets import QWidget

from sd2app.widgets.time_axis import TimeScale


class Overlay(NamedTuple):
    """Painter of something over a map, such as labels, and the signals after which it differs."""

    paint: Callable[[QPainter, QRectF, TimeScale], None]
    changed: tuple[SignalInstance, ...] = ()


class TimePlot(QWidget):
    """Widget with a plot over the shared time axis."""

    @property
    def scale(self) -> TimeScale:
        """Time axis of this widget."""
        raise NotImplementedError

    def plot_rect(self) -> QRectF:
        """Rectangle of the plot, in pixels."""
        raise NotImplementedError
