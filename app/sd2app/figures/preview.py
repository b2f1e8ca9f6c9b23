"""Preview of a figure, as large as there is room."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, Signal

from sd2app.background.latest import Emit, LatestRunner

if TYPE_CHECKING:
    from matplotlib.figure import Figure

from PySide6.QtCore import QRectF, QSize, Qt
from PySide6.QtGui import QColor, QImage, QPainter, QPaintEvent
from PySide6.QtWidgets import QWidget

from sd2app.palette import Palette

_PREVIEW_DPI = 110


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
        """Wide size, as figures have."""
        return QSize(960, 320)

    def paintEvent(self, event: QPaintEvent) -> None:
        """Paint the figure on its own background, or a message."""
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


class DrawnFigure(QObject):
    """Draws in the background; the newest choice wins."""

    changed = Signal()  # a choice, or drawing began or ended
    drawn = Signal()  # another preview
    written = Signal(object)  # Path

    def __init__(self, name: str, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._picture: NDArray[np.uint8] | None = None
        self._problem = ""
        self._exporting = False
        self._runner = LatestRunner(name, self)
        self._runner.finished.connect(self._receive)
        self._runner.failed.connect(self._refuse)
        self._runner.idle_changed.connect(lambda _: self.changed.emit())

    @property
    def picture(self) -> NDArray[np.uint8] | None:
        """The preview, RGBA of shape (H, W, 4)."""
        return self._picture

    @property
    def problem(self) -> str:
        """Reason why the figure cannot be drawn."""
        return self._problem

    @property
    def busy(self) -> bool:
        """True while the figure is being drawn or written."""
        return self._runner.busy

    @property
    def exporting(self) -> bool:
        """True while the figure is being written."""
        return self._exporting

    def close(self) -> None:
        """Stop drawing."""
        self._runner.close()

    def _preview(self, plot: Callable[[Emit], Figure]) -> None:
        """Draw what ``plot`` makes, for the screen."""

        def draw(emit: Emit) -> NDArray[np.uint8]:
            from matplotlib.backends.backend_agg import FigureCanvasAgg

            figure = plot(emit)
            figure.set_dpi(_PREVIEW_DPI)
            canvas = FigureCanvasAgg(figure)
            canvas.draw()
            return np.array(canvas.buffer_rgba())

        self._problem = ""
        self._runner.submit(draw)
        self.changed.emit()

    def _write(self, path: Path, write: Callable[[Emit], None]) -> None:
        """Let ``write`` make the file."""

        def make(emit: Emit) -> Path:
            write(emit)
            return path

        self._exporting = True
        self._runner.submit(make)
        self.changed.emit()

    def _receive(self, result: Any) -> None:
        if isinstance(result, Path):
            self._exporting = False
            self.changed.emit()
            self.written.emit(result)
            return
        self._picture = result
        self.drawn.emit()

    def _refuse(self, error: Exception) -> None:
        self._runner.cancel()
        self._exporting = False
        self._problem = str(error)
        self.changed.emit()
