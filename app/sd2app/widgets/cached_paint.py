"""Picture of the parts of a view that do not change during playback."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import Qt
from PySide6.QtGui import QPainter, QPixmap
from PySide6.QtWidgets import QWidget


class CachedPaint:
    """Picture that is painted once, until it is dropped or the view has another size."""

    def __init__(self, view: QWidget) -> None:
        self._view = view
        self._picture: QPixmap | None = None

    def forget(self) -> None:
        """Drop the picture: its content has changed."""
        self._picture = None

    def paint(self, painter: QPainter, draw: Callable[[QPainter], None]) -> None:
        """Paint it on the view; ``draw`` makes a missing one."""
        ratio = self._view.devicePixelRatioF()
        size = self._view.size() * ratio
        if self._picture is None or self._picture.size() != size:
            self._picture = QPixmap(size)
            self._picture.setDevicePixelRatio(ratio)
            self._picture.fill(Qt.GlobalColor.transparent)
            with QPainter(self._picture) as own:
                own.setFont(self._view.font())
                draw(own)
        painter.drawPixmap(0, 0, self._picture)
