"""Icons of the transport bar and of the panels, drawn so that they follow the theme; squares."""

from __future__ import annotations

from functools import lru_cache

from PySide6.QtCore import QRect, QRectF, Qt
from PySide6.QtGui import QColor, QIcon, QPainter, QPen, QPixmap
from PySide6.QtSvg import QSvgRenderer

_SIZE = 16
_SWATCH = 12
_SCALES = (1, 2, 3)
_LINE = (
    'fill="none" stroke="currentColor" stroke-width="1.6" stroke-linecap="round"'
    ' stroke-linejoin="bevel"'
)
_DRAWN = {
    "play": '<path d="M4 3v10l9-5z"/>',
    "pause": '<path d="M4 3h3v10h-3zM9 3h3v10h-3z"/>',
    "previous": '<path d="M10 3v10l-6-5zM11 3h2v10h-2z"/>',
    "next": '<path d="M6 3v10l6-5zM3 3h2v10h-2z"/>',
    "first": '<path d="M2 3h2v10h-2zM9 3v10l-5-5zM14 3v10l-5-5z"/>',
    "last": '<path d="M2 3v10l5-5zM7 3v10l5-5zM12 3h2v10h-2z"/>',
    "slower": '<path d="M3 7h10v2h-10z"/>',
    "faster": '<path d="M3 7h10v2h-10zM7 3h2v10h-2z"/>',
    "loop": '<path d="M10.5 3.67A5 5 0 1 0 13 8" fill="none" stroke="currentColor"'
    ' stroke-width="1.8" stroke-linecap="square"/><path d="M8.5 0.5L13 3.6L8.5 6.7z"/>',
    # waves that leave a point
    "Sensor": f'<path d="M8.6 13.86A6 6 0 0 0 8.6 6.14M12.04 16.75A10.5 10.5 0 0 0 12.04 3.25'
    f'M15.49 19.64A15 15 0 0 0 15.49 0.36" {_LINE}/><circle cx="4" cy="10" r="2"/>',
    # a target
    "Accuracy": f'<g {_LINE}><circle cx="10" cy="10" r="8"/><circle cx="10" cy="10" r="4.2"/></g>'
    '<circle cx="10" cy="10" r="1.5"/>',
    # an error that falls
    "Train": f'<path d="M3 2.5V17H17.5M6 4C7 11 10 13 17 13.5" {_LINE}/>',
    # spans on their tracks
    "Labels": '<path d="M2 3h9v3.4h-9zM8 8.3h10v3.4h-10zM4 13.6h7v3.4h-7z"/>',
    # a map with an arch in it, a film, what is being recorded
    "Sample": f'<g {_LINE}><rect x="2" y="3" width="16" height="14"/>'
    '<path d="M5 12.5C6.5 12.5 7 7 10 7C13 7 13.5 12.5 15 12.5"/></g>',
    "Video": f'<g {_LINE}><rect x="2" y="4" width="16" height="12"/></g><path d="M8 7v6l5-3z"/>',
    "Record": f'<circle cx="10" cy="10" r="8" {_LINE}/><circle cx="10" cy="10" r="4.2"/>',
    # what two people have in common
    "Agreement": f'<g {_LINE}><circle cx="7.2" cy="10" r="5.6"/>'
    '<circle cx="12.8" cy="10" r="5.6"/></g>',
}
"""Icons as SVG: those of the transport bar 16, those of panels 20 units large."""


@lru_cache(maxsize=64)
def _drawing(name: str, colour: str, size: int) -> QSvgRenderer:
    head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {size} {size}"'
    drawn = f'{head} color="{colour}" fill="{colour}">{_DRAWN[name]}</svg>'
    return QSvgRenderer(drawn.encode())


def transport_icon(name: str, colour: str) -> QIcon:
    """Icon of the transport bar in one colour."""
    icon = QIcon()
    for scale in _SCALES:
        pixmap = QPixmap(_SIZE * scale, _SIZE * scale)
        pixmap.setDevicePixelRatio(scale)
        pixmap.fill(Qt.GlobalColor.transparent)
        with QPainter(pixmap) as painter:
            _drawing(name, colour, _SIZE).render(painter, QRectF(0, 0, _SIZE, _SIZE))
        icon.addPixmap(pixmap)
    return icon


def draw_panel_icon(painter: QPainter, box: QRectF, name: str, colour: QColor) -> None:
    """Draw the icon of a panel at the side into a box, in one colour."""
    _drawing(name, colour.name(), 20).render(painter, box)


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


@lru_cache(maxsize=64)
def swatch_icon(colour: str) -> QIcon:
    """A square in the colour of a label, which no selection tints."""
    swatch = QPixmap(_SWATCH, _SWATCH)
    swatch.fill(QColor(colour))
    icon = QIcon(swatch)
    icon.addPixmap(swatch, QIcon.Mode.Selected)
    return icon
