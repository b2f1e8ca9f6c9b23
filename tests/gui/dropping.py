"""Files dragged over the window and dropped, as a file manager does it."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import QMimeData, QPointF, Qt, QUrl
from PySide6.QtGui import QDragEnterEvent, QDragMoveEvent, QDropEvent
from PySide6.QtWidgets import QApplication

from sd2app.shell.loading import DropOverlay
from sd2app.shell.window import MainWindow

LEFT, NONE = Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier


def hover(window: MainWindow, *paths: Path) -> DropOverlay:
    """Drag files into the window; the overlay says what dropping them would do."""
    how = (Qt.DropAction.CopyAction, _mime(paths), LEFT, NONE)
    entering = QDragEnterEvent(window.rect().center(), *how)
    QApplication.sendEvent(window, entering)
    assert entering.isAccepted()
    return window.findChild(DropOverlay)


def drop(window: MainWindow, *paths: Path, on: int = 0) -> None:
    """Drag files to one of the fields and let go."""
    overlay = hover(window, *paths)
    where = overlay.mapTo(window, overlay.fields[on].geometry().center())
    how = (Qt.DropAction.CopyAction, _mime(paths), LEFT, NONE)
    QApplication.sendEvent(window, QDragMoveEvent(where, *how))
    assert overlay.current == on
    QApplication.sendEvent(window, QDropEvent(QPointF(where), *how))
    assert not overlay.isVisible()


def _mime(paths: tuple[Path, ...]) -> QMimeData:
    mime = QMimeData()
    mime.setUrls([QUrl.fromLocalFile(str(path)) for path in paths])
    return mime
