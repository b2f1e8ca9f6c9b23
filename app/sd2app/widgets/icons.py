"""Icons of the transport bar and of the panels, drawn so that they follow the theme; squares."""

from __future__ import annotations

from functools import lru_cache

from PySide6.QtCore import QPointF, QRect, QRectF, Qt
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


def draw_panel_icon(painter: QPainter, name: str, colour: QColor) -> None:
    """Draw the icon of a panel at the side, 20 pixels in the square, in one colour."""
    painter.setPen(QPen(colour, 1.6, Qt.PenStyle.SolidLine, Qt.PenCapStyle.RoundCap))
    painter.setBrush(Qt.BrushStyle.NoBrush)
    if name == "Sensor":  # waves that leave a point
        for radius in (6.0, 10.5, 15.0):
            around = QRectF(4 - radius, 10 - radius, 2 * radius, 2 * radius)
            painter.drawArc(around, -40 * 16, 80 * 16)
        _draw_dot(painter, QPointF(4, 10), 2.0, colour)
    elif name == "Accuracy":  # a target
        painter.drawEllipse(QPointF(10, 10), 8, 8)
        painter.drawEllipse(QPointF(10, 10), 4.2, 4.2)
        _draw_dot(painter, QPointF(10, 10), 1.5, colour)
    elif name == "Train":  # an error that falls
        painter.drawPolyline([QPointF(3, 2.5), QPointF(3, 17), QPointF(17.5, 17)])
        curve = QPainterPath(QPointF(6, 4))
        curve.cubicTo(QPointF(7, 11), QPointF(10, 13), QPointF(17, 13.5))
        painter.drawPath(curve)
    elif name == "Labels":  # spans on their tracks
        for place in (QRectF(2, 3, 9, 3.4), QRectF(8, 8.3, 10, 3.4), QRectF(4, 13.6, 7, 3.4)):
            painter.fillRect(place, colour)
    elif name == "Agree":  # what two people have in common
        painter.drawEllipse(QPointF(7.2, 10), 5.6, 5.6)
        painter.drawEllipse(QPointF(12.8, 10), 5.6, 5.6)
    else:
        painter.drawText(QRectF(0, 0, 20, 20), Qt.AlignmentFlag.AlignCenter, name[:1])


def draw_ring(
    painter: QPainter, place: QRect, share: float | None, colour: QColor, ground: QColor
) -> None:
    """Draw a ring whose coloured part is the share that is done; without one, a quarter."""
    ring = QRectF(place).adjusted(2.5, 2.5, -2.5, -2.5)
    painter.setPen(QPen(ground, 2.5))
    painter.drawEllipse(ring)
    painter.setPen(QPen(colour, 2.5, Qt.PenStyle.SolidLine, Qt.PenCapStyle.FlatCap))
    part = 0.25 if share is None else min(max(share, 0.0), 1.0)
    painter.drawArc(ring, 90 * 16, -round(360 * 16 * part))


def _draw_dot(painter: QPainter, at: QPointF, radius: float, colour: QColor) -> None:
    path = QPainterPath()
    path.addEllipse(at, radius, radius)
    painter.fillPath(path, colour)


@lru_cache(maxsize=64)
def swatch_icon(colour: str) -> QIcon:
    """A square in the colour of a label, which no selection tints."""
    swatch = QPixmap(_SWATCH, _SWATCH)
    swatch.fill(QColor(colour))
    icon = QIcon(swatch)
    icon.addPixmap(swatch, QIcon.Mode.Selected)
    return icon
