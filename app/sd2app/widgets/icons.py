"""Transport icons, drawn so that they follow the theme, and squares in the colours of labels."""

from __future__ import annotations

from functools import lru_cache

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QIcon, QPainter, QPainterPath, QPen, QPixmap

_SIZE = 16
_SWATCH = 12
_SCALES = (1, 2, 3)
_SHAPES: dict[str, tuple[QRectF | tuple[float, float], ...]] = {
    "play": ((4, 13),),
    "pause": (QRectF(4, 3, 3, 10), QRectF(9, 3, 3, 10)),
    "previous": ((10, 4), QRectF(11, 3, 2, 10)),
    "next": ((6, 12), QRectF(3, 3, 2, 10)),
    "first": (QRectF(2, 3, 2, 10), (9, 4), (14, 9)),
    "last": ((2, 7), (7, 12), QRectF(12, 3, 2, 10)),
    "slower": (QRectF(3, 7, 10, 2),),
    "faster": (QRectF(3, 7, 10, 2), QRectF(7, 3, 2, 10)),
}
"""Icons of bars and triangles, each triangle from the x of its base to that of its tip."""


def transport_icon(name: str, colour: str) -> QIcon:
    """Icon of the transport bar, ``loop`` or one of the shapes above, in one colour."""
    icon = QIcon()
    for scale in _SCALES:
        pixmap = QPixmap(_SIZE * scale, _SIZE * scale)
        pixmap.setDevicePixelRatio(scale)
        pixmap.fill(Qt.GlobalColor.transparent)
        with QPainter(pixmap) as painter:
            painter.setRenderHint(QPainter.RenderHint.Antialiasing)
            if name == "loop":
                _draw_loop(painter, QColor(colour))
            else:
                for shape in _SHAPES[name]:
                    path = QPainterPath()
                    if isinstance(shape, QRectF):
                        path.addRect(shape)
                    else:
                        base, tip = shape
                        path.addPolygon([QPointF(base, 3), QPointF(base, 13), QPointF(tip, 8)])
                    painter.fillPath(path, QColor(colour))
        icon.addPixmap(pixmap)
    return icon


def _draw_loop(painter: QPainter, colour: QColor) -> None:
    painter.setPen(QPen(colour, 1.8))
    painter.drawArc(QRectF(3, 3, 10, 10), 60 * 16, 300 * 16)
    head = QPainterPath()
    head.addPolygon([QPointF(8.5, 0.5), QPointF(13, 3.6), QPointF(8.5, 6.7)])
    painter.fillPath(head, colour)


@lru_cache(maxsize=64)
def swatch_icon(colour: str) -> QIcon:
    """A square in the colour of a label, which no selection tints."""
    swatch = QPixmap(_SWATCH, _SWATCH)
    swatch.fill(QColor(colour))
    icon = QIcon(swatch)
    icon.addPixmap(swatch, QIcon.Mode.Selected)
    return icon
