"""Pictures of widgets: to the clipboard, or to a PNG or SVG file."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from PySide6.QtCore import QBuffer, QIODevice, QPoint, QPointF, QRect, Qt
from PySide6.QtGui import QGuiApplication
from PySide6.QtSvg import QSvgGenerator
from PySide6.QtWidgets import QMenu, QMessageBox, QWidget

from sd2app.widgets.dialogs import ask_new
from sd2core.errors import Sd2Error
from sd2core.files.atomic import atomic_write

MenuPart = Callable[[QMenu, QPointF], None]
"""Adds to the context menu of a widget what concerns a place in it."""

_KINDS = "Picture (*.png);;Drawing (*.svg)"


def copy_picture(widget: QWidget) -> None:
    """Put a picture of a widget on the clipboard."""
    QGuiApplication.clipboard().setPixmap(widget.grab())


def write_picture(widget: QWidget, path: Path) -> None:
    """Write a picture of a widget; raises Sd2Error for another ending than .png or .svg."""
    buffer = QBuffer()
    buffer.open(QIODevice.OpenModeFlag.WriteOnly)
    if path.suffix.lower() == ".svg":
        drawing = QSvgGenerator()
        drawing.setOutputDevice(buffer)
        drawing.setSize(widget.size())
        drawing.setViewBox(QRect(QPoint(), widget.size()))
        drawing.setTitle(widget.accessibleName())
        widget.render(drawing)
    elif path.suffix.lower() == ".png":
        widget.grab().save(buffer, "PNG")
    else:
        raise Sd2Error(
            f"{path.name} is no picture that can be written", "a name that ends in .png or .svg"
        )
    with atomic_write(path) as stream:
        stream.write(bytes(buffer.data().data()))


def save_picture(widget: QWidget, name: str) -> None:
    """Ask where a picture of a widget is to be written, and write it."""
    path = ask_new(widget.window(), "Save picture", name, _KINDS)
    if path is None:
        return
    try:
        write_picture(widget, path)
    except (Sd2Error, OSError) as error:
        QMessageBox.warning(widget.window(), "Save picture", str(error))


def picture_menu(widget: QWidget, parts: Sequence[MenuPart], place: QPointF) -> QMenu:
    """Context menu of a widget: what its parts add for a place, then its picture."""
    menu = QMenu(widget)
    menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
    for part in parts:
        part(menu, place)
        menu.addSeparator()
    menu.addAction("&Copy picture", lambda: copy_picture(widget))
    name = widget.accessibleName().lower().replace(" ", "-") or "plot"
    menu.addAction("&Save picture…", lambda: save_picture(widget, f"{name}.png"))
    return menu
