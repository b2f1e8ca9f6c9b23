"""The video, with the mesh drawn over the person."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QRectF, QSize, Qt, SignalInstance
from PySide6.QtGui import QColor, QImage, QPainter, QPaintEvent
from PySide6.QtWidgets import QWidget

from sd2app.session.display import DisplayModel
from sd2app.session.document import DocumentModel
from sd2app.session.playback import PlaybackModel
from sd2app.session.video import VideoModel
from sd2app.video.landmark_overlay import draw_landmarks
from sd2app.video.overlay_settings import OverlayModel
from sd2app.widgets.mesh_painting import draw_mesh


class Landmarks(Protocol):
    """Landmarks of the person in the picture, while they are being found."""

    @property
    def landmarks_changed(self) -> tuple[SignalInstance, ...]:
        """Signals after which landmarks may have changed."""

    def landmarks_at(self, frame: int) -> NDArray[np.float32] | None:
        """Landmarks of a frame, or None where none are to be shown."""


class VideoView(QWidget):
    """Fits the picture into the space there is."""

    def __init__(
        self,
        video: VideoModel,
        document: DocumentModel,
        playback: PlaybackModel,
        display: DisplayModel,
        overlay: OverlayModel,
        landmarks: Landmarks,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self._video = video
        self._document = document
        self._playback = playback
        self._display = display
        self._overlay = overlay
        self._found = landmarks
        self.setMinimumSize(200, 150)
        video.frame_changed.connect(self.update)
        overlay.changed.connect(self.update)
        for signal in landmarks.landmarks_changed:
            signal.connect(self.update)
        display.theme_changed.connect(self.update)
        document.changed.connect(self.update)

    def sizeHint(self) -> QSize:
        """Size of two thirds of VGA."""
        return QSize(427, 320)

    def paintEvent(self, event: QPaintEvent) -> None:
        """Paint the picture, or why there is none."""
        with QPainter(self) as painter:
            self._paint(painter)

    def _paint(self, painter: QPainter) -> None:
        colours = self._display.palette
        painter.fillRect(self.rect(), QColor(colours.well))
        picture = self._video.picture
        if picture is None:
            painter.setPen(QColor(colours.muted))
            painter.drawText(self.rect(), Qt.AlignmentFlag.AlignCenter, self._absence())
            return
        height, width = picture.shape[:2]
        picture = np.ascontiguousarray(picture)
        image = QImage(picture.data, width, height, 3 * width, QImage.Format.Format_RGB888)
        scale = min(self.width() / width, self.height() / height)
        box = QRectF(0, 0, width * scale, height * scale)
        box.moveCenter(QRectF(self.rect()).center())
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
        painter.drawImage(box, image)
        if self._overlay.style.shown:
            self._paint_mesh(painter, box)
        landmarks = self._landmarks()
        if landmarks is not None:
            draw_landmarks(painter, landmarks, box, (width, height))

    def _absence(self) -> str:
        recording = self._document.recording
        if recording is None or self._video.reader is not None:
            return ""
        if recording.video is None:
            return "No video in this recording"
        return "The video cannot be shown"

    def _landmarks(self) -> NDArray[np.float32] | None:
        """Landmarks of this frame, until the mesh takes their place."""
        if self._document.mesh is not None:
            return None
        return self._found.landmarks_at(self._video.shown_frame)

    def _paint_mesh(self, painter: QPainter, box: QRectF) -> None:
        mesh, reader = self._document.mesh, self._video.reader
        if mesh is None or reader is None:
            return
        time_s = reader.timebase.time_of(self._video.shown_frame)
        if not mesh.timebase.covers(time_s):
            return
        frame = mesh.timebase.frame_at(time_s)
        if not mesh.presence.there[frame]:
            return
        style = self._overlay.style
        # Dots cover little: they have to be stronger to be seen at all.
        opacity = style.opacity**0.5 if style.as_dots else style.opacity
        faces = None if style.as_dots else mesh.faces
        colour = QColor(self._display.palette.overlay)
        camera = self._document.camera
        draw_mesh(painter, box, mesh.frame(frame), faces, camera, colour, opacity)
