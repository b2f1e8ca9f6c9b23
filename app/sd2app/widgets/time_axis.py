"""Scale of pixels and seconds, and round numbers for an axis."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPen

from sd2app.palette import Palette

GUTTER_PX = 56
"""Space left of every track for the velocity axis, so that all tracks line up."""
MARGIN_PX = 8
HANDLE_PX = 22
"""Left end of the title row of a map or track, which folds it."""
_FARTHEST_PX = 1e6


@dataclass(frozen=True)
class TimeScale:
    """Linear map between the x of a widget and time."""

    start_s: float
    end_s: float
    width_px: float

    @cached_property
    def plot_width_px(self) -> float:
        """Width of what is drawn to scale."""
        return max(self.width_px - GUTTER_PX - MARGIN_PX, 1.0)

    def x_of(self, time_s: float) -> float:
        """Pixel of a time, at most a million from 0: Qt paints what is farther wrongly."""
        share = (time_s - self.start_s) / (self.end_s - self.start_s)
        return min(max(GUTTER_PX + share * self.plot_width_px, -_FARTHEST_PX), _FARTHEST_PX)

    def xs_of(self, times_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Pixels of many times, as :meth:`x_of` gives them."""
        shares = (times_s - self.start_s) / (self.end_s - self.start_s)
        return np.clip(GUTTER_PX + shares * self.plot_width_px, -_FARTHEST_PX, _FARTHEST_PX)

    def time_of(self, x_px: float) -> float:
        """Time of a pixel, extrapolated outside."""
        share = (x_px - GUTTER_PX) / self.plot_width_px
        return self.start_s + share * (self.end_s - self.start_s)

    @property
    def seconds_per_px(self) -> float:
        """Time that one pixel covers."""
        return (self.end_s - self.start_s) / self.plot_width_px


def tick_step(span: float, most: int) -> float:
    """Smallest step of 1, 2 or 5 times a power of ten with at most ``most`` ticks."""
    raw = span / max(most, 1)
    power = 10.0 ** math.floor(math.log10(raw))
    least = raw * (1.0 - 1e-9)
    return next(factor * power for factor in (1.0, 2.0, 5.0, 10.0) if factor * power >= least)


def ticks(low: float, high: float, most: int) -> list[float]:
    """Round numbers between ``low`` and ``high``."""
    step = tick_step(high - low, most)
    first = math.ceil(low / step - 1e-9)
    last = math.floor(high / step + 1e-9)
    return [index * step for index in range(first, last + 1)]


def signed_text(value: float) -> str:
    """Text of a tick with its sign; zero without."""
    return f"{value:+g}".replace("-", "−") if abs(value) > 1e-9 else "0"


def clock_text(time_s: float, decimals: int = 3) -> str:
    """``mm:ss.mmm``, with hours when there are any."""
    sign = "-" if time_s < 0 else ""
    scale = 10**decimals
    whole, rest = divmod(round(abs(time_s) * scale), scale)
    minutes, seconds = divmod(whole, 60)
    hours, minutes = divmod(minutes, 60)
    text = f"{hours}:{minutes:02d}:{seconds:02d}" if hours else f"{minutes:02d}:{seconds:02d}"
    return f"{sign}{text}.{rest:0{decimals}d}" if decimals else f"{sign}{text}"


def paint_cursor(painter: QPainter, plot: QRectF, x_px: float) -> None:
    """The line of the time on screen, legible on every colour."""
    top, bottom = QPointF(x_px, plot.top()), QPointF(x_px, plot.bottom())
    for pen in (QPen(QColor(0, 0, 0, 140), 3), QPen(QColor(255, 255, 255), 1)):
        painter.setPen(pen)
        painter.drawLine(top, bottom)


def paint_handle(
    painter: QPainter, header_px: float, to: Literal["down", "right", "left"], colour: str
) -> None:
    """Paint the triangle that folds: down while open, to the right while folded."""
    corners = {
        "down": ((-4, -2.5), (4, -2.5), (0, 3)),
        "right": ((-2.5, -4), (-2.5, 4), (3, 0)),
        "left": ((2.5, -4), (2.5, 4), (-3, 0)),
    }[to]
    centre = QPointF(HANDLE_PX / 2 + 2, header_px / 2)
    painter.save()
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(QColor(colour))
    painter.drawPolygon([centre + QPointF(x, y) for x, y in corners])
    painter.restore()


def paint_title(painter: QPainter, box: QRectF, text: str, colour: str) -> int:
    """Paint a bold title at the left of a box, elided where need be; returns its width."""
    font = painter.font()
    font.setBold(True)
    painter.setFont(font)
    painter.setPen(QColor(colour))
    metrics = painter.fontMetrics()
    shown = metrics.elidedText(text, Qt.TextElideMode.ElideMiddle, int(box.width()))
    painter.drawText(box, Qt.AlignmentFlag.AlignVCenter, shown)
    font.setBold(False)
    painter.setFont(font)
    return metrics.horizontalAdvance(shown)


def paint_readout(
    painter: QPainter, plot: QRectF, place: QPointF, lines: Sequence[str], colours: Palette
) -> None:
    """Paint lines of text in a box beside a place, on the side of it where there is room."""
    metrics = painter.fontMetrics()
    width = max(metrics.horizontalAdvance(line) for line in lines) + 12
    height = metrics.height() * len(lines) + 6
    left = place.x() + 12 if place.x() + 12 + width < plot.right() else place.x() - 12 - width
    left = max(left, 1.0)
    top = place.y() - height - 8 if place.y() - height - 8 > plot.top() else place.y() + 8
    # Where the plot is lower than the box, the box lies over what is around it.
    top = max(min(top, painter.device().height() - height - 1.0), 1.0)
    box = QRectF(left, top, width, height)
    back = QColor(colours.panel)
    back.setAlpha(225)
    painter.save()
    painter.setPen(QPen(QColor(colours.border), 1))
    painter.setBrush(back)
    painter.drawRoundedRect(box, 3, 3)
    painter.setPen(QColor(colours.text))
    flags = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignTop
    painter.drawText(box.adjusted(6, 3, 0, 0), flags, "\n".join(lines))
    painter.restore()
