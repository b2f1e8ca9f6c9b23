"""The video, with the mesh drawn over the person."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QRectF, QSize, Qt
from PySide6.QtGui import QColor, QImage, QPainter, QPaintEvent
from PySide6.QtWidgets import QWidget

from sd2app.models.display import DisplayModel
from sd2app.models.document import DocumentModel
from sd2app.models.playback import PlaybackModel
from sd2app.models.video import VideoModel

_OPACITY = 0.55


class VideoView(QWidget):
    """Fits the picture into the space there is."""

    def __init__(
        self,
        video: VideoModel,
        document: DocumentModel,
        playback: PlaybackModel,
        display: DisplayModel,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self._video = video
        self._document = document
        self._playback = playback
        self._display = display
        self.setMinimumSize(200, 150)
        video.frame_changed.connect(self.update)
        display.mesh_changed.connect(self.update)
        display.theme_changed.connect(self.update)
        document.changed.connect(self.update)

    def sizeHint(self) -> QSize:
        """Two thirds of VGA."""
        return QSize(427, 320)

    def paintEvent(self, event: QPaintEvent) -> None:
        """The picture, or a word on why there is none."""
        painter = QPainter(self)
        colours = self._display.palette
        painter.fillRect(self.rect(), QColor(colours.well))
        picture = self._video.picture
        if picture is None:
            painter.setPen(QColor(colours.muted))
            has_video = self._video.reader is not None
            text = "" if has_video else "No video in this recording"
            painter.drawText(self.rect(), Qt.AlignmentFlag.AlignCenter, text)
            return
        if self._display.overlay:
            picture = self._with_mesh(picture)
        height, width = picture.shape[:2]
        picture = np.ascontiguousarray(picture)
        image = QImage(picture.data, width, height, 3 * width, QImage.Format.Format_RGB888)
        scale = min(self.width() / width, self.height() / height)
        box = QRectF(0, 0, width * scale, height * scale)
        box.moveCenter(QRectF(self.rect()).center())
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
        painter.drawImage(box, image)

    def _with_mesh(self, picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
        mesh, reader = self._document.mesh, self._video.reader
        if mesh is None or reader is None:
            return picture
        time_s = reader.timebase.time_of(self._video.shown_frame)
        if not mesh.timebase.covers(time_s):
            return picture
        vertices = mesh.frame(mesh.timebase.frame_at(time_s))
        height, width = picture.shape[:2]
        pixels = project(vertices, self._document.focal_px, width, height)
        return draw_dots(picture, pixels, QColor(self._display.palette.accent).getRgb()[:3])


def project(
    vertices: NDArray[np.floating], focal_px: float, width: int, height: int
) -> NDArray[np.int64]:
    """Pixels (x, y) of the vertices that fall into the picture, (n, 2).

    Pinhole camera at the origin, optical axis +z, principal point in the centre.
    """
    vertices = vertices[vertices[:, 2] > 0.01]
    x = np.floor(focal_px * vertices[:, 0] / vertices[:, 2] + width / 2)
    y = np.floor(focal_px * vertices[:, 1] / vertices[:, 2] + height / 2)
    inside = (x >= 0) & (x < width) & (y >= 0) & (y < height)
    return np.stack([x[inside], y[inside]], axis=1).astype(np.int64)


def draw_dots(
    picture: NDArray[np.uint8], pixels: NDArray[np.int64], colour: tuple[int, ...]
) -> NDArray[np.uint8]:
    """A copy of the picture with a translucent dot on every pixel given."""
    covered = np.zeros(picture.shape[:2], bool)
    covered[pixels[:, 1], pixels[:, 0]] = True
    result = picture.copy()
    blend = picture[covered] * (1.0 - _OPACITY) + np.array(colour) * _OPACITY
    result[covered] = blend.astype(np.uint8)
    return result
