"""A plot whose points stand in a row, gone through with the keyboard."""

from __future__ import annotations

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QKeyEvent, QPainter, QPen

from sd2app.widgets.point_plot import PointPlot

_STEPS = {Qt.Key.Key_Left: -1, Qt.Key.Key_Right: 1}


class SteppedPlot(PointPlot):
    """Left and Right go from point to point, Home and End to the first and the last.

    Escape gives the keyboard back.
    """

    KEYS = frozenset({Qt.Key.Key_Home, Qt.Key.Key_End, Qt.Key.Key_Escape, *_STEPS})

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Go from point to point."""
        points, key = list(self.points()), event.key()
        if not points or key not in self.KEYS:
            super().keyPressEvent(event)
        elif key == Qt.Key.Key_Escape:
            self.clearFocus()
        else:
            here = self.pointed or self.first_point() or points[-1]
            at = points.index(here)
            if key in (Qt.Key.Key_Home, Qt.Key.Key_End):
                at = 0 if key == Qt.Key.Key_Home else len(points) - 1
            elif self.pointed is not None:
                at = min(max(at + _STEPS[Qt.Key(key)], 0), len(points) - 1)
            self.point_at(points[at])
            self.explain()

    def paint_legend(self, painter: QPainter, unit: str, names: list[tuple[str, str]]) -> None:
        """Over the plot: the unit on the left, a line and a name for each colour on the right."""
        colours, metrics = self._display.palette, painter.fontMetrics()
        centred = Qt.AlignmentFlag.AlignVCenter
        painter.setPen(QColor(colours.muted))
        painter.drawText(QRectF(4, 0, 120, 20), centred, unit)
        x = self.plot_rect().right()
        for text, colour in reversed(names):
            width = metrics.horizontalAdvance(text)
            x -= width
            painter.setPen(QColor(colours.muted))
            painter.drawText(QRectF(x, 0, width + 2, 20), centred, text)
            painter.setPen(QPen(QColor(colour), 2))
            painter.drawLine(QPointF(x - 18, 10), QPointF(x - 5, 10))
            x -= 30
