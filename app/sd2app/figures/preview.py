"""A figure as it will be, as large as there is room."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QRectF, QSize, Qt
from PySide6.QtGui import QColor, QImage, QPainter, QPaintEvent
from PySide6.QtWidgets import QWidget

from sd2app.figures.drawn_figure import DrawnFigure
from sd2app.palette import Palette


class FigurePreview(QWidget):
    """A view of :class:`DrawnFigure`."""

    def __init__(self, model: DrawnFigure, palette: Palette, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._model = model
        self._colours = palette
        self.setAccessibleName("Preview of the figure")
        self.setMinimumSize(480, 200)
        model.drawn.connect(self.update)
        model.changed.connect(self.update)

    def sizeHint(self) -> QSize:
        """Wide: figures are."""
        return QSize(960, 320)

    def paintEvent(self, event: QPaintEvent) -> None:
        """The picture on its own paper, or a word."""
        with QPainter(self) as painter:
            painter.fillRect(self.rect(), QColor(self._colours.well))
            picture = self._model.picture
            if picture is None or self._model.problem:
                painter.setPen(QColor(self._colours.muted))
                text = self._model.problem or "Drawing…"
                flags = Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap
                painter.drawText(self.rect().adjusted(16, 16, -16, -16), flags, text)
                return
            self._draw(painter, picture)

    def _draw(self, painter: QPainter, picture: np.ndarray) -> None:
        height, width = picture.shape[:2]
        image = QImage(picture.data, width, height, 4 * width, QImage.Format.Format_RGBA8888)
        scale = min((self.width() - 16) / width, (self.height() - 16) / height, 1.0)
        box = QRectF(0, 0, width * scale, height * scale)
        box.moveCenter(QRectF(self.rect()).center())
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
        painter.drawImage(box, image)
