"""Overlay that says, while files hover over the window, what dropping them would do."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPen
from PySide6.QtWidgets import QWidget

from sd2app.feature import Drop
from sd2app.widgets.canvas import Canvas

_GAP_PX = 16
_COVER = 235
"""Opacity of what covers the window, of 255."""


class DropOverlay(Canvas):
    """A field for each thing that a drop can do, side by side; the one below the pointer does."""

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self._covered = parent
        self._paths: Sequence[Path] = ()
        self.drops: Sequence[Drop] = ()
        self.current = 0
        self.hide()

    def offer(self, paths: Sequence[Path], drops: Sequence[Drop]) -> None:
        """Cover the parent with what can be done."""
        self._paths, self.drops, self.current = paths, drops, 0
        self.setAccessibleName("; ".join(one.text for one in drops))
        self.setGeometry(self._covered.rect())
        self.raise_()
        self.show()

    def point(self, at: QPointF) -> None:
        """Choose the field below the pointer, a place of this widget."""
        for place in range(len(self.drops)):
            if self.field(place).adjusted(-_GAP_PX, -_GAP_PX, _GAP_PX, _GAP_PX).contains(at):
                self.current = place
        self.update()

    def field(self, place: int) -> QRectF:
        """Rectangle of a field."""
        width = (self.width() - _GAP_PX) / len(self.drops) - _GAP_PX
        left = _GAP_PX + place * (width + _GAP_PX)
        return QRectF(left, _GAP_PX, width, self.height() - 2 * _GAP_PX)

    def paint(self, painter: QPainter) -> None:
        """Paint the fields, the current one in the accent colour."""
        colours = self.palette()
        cover = colours.window().color()
        cover.setAlpha(_COVER)
        painter.fillRect(self.rect(), cover)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        names = ", ".join(path.name for path in self._paths)
        for place, drop in enumerate(self.drops):
            chosen, field = place == self.current, self.field(place)
            edge = colours.highlight().color() if chosen else colours.mid().color()
            tint = QColor(edge)
            tint.setAlpha(40 if chosen else 0)
            painter.setPen(QPen(edge, 3 if chosen else 1, Qt.PenStyle.DashLine))
            painter.setBrush(tint)
            painter.drawRoundedRect(field, 8, 8)
            painter.setPen(colours.windowText().color())
            font = self.font()
            font.setPointSizeF(1.5 * font.pointSizeF())
            painter.setFont(font)
            flags = Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap
            inner = field.adjusted(24, 24, -24, -24)
            box = painter.boundingRect(inner, int(flags), drop.text)
            painter.drawText(inner, int(flags), drop.text)
            painter.setFont(self.font())
            below = inner.adjusted(0, box.bottom() - inner.top() + 8, 0, 0)
            top = Qt.AlignmentFlag.AlignHCenter | Qt.TextFlag.TextWordWrap
            painter.drawText(below, int(top), names)
