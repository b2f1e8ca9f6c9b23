"""Small pictures of recordings, kept in the user's cache from when they were open."""

from __future__ import annotations

from collections.abc import Sequence
from hashlib import sha256
from pathlib import Path

from PySide6.QtCore import QObject, QPoint, QRect, QSize, Qt, Signal
from PySide6.QtGui import QImage

from sd2app.background.latest import BackgroundModel, LatestRunner, delayed
from sd2app.maps.heatmap_image import heatmap_image
from sd2app.session.session import Session
from sd2app.widgets.picture import png_of
from sd2core.files.atomic import atomic_write
from sd2core.files.paths import plain_path

SIZE_PX = QSize(448, 252)
_COLUMNS = 448
_PATIENCE_MS = 700
"""Delay after which what has just been opened is worth a picture."""
_ABOVE = 0.2
"""Share of what is cut off a high picture that is cut above: people have their heads there."""
_MAX_PICTURES = 60
"""Number that are kept."""


class RecordingPictures(BackgroundModel):
    """Makes a picture of what is open, of its video or else of a map, and finds it again.

    ``folder`` holds the pictures. One that cannot be written is not there; nothing else is lost.
    """

    changed = Signal()

    def __init__(self, session: Session, folder: Path, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._session, self._folder = session, folder
        self._writer = LatestRunner("picture", self, lambda _: self.changed.emit())
        self._patience = delayed(self._keep, _PATIENCE_MS, self)
        for signal in (session.document.opened, session.document.saved):
            signal.connect(self._patience.start)

    def path_of(self, paths: Sequence[Path]) -> Path:
        """File of the picture of what is opened together, which may not be there."""
        names = "\n".join(str(plain_path(path)) for path in paths)
        return self._folder / f"{sha256(names.encode()).hexdigest()[:24]}.png"

    def _keep(self) -> None:
        """Write a picture of what is open, or look again where there is none yet."""
        paths, picture = self._session.document.paths, self._picture()
        if paths and (picture is None or self._session.document.growing):
            self._patience.start()
        elif paths and picture is not None:
            path = self.path_of(paths)
            self._writer.submit(lambda emit: _write(picture, path))

    def _picture(self) -> QImage | None:
        session = self._session
        frame = session.video.picture
        if frame is not None:
            height, width, _ = frame.shape
            stride = frame.strides[0]
            return QImage(frame.data, width, height, stride, QImage.Format.Format_RGB888).copy()
        if session.document.video is not None:
            return None  # its first frame is on its way
        for track in (session.maps.real, session.maps.synthetic):
            if track.map is not None and track.covered is None:
                start_s, end_s = (
                    getattr(track.map.timebase, edge) + track.offset_s
                    for edge in ("start_s", "end_s")
                )
                levels = session.display.levels
                return heatmap_image(track, levels, start_s, end_s, _COLUMNS, 0xFF000000)
        return None


def _write(picture: QImage, path: Path) -> None:
    """Write a picture cut to size, heads left on; delete the oldest of too many."""
    whole = SIZE_PX if picture.height() < 64 else picture.size()  # a map has a row per bin
    fitted = picture.scaled(
        whole.scaled(SIZE_PX, Qt.AspectRatioMode.KeepAspectRatioByExpanding),
        Qt.AspectRatioMode.IgnoreAspectRatio,
        Qt.TransformationMode.SmoothTransformation,
    )
    over_px = fitted.size() - SIZE_PX
    part = QRect(QPoint(over_px.width() // 2, round(_ABOVE * over_px.height())), SIZE_PX)
    path.parent.mkdir(parents=True, exist_ok=True)
    with atomic_write(path) as stream:
        stream.write(png_of(fitted.copy(part)))
    kept = sorted(path.parent.glob("*.png"), key=lambda one: one.stat().st_mtime)
    for old in kept[:-_MAX_PICTURES]:
        old.unlink(missing_ok=True)
