"""Frames of a video, decoded in the background: the one on screen, or any one to look at."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, Signal

from sd2app.background.latest import Emit, LatestRunner, ProblemModel, ReportingModel
from sd2app.session.playback import PlaybackModel
from sd2core.io.video import VideoReader, open_video


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
        # One picture at a time: cancelling would show none while scrubbing fast.
        if reader is None or self._runner.busy:
            return
        frame = reader.timebase.frame_at(self._playback.time_s)

        def decode(emit: Emit) -> tuple[int, NDArray[np.uint8]]:
            emit(None)
            return frame, reader.read(frame)

        if frame != self._wanted:
            self._wanted = frame
            self._runner.submit(decode)

    def _receive(self, result: Any) -> None:
        self.shown_frame, self.picture = result
        self.frame_changed.emit()
        self._follow()


class VideoFrames(ProblemModel):
    """Opens a video and decodes the frame that is asked for, both in the background."""

    picture_changed = Signal()

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.frame = 0  # the one to look at
        self.picture: NDArray[np.uint8] | None = None  # RGB, (H, W, 3)
        self.reader: VideoReader | None = None
        self._opener = LatestRunner("video to look at", self, self._take_video, self._refuse)
        self._decoder = LatestRunner("frame to look at", self, self._take_picture, self._refuse)

    @property
    def reading(self) -> bool:
        """True while the video is being opened."""
        return self._opener.busy

    @property
    def frames(self) -> int:
        """Number of frames, 0 while the video is not open."""
        return len(self.reader) if self.reader else 0

    @property
    def size(self) -> tuple[int, int] | None:
        """Width and height of the upright picture."""
        return (self.reader.width, self.reader.height) if self.reader else None

    @property
    def time_s(self) -> float:
        """Time of the frame to look at."""
        return self.reader.timebase.time_of(self.frame) if self.reader else 0.0

    def open_video(self, path: Path) -> None:
        """Look at another video."""
        self.let_go()
        self.problem, self.frame = "", 0
        self._opener.submit(lambda emit: open_video(path, lambda *_: emit(None)))
        self.changed.emit()
        self.picture_changed.emit()

    def show_frame(self, frame: int) -> None:
        """Look at another frame."""
        frame = min(max(frame, 0), self.frames - 1)
        if self.reader is None or (frame == self.frame and self.picture is not None):
            return
        self.frame = frame
        reader = self.reader
        self._decoder.submit(lambda emit: reader.read(frame))
        self.changed.emit()

    def first_frame(self) -> int:
        """The frame to begin with: in the middle, since at both ends people walk in and out."""
        return self.frames // 2

    def close(self) -> None:
        """Stop reading, let go of the file."""
        super().close()
        self.let_go()

    def let_go(self) -> None:
        """Close the file."""
        self._decoder.cancel()
        if self.reader is not None:
            self.reader.close()
        self.reader = self.picture = None

    def _take_video(self, reader: Any) -> None:
        self.reader = reader
        self.show_frame(self.first_frame())
        self.changed.emit()

    def _take_picture(self, picture: Any) -> None:
        self.picture = picture
        self.picture_changed.emit()
