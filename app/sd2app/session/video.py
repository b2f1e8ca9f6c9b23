"""Video frame on screen, decoded in the background."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, Signal

from sd2app.background.latest import Emit, LatestRunner, ReportingModel
from sd2app.session.playback import PlaybackModel
from sd2core.io.video import VideoReader


class VideoModel(ReportingModel):
    """Follows the clock: one picture at a time is decoded, then the newest wanted one."""

    frame_changed = Signal()

    def __init__(self, playback: PlaybackModel, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._playback = playback
        self.reader: VideoReader | None = None
        self.picture: NDArray[np.uint8] | None = None  # RGB picture on screen, (H, W, 3)
        self.shown_frame = -1  # frame of the video that the picture is; -1 for none
        self._wanted = -1
        self._runner = LatestRunner("video", self, self._receive, self._fail)
        playback.frame_changed.connect(self._follow)

    def set_reader(self, reader: VideoReader | None) -> None:
        """Show another video, or none; the one before is closed by its owner."""
        self._runner.cancel()
        self.reader = reader
        self.picture = None
        self.shown_frame = self._wanted = -1
        self.frame_changed.emit()
        self._follow()

    def show_live(self, picture: NDArray[np.uint8]) -> None:
        """Show a picture (H, W, 3) of a camera that is being filmed, while there is no video."""
        if self.reader is None:
            self.picture = picture
            self.frame_changed.emit()

    def _follow(self) -> None:
        reader = self.reader
        if reader is None:
            return
        frame = reader.timebase.frame_at(self._playback.time_s)
        if frame == self._wanted:
            return
        self._wanted = frame
        # One picture at a time: cancelling would show none while scrubbing fast.
        if not self._runner.busy:
            self._request(frame)

    def _request(self, frame: int) -> None:
        reader = self.reader
        assert reader is not None

        def decode(emit: Emit) -> tuple[int, NDArray[np.uint8]]:
            emit(None)
            return frame, reader.read(frame)

        self._runner.submit(decode)

    def _receive(self, result: Any) -> None:
        self.shown_frame, self.picture = result
        self.frame_changed.emit()
        if self._wanted != self.shown_frame and self.reader is not None:
            self._request(self._wanted)
