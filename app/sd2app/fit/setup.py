"""Set-up of a fit: video, person, height, camera, folder."""

from __future__ import annotations

import math
from itertools import count
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, Signal

from sd2app.background.latest import Emit, LatestRunner
from sd2app.fit.request import FitRequest, Person, read_request
from sd2core.body.camera import DEFAULT_FIELD_OF_VIEW_DEG
from sd2core.body.fit import DEFAULT_STATURE_M as DEFAULT_STATURE_M
from sd2core.io.video import VideoReader, open_video
from sd2core.recording.recording import SUFFIX, Recording

CameraWay = Literal["file", "angle", "focal"]
STATURES_M = (0.8, 2.3)
ANGLES_DEG = (10.0, 150.0)
_SMALLEST_PERSON = 0.02
"""Smallest side of a rectangle as share of the picture; less is a click."""


class FitSetupModel(QObject):
    """Choices for a fit, and the frame of the video on which the person is picked."""

    changed = Signal()  # any choice, or the video's presence
    picture_changed = Signal()

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._video: Path | None = None
        self._reader: VideoReader | None = None
        self._picture: NDArray[np.uint8] | None = None
        self._frame = 0
        self._problem = ""
        self._folder: Path | None = None
        self._stature_m: float | None = None
        self._camera: CameraWay = "file"
        self._angle_deg = DEFAULT_FIELD_OF_VIEW_DEG
        self._person: Person | None = None
        self._opener = LatestRunner("fit-video", self)
        self._opener.finished.connect(self._take_video)
        self._opener.failed.connect(self._refuse)
        self._decoder = LatestRunner("fit-frame", self)
        self._decoder.finished.connect(self._take_picture)
        self._decoder.failed.connect(self._refuse)

    # --- the video ------------------------------------------------------------------------

    @property
    def video(self) -> Path | None:
        """The file."""
        return self._video

    @property
    def reading(self) -> bool:
        """True while the video is being opened."""
        return self._opener.busy

    @property
    def problem(self) -> str:
        """Reason why the video cannot be shown."""
        return self._problem

    @property
    def frames(self) -> int:
        """Number of its frames, 0 while it is not open."""
        return len(self._reader) if self._reader else 0

    @property
    def size(self) -> tuple[int, int] | None:
        """Width and height of the upright picture."""
        return (self._reader.width, self._reader.height) if self._reader else None

    @property
    def frame(self) -> int:
        """Frame to look at."""
        return self._frame

    @property
    def time_s(self) -> float:
        """Its time."""
        return self._reader.timebase.time_of(self._frame) if self._reader else 0.0

    @property
    def picture(self) -> NDArray[np.uint8] | None:
        """RGB, (H, W, 3)."""
        return self._picture

    def choose_video(self, path: Path, open_now: Recording | None = None) -> None:
        """Choose another video; the open recording of it, if saved, gets the mesh."""
        self._let_go()
        self._video, self._problem, self._person, self._frame = path, "", None, 0
        self._folder = folder_for(path, open_now)

        def read(emit: Emit) -> VideoReader:
            return open_video(path, lambda *_: emit(None))

        self._opener.submit(read)
        self.changed.emit()
        self.picture_changed.emit()

    def show_frame(self, frame: int) -> None:
        """Look at another frame; the rectangle belongs to the one it was drawn on."""
        frame = min(max(frame, 0), self.frames - 1)
        if self._reader is None or (frame == self._frame and self._picture is not None):
            return
        self._frame = frame
        reader = self._reader
        self._decoder.submit(lambda emit: reader.read(frame))
        self.changed.emit()

    # --- the choices ----------------------------------------------------------------------

    @property
    def folder(self) -> Path | None:
        """The recording to be made."""
        return self._folder

    @property
    def completes(self) -> bool:
        """True if the recording exists and gets the mesh."""
        return self._folder is not None and (self._folder / "recording.json").exists()

    @property
    def stature_m(self) -> float | None:
        """Body height, None to have it estimated."""
        return self._stature_m

    @property
    def camera(self) -> CameraWay:
        """Source of the focal length."""
        return self._camera

    @property
    def angle_deg(self) -> float:
        """Field of view across the longer side of the picture."""
        return self._angle_deg

    @property
    def focal_px(self) -> float | None:
        """The same as a focal length in pixels, None while the video is not open."""
        if self.size is None:
            return None
        return max(self.size) / 2.0 / math.tan(math.radians(self._angle_deg) / 2.0)

    @property
    def person(self) -> Person | None:
        """Rectangle around the person, None to have one chosen."""
        return self._person

    @property
    def kept(self) -> FitRequest | None:
        """Request of a stopped fit of this video in the folder."""
        kept = read_request(self._folder) if self._folder is not None else None
        return kept if kept is not None and kept.video == self._video else None

    @property
    def continues(self) -> bool:
        """True if that can be continued: it was made with the same choices."""
        return self.ready and self.kept is not None and self.request().asks_the_same(self.kept)

    @property
    def ready(self) -> bool:
        """True if the fit can begin."""
        return self._reader is not None and self._folder is not None and not self._problem

    def set_folder(self, folder: Path) -> None:
        """Choose another folder."""
        self._change("_folder", folder)

    def set_stature(self, stature_m: float | None) -> None:
        """Set the height of the person; None to have it estimated."""
        if stature_m is not None:
            stature_m = min(max(stature_m, STATURES_M[0]), STATURES_M[1])
        self._change("_stature_m", stature_m)

    def set_camera(self, way: CameraWay) -> None:
        """Choose how the focal length is known."""
        self._change("_camera", way)

    def set_angle(self, angle_deg: float) -> None:
        """Say the field of view."""
        self._change("_angle_deg", min(max(angle_deg, ANGLES_DEG[0]), ANGLES_DEG[1]))

    def set_focal(self, focal_px: float) -> None:
        """Say the focal length in pixels of the picture."""
        if self.size is not None and focal_px > 0:
            self.set_angle(math.degrees(2.0 * math.atan(max(self.size) / 2.0 / focal_px)))

    def set_person(self, left: float, top: float, right: float, bottom: float) -> None:
        """Draw the rectangle on the frame that is shown, corners in pixels in any order."""
        if self.size is None:
            return
        (width, height), xs, ys = self.size, sorted((left, right)), sorted((top, bottom))
        x0, x1 = (round(min(max(x, 0), width)) for x in xs)
        y0, y1 = (round(min(max(y, 0), height)) for y in ys)
        if min((x1 - x0) / width, (y1 - y0) / height) < _SMALLEST_PERSON:
            return
        self._change("_person", Person(self._frame, x0, y0, x1 - x0, y1 - y0))

    def clear_person(self) -> None:
        """Let the fit choose the person."""
        self._change("_person", None)

    def request(self) -> FitRequest:
        """All of it; only when :attr:`ready`."""
        assert self._video is not None
        assert self._folder is not None
        return FitRequest(
            video=self._video,
            folder=self._folder,
            stature_m=self._stature_m,
            focal_px=None if self._camera == "file" else self.focal_px,
            person=self._person,
        )

    def close(self) -> None:
        """Stop reading, let go of the file."""
        self._opener.close()
        self._decoder.close()
        self._let_go()

    # --- inside ---------------------------------------------------------------------------

    def _change(self, name: str, value: object) -> None:
        if getattr(self, name) != value:
            setattr(self, name, value)
            self.changed.emit()

    def _take_video(self, reader: Any) -> None:
        self._reader = reader
        if self.kept is not None:
            self._take_choices(self.kept)
        # The middle: at both ends people walk in and out.
        self.show_frame(len(reader) // 2 if self._person is None else self._person.frame)
        self.changed.emit()

    def _take_choices(self, kept: FitRequest) -> None:
        self._stature_m, self._person = kept.stature_m, kept.person
        self._camera = "file"
        if kept.focal_px is not None:
            self._camera = "focal"
            self.set_focal(kept.focal_px)

    def _take_picture(self, picture: Any) -> None:
        self._picture = picture
        self.picture_changed.emit()

    def _refuse(self, error: Exception) -> None:
        self._problem = str(error)
        self.changed.emit()

    def _let_go(self) -> None:
        self._decoder.cancel()
        if self._reader is not None:
            self._reader.close()
        self._reader = self._picture = None


def folder_for(video: Path, open_now: Recording | None = None) -> Path:
    """Default folder to save in.

    The recording that is open where it is saved, is of this video and has no mesh; a
    folder in which a fit of this video was stopped; else a new name beside the video.
    """
    if open_now is not None and open_now.video == video and open_now.mesh is None:
        saved = (open_now.folder / "recording.json").exists()
        if saved:
            return open_now.folder
    for number in count(1):
        ending = "" if number == 1 else f"-{number}"
        folder = video.with_name(f"{video.stem}{ending}{SUFFIX}")
        kept = read_request(folder)
        if not folder.exists() or (kept is not None and kept.video == video):
            return folder
    raise AssertionError
