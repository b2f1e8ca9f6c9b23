"""The video twice, one mesh over each."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QRectF, QSize, Qt
from PySide6.QtGui import QColor, QImage, QPainter, QPaintEvent
from PySide6.QtWidgets import QWidget

from sd2app.mesh_comparison.model import ComparisonModel
from sd2app.session.display import DisplayModel
from sd2app.session.document import DocumentModel
from sd2app.session.playback import PlaybackModel
from sd2app.session.video import VideoModel
from sd2app.video.overlay_settings import OverlayModel
from sd2app.widgets.mesh_painting import draw_mesh

_TITLE_PX = 24
_GREY = 56
"""Grey value of the ground without a video."""
_LEAST_OPACITY = 0.2
"""Lowest opacity, so that the compared meshes stay visible."""


def colour_of(display: DisplayModel, number: int) -> QColor:
    """Colour of a mesh, in pictures and curves alike."""
    return QColor(display.palette.synthetic if number == 0 else display.palette.real)


class ComparedPicture(QWidget):
    """One of the two meshes over the picture on screen."""

    def __init__(
        self,
        number: int,
        comparison: ComparisonModel,
        document: DocumentModel,
        video: VideoModel,
        playback: PlaybackModel,
        display: DisplayModel,
        overlay: OverlayModel,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self._number = number
        self._comparison = comparison
        self._document = document
        self._video = video
        self._playback = playback
        self._display = display
        self._overlay = overlay
        self.setMinimumSize(240, 180)
        signals = [comparison.changed, display.theme_changed, overlay.changed]
        # With a video the picture is what one waits for.
        signals.append(playback.frame_changed if video.reader is None else video.frame_changed)
        for signal in signals:
            signal.connect(self.update)

    def sizeHint(self) -> QSize:
        """Half of VGA, and its title."""
        return QSize(400, 300 + _TITLE_PX)

    def paintEvent(self, event: QPaintEvent) -> None:
        """Title, and the picture below."""
        with QPainter(self) as painter:
            self._paint(painter)

    def _paint(self, painter: QPainter) -> None:
        colours = self._display.palette
        painter.fillRect(self.rect(), QColor(colours.panel))
        font = painter.font()
        font.setBold(True)
        painter.setFont(font)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(colour_of(self._display, self._number))
        painter.drawRoundedRect(QRectF(8, 7, 10, 10), 2, 2)
        painter.setPen(QColor(colours.text))
        title = self._comparison.labels[self._number]
        if self._number == self._comparison.reference:
            title += " (reference)"
        box = QRectF(24, 0, self.width() - 32, _TITLE_PX)
        elided = painter.fontMetrics().elidedText(
            title, Qt.TextElideMode.ElideMiddle, int(box.width())
        )
        painter.drawText(box, Qt.AlignmentFlag.AlignVCenter, elided)
        ground = QRectF(0, _TITLE_PX, self.width(), self.height() - _TITLE_PX)
        painter.fillRect(ground, QColor(colours.well))
        picture, time_s = self._picture()
        height, width = picture.shape[:2]
        image = QImage(picture.data, width, height, 3 * width, QImage.Format.Format_RGB888)
        scale = min(ground.width() / width, ground.height() / height)
        placed = QRectF(0, 0, width * scale, height * scale)
        placed.moveCenter(ground.center())
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
        painter.drawImage(placed, image)
        self._paint_mesh(painter, placed, time_s)

    def _picture(self) -> tuple[NDArray[np.uint8], float]:
        """The picture on screen and its time; a plain ground where there is no video."""
        reader, picture = self._video.reader, self._video.picture
        if reader is not None and picture is not None:
            time_s = reader.timebase.time_of(self._video.shown_frame)
            return np.ascontiguousarray(picture), time_s
        camera = self._document.camera
        ground = np.full((camera.height, camera.width, 3), _GREY, np.uint8)
        return ground, self._playback.time_s

    def _paint_mesh(self, painter: QPainter, box: QRectF, time_s: float) -> None:
        mesh = self._comparison.mesh(self._number)
        if mesh is None or not mesh.timebase.covers(time_s):
            return
        frame = mesh.timebase.frame_at(time_s)
        if not mesh.presence.there[frame]:
            return
        opacity = max(self._overlay.style.opacity, _LEAST_OPACITY)
        colour = colour_of(self._display, self._number)
        camera = self._document.camera
        draw_mesh(painter, box, mesh.frame(frame), mesh.faces, camera, colour, opacity)
