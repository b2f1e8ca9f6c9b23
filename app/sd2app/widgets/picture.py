"""Pictures of widgets: to the clipboard, or to a PNG or SVG file."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Protocol, runtime_checkable

from PySide6.QtCore import QBuffer, QByteArray, QIODevice, QPoint, QPointF, QRect, QSize, Qt
from PySide6.QtGui import QGuiApplication, QImage, QImageWriter, QPainter, QPixmap
from PySide6.QtSvg import QSvgGenerator
from PySide6.QtWidgets import QMenu, QMessageBox, QWidget

from sd2app.widgets.dialogs import ask_new
from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_write

_KINDS = "Picture (*.png);;Drawing (*.svg)"


@runtime_checkable
class Pictured(Protocol):
    """A widget whose picture differs from what is on screen."""

    def picture_size(self) -> QSize:
        """Size of the picture of it, in pixels."""

    def paint_picture(self, painter: QPainter) -> None:
        """Paint what a picture of it shows."""


def copy_drawing(widget: QWidget) -> None:
    """Put a drawing of a widget on the clipboard, as SVG."""
    svg, clipboard = _drawing(widget), QGuiApplication.clipboard()
    clipboard.setText(svg.decode())
    # The clipboard's own: data made here would be deleted after Python, with a crash.
    clipboard.mimeData().setData("image/svg+xml", svg)


def _drawing(widget: QWidget) -> bytes:
    """The widget as SVG."""
    size = widget.picture_size() if isinstance(widget, Pictured) else widget.size()
    buffer = QBuffer()
    buffer.open(QIODevice.OpenModeFlag.WriteOnly)
    drawing = QSvgGenerator()
    drawing.setOutputDevice(buffer)
    drawing.setSize(size)
    drawing.setViewBox(QRect(QPoint(), size))
    drawing.setTitle(widget.accessibleName())
    if isinstance(widget, Pictured):
        with QPainter(drawing) as painter:
            painter.setFont(widget.font())
            widget.paint_picture(painter)
    else:
        widget.render(drawing)
    return bytes(buffer.data().data())


def pixmap_of(widget: QWidget) -> QPixmap:
    """The widget in pixels: what it shows, without what the mouse is for."""
    if not isinstance(widget, Pictured):
        return widget.grab()
    ratio = widget.devicePixelRatioF()
    pixmap = QPixmap(widget.picture_size() * ratio)
    pixmap.setDevicePixelRatio(ratio)
    pixmap.fill(widget.palette().window().color())
    with QPainter(pixmap) as painter:
        painter.setFont(widget.font())
        widget.paint_picture(painter)
    return pixmap


def png_of(picture: QImage) -> bytes:
    """A picture as PNG."""
    buffer = QBuffer()
    buffer.open(QIODevice.OpenModeFlag.WriteOnly)
    QImageWriter(buffer, QByteArray(b"png")).write(picture)
    return bytes(buffer.data().data())


def write_picture(widget: QWidget, path: Path) -> None:
    """Write a picture of a widget; raises Sd2Error for another ending than .png or .svg."""
    if path.suffix.lower() == ".svg":
        content = _drawing(widget)
    elif path.suffix.lower() == ".png":
        content = png_of(pixmap_of(widget).toImage())
    else:
        raise Sd2Error(
            f"{path.name} is no picture that can be written", "a name that ends in .png or .svg"
        )
    with atomic_write(path) as stream:
        stream.write(content)


def save_picture(widget: QWidget, name: str) -> None:
    """Ask where a picture of a widget is to be written, and write it."""
    path = ask_new(widget.window(), "Save picture", name, _KINDS, ".png", (".svg",))
    if path is None:
        return
    try:
        write_picture(widget, path)
    except (Sd2Error, OSError) as error:
        QMessageBox.warning(widget.window(), "Save picture", str(error))


def picture_menu(
    widget: QWidget, parts: Sequence[Callable[[QMenu, QPointF], None]], place: QPointF
) -> QMenu:
    """Context menu of a widget: what its parts add for a place, then its picture."""
    menu = QMenu(widget)
    menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
    for part in parts:
        part(menu, place)
        menu.addSeparator()
    clipboard = QGuiApplication.clipboard()
    menu.addAction("&Copy picture", lambda: clipboard.setPixmap(pixmap_of(widget)))
    menu.addAction("Copy as S&VG", lambda: copy_drawing(widget))
    menu.addAction("&Save picture…", lambda: save_picture(widget, _file_name(widget)))
    return menu


def _file_name(widget: QWidget) -> str:
    """Proposed name of a picture: of the recording that its window shows, and of the widget."""
    window: QWidget | None = widget.window()
    while window is not None and not window.windowFilePath():
        parent = window.parentWidget()  # of a dialog
        window = parent.window() if parent is not None else None
    about = Path(window.windowFilePath()).name if window is not None else ""
    kind = widget.accessibleName().lower().replace(" ", "-") or "plot"
    return "-".join(filter(None, (about, kind))) + ".png"
