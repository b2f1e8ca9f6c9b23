"""Bases of the widgets that paint themselves, axes, colour maps, and what painting shares."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cache
from typing import ClassVar, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRectF, QSize, Qt, SignalInstance
from PySide6.QtGui import QColor, QContextMenuEvent, QImage, QPainter, QPaintEvent, QPen, QPixmap
from PySide6.QtWidgets import QMenu, QWidget

from sd2app.palette import Palette
from sd2app.widgets.time_axis import TimeScale
from sd2core.files.resources import resource_path

MenuPart = Callable[[QMenu, QPointF], None]
"""Adds to the context menu of a widget what concerns a place in it."""

AT_LEFT = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter
AT_RIGHT = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
"""Places of a line of text in its box."""


@contextmanager
def clipped(painter: QPainter, area: QRectF) -> Iterator[None]:
    """Paint within an area only; pen, brush and all else are as before at the end."""
    painter.save()
    painter.setClipRect(area)
    try:
        yield
    finally:
        painter.restore()


def faint(colour: str | QColor, alpha: int) -> QColor:
    """A colour through which one sees what is below; an ``alpha`` of 255 hides that."""
    shade = QColor(colour)
    shade.setAlpha(alpha)
    return shade


def image_of(
    pixels: NDArray[np.uint32], form: QImage.Format = QImage.Format.Format_ARGB32
) -> QImage:
    """Image of pixels ``0xAARRGGBB``, (H, W), the first row on top."""
    height, width = pixels.shape
    pixels = np.ascontiguousarray(pixels)
    return QImage(pixels.data, width, height, 4 * width, form).copy()


class Canvas(QWidget):
    """Widget that paints itself; a subclass may keep pictures of what rarely changes."""

    USUAL_PX: ClassVar[tuple[int, int]] = (-1, -1)
    """Width and height where there is a choice; negative ones leave them to the layout."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._kept: dict[Callable[[QPainter], None], QPixmap] = {}  # by what draws them
        self.menu_parts: Sequence[MenuPart] = ()
        self.still = False  # a picture is made: without pointer, cursor, and what the mouse is for

    def contextMenuEvent(self, event: QContextMenuEvent) -> None:
        """Offer what features add for this place, and the picture."""
        # Imported here because most plots are never asked for a picture.
        from sd2app.widgets.picture import picture_menu

        picture_menu(self, self.menu_parts, QPointF(event.pos())).popup(event.globalPos())

    def sizeHint(self) -> QSize:
        """Width and height where there is a choice."""
        return QSize(*self.USUAL_PX)

    def follow(self, *signals: SignalInstance) -> None:
        """Paint again after each of these; what is kept stays."""
        for signal in signals:
            signal.connect(self.update)

    def redraw(self) -> None:
        """Paint again, what is kept included."""
        self._kept.clear()
        self.update()

    def paint(self, painter: QPainter) -> None:
        """Paint everything."""
        raise NotImplementedError

    def picture_size(self) -> QSize:
        """Size of the picture of it, in pixels."""
        return self.size()

    def paint_picture(self, painter: QPainter) -> None:
        """Paint what a picture of it shows."""
        self.still = True
        self._kept.clear()
        try:
            self.paint(painter)
        finally:
            self.still = False
            self._kept.clear()

    def paint_kept(self, painter: QPainter, draw: Callable[[QPainter], None]) -> None:
        """Paint the picture that is kept; ``draw`` makes a missing one, or one of another size."""
        ratio = self.devicePixelRatioF()
        size = self.size() * ratio
        kept = self._kept.get(draw)
        if kept is None or kept.size() != size:
            kept = self._kept[draw] = QPixmap(size)
            kept.setDevicePixelRatio(ratio)
            kept.fill(Qt.GlobalColor.transparent)
            with QPainter(kept) as own:
                own.setFont(self.font())
                draw(own)
        painter.drawPixmap(0, 0, kept)

    def paintEvent(self, event: QPaintEvent) -> None:
        """Paint everything."""
        with QPainter(self) as painter:
            self.paint(painter)


class Overlay(NamedTuple):
    """Painter of something over a map, such as labels, and the signals after which it differs.

    ``legend`` gives the names of what is drawn in a stretch of time, with their colours.
    """

    paint: Callable[[QPainter, QRectF, TimeScale], None]
    changed: tuple[SignalInstance, ...] = ()
    legend: Callable[[float, float], Mapping[str, str]] = lambda start_s, end_s: {}


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


_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
_TINT = np.array([1.0, 0.72, 0.42])
"""Amber, relative per channel; scaled to the luminance of each colour."""


@cache
def uncertain_table(name: str) -> NDArray[np.uint32]:
    """Table of the same lightness in grey, or in amber where the map itself is grey."""
    table = lookup_table(name)
    rgb = np.stack([table >> 16 & 255, table >> 8 & 255, table & 255], axis=1).astype(float)
    light = rgb @ _LUMINANCE
    grey = np.repeat(light[:, None], 3, axis=1)
    if np.ptp(rgb, axis=1).max() < 8:
        grey = light[:, None] * _TINT / (_TINT @ _LUMINANCE)
    channels = np.clip(np.rint(grey), 0, 255).astype(np.uint32)
    packed = 0xFF000000 | channels[:, 0] << 16 | channels[:, 1] << 8 | channels[:, 2]
    return packed.astype(np.uint32)


@cache
def signed_table(negative: str, middle: str, positive: str) -> NDArray[np.uint32]:
    """255 opaque colours from one to another (``#rrggbb``), by way of a third at number 127."""
    ends = [np.array([int(name[at : at + 2], 16) for at in (1, 3, 5)]) for name in
            (negative, middle, positive)]  # fmt: skip
    # A little more than proportional near the middle, where differences are told apart.
    share = np.linspace(0.0, 1.0, 128)[:, None] ** 0.8
    down, up = (ends[1] + share * (end - ends[1]) for end in (ends[0], ends[2]))
    rgb = np.rint(np.concatenate([down[:0:-1], up])).astype(np.uint32)  # (255, 3)
    return (0xFF000000 | rgb[:, 0] << 16 | rgb[:, 1] << 8 | rgb[:, 2]).astype(np.uint32)


@cache
def lookup_table(name: str) -> NDArray[np.uint32]:
    """256 opaque colours of a map as 0xAARRGGBB, shape (256,)."""
    with np.load(resource_path("colour_maps.npz")) as tables:
        rgb = tables[name].astype(np.uint32)  # (256, 3)
    return (0xFF000000 | rgb[:, 0] << 16 | rgb[:, 1] << 8 | rgb[:, 2]).astype(np.uint32)
