"""Transport icons, drawn so that they follow the theme, and squares in the colours of labels."""

from __future__ import annotations

from functools import lru_cache

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QIcon, QPainter, QPainterPath, QPen, QPixmap

_SIZE = 16
_SWATCH = 12
_SCALES = (1, 2, 3)


def transport_icon(name: str, colour: str) -> QIcon:
    """Icon ``name`` (see the table below) in one colour."""
    icon = QIcon()
    for scale in _SCALES:
        pixmap = QPixmap(_SIZE * scale, _SIZE * scale)
        pixmap.setDevicePixelRatio(scale)
        pixmap.fill(Qt.GlobalColor.transparent)
        painter = QPainter(pixmap)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        _DRAW[name](painter, QColor(colour))
        painter.end()
        icon.addPixmap(pixmap)
    return icon


@lru_cache(maxsize=64)
def swatch_icon(colour: str) -> QIcon:
    """A square in the colour of a label, which no selection tints."""
    swatch = QPixmap(_SWATCH, _SWATCH)
    swatch.fill(QColor(colour))
    icon = QIcon(swatch)
    icon.addPixmap(swatch, QIcon.Mode.Selected)
    return icon


def _triangle(left: float, right: float) -> QPainterPath:
    path = QPainterPath(QPointF(left, 3))
    path.lineTo(left, 13)
    path.lineTo(right, 8)
    path.closeSubpath()
    return path


def _play(painter: QPainter, colour: QColor) -> None:
    painter.fillPath(_triangle(4, 13), colour)


def _pause(painter: QPainter, colour: QColor) -> None:
    painter.fillRect(QRectF(4, 3, 3, 10), colour)
    painter.fillRect(QRectF(9, 3, 3, 10), colour)


def _previous(painter: QPainter, colour: QColor) -> None:
    painter.fillPath(_triangle(10, 4), colour)
    painter.fillRect(QRectF(11, 3, 2, 10), colour)


def _next(painter: QPainter, colour: QColor) -> None:
    painter.fillPath(_triangle(6, 12), colour)
    painter.fillRect(QRectF(3, 3, 2, 10), colour)


def _first(painter: QPainter, colour: QColor) -> None:
    painter.fillRect(QRectF(2, 3, 2, 10), colour)
    painter.fillPath(_triangle(9, 4), colour)
    painter.fillPath(_triangle(14, 9), colour)


def _last(painter: QPainter, colour: QColor) -> None:
    painter.fillPath(_triangle(2, 7), colour)
    painter.fillPath(_triangle(7, 12), colour)
    painter.fillRect(QRectF(12, 3, 2, 10), colour)


def _slower(painter: QPainter, colour: QColor) -> None:
    painter.setPen(QPen(colour, 2))
    painter.drawLine(QPointF(4, 8), QPointF(12, 8))


def _faster(painter: QPainter, colour: QColor) -> None:
    _slower(painter, colour)
    painter.drawLine(QPointF(8, 4), QPointF(8, 12))


def _loop(painter: QPainter, colour: QColor) -> None:
    painter.setPen(QPen(colour, 1.8))
    painter.drawArc(QRectF(3, 3, 10, 10), 60 * 16, 300 * 16)
    head = QPainterPath(QPointF(8.5, 0.5))
    head.lineTo(13, 3.6)
    head.lineTo(8.5, 6.7)
    head.closeSubpath()
    painter.fillPath(head, colour)


_DRAW = {
    "play": _play,
    "pause": _pause,
    "previous": _previous,
    "next": _next,
    "first": _first,
    "last": _last,
    "slower": _slower,
    "faster": _faster,
    "loop": _loop,
}
