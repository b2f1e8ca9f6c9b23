"""Base of the widgets that paint themselves."""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar

from PySide6.QtCore import QSize, Qt, SignalInstance
from PySide6.QtGui import QPainter, QPaintEvent, QPixmap
from PySide6.QtWidgets import QWidget


class Canvas(QWidget):
    """Widget that paints itself; a subclass may keep a picture of what rarely changes."""

    USUAL_PX: ClassVar[tuple[int, int]] = (-1, -1)
    """Width and height where there is a choice; negative ones leave them to the layout."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._kept: QPixmap | None = None

    def sizeHint(self) -> QSize:
        """Width and height where there is a choice."""
        return QSize(*self.USUAL_PX)

    def follow(self, *signals: SignalInstance) -> None:
        """Paint again after each of these; what is kept stays."""
        for signal in signals:
            signal.connect(self.update)

    def redraw(self) -> None:
        """Paint again, what is kept included."""
        self._kept = None
        self.update()

    def paint(self, painter: QPainter) -> None:
        """Paint everything."""
        raise NotImplementedError

    def paint_kept(self, painter: QPainter, draw: Callable[[QPainter], None]) -> None:
        """Paint the picture that is kept; ``draw`` makes a missing one, or one of another size."""
        ratio = self.devicePixelRatioF()
        size = self.size() * ratio
        if self._kept is None or self._kept.size() != size:
            self._kept = QPixmap(size)
            self._kept.setDevicePixelRatio(ratio)
            self._kept.fill(Qt.GlobalColor.transparent)
            with QPainter(self._kept) as own:
                own.setFont(self.font())
                draw(own)
        painter.drawPixmap(0, 0, self._kept)

    def paintEvent(self, event: QPaintEvent) -> None:
        """Paint everything."""
        with QPainter(self) as painter:
            self.paint(painter)
