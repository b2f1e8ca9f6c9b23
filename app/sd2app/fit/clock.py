"""Playback that follows a fit until the user moves the clock."""

from __future__ import annotations

from PySide6.QtCore import QObject, Signal

from sd2app.fit.model import FitModel
from sd2app.session.document import DocumentModel
from sd2app.session.playback import PlaybackModel
from sd2core.files.paths import plain_path


class FitPlayback(QObject):
    """Follows the frame under way while the window shows the video of the fit."""

    changed = Signal()

    def __init__(
        self,
        fit: FitModel,
        document: DocumentModel,
        playback: PlaybackModel,
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self._fit = fit
        self._document = document
        self._playback = playback
        self._following = True
        self._moving = False
        self._was_busy = False
        fit.advanced.connect(self._follow)
        fit.changed.connect(self._restart)
        playback.frame_changed.connect(self._notice)
        playback.playing_changed.connect(self._notice)

    @property
    def following(self) -> bool:
        """True while the clock follows the fit."""
        return self._following

    @property
    def on_screen(self) -> bool:
        """True if the window shows the video of the fit."""
        request, recording = self._fit.request, self._document.recording
        if request is None or recording is None or recording.video is None:
            return False
        return plain_path(recording.video) == request.video

    def set_following(self, following: bool) -> None:
        """Follow the fit, or stop following."""
        if following != self._following:
            self._following = following
            self.changed.emit()

    def _follow(self, frame: int) -> None:
        video = self._document.video
        if not (self._following and self.on_screen) or video is None or frame >= len(video):
            return
        self._moving = True
        try:
            self._playback.seek(video.timebase.time_of(frame))
        finally:
            self._moving = False

    def _restart(self) -> None:
        if self._fit.busy and not self._was_busy:
            self.set_following(True)
        self._was_busy = self._fit.busy

    def _notice(self) -> None:
        if not self._moving and self._fit.busy and self._document.content is not None:
            self.set_following(False)
