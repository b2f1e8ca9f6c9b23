"""Cameras: pictures with the time at which each was there, by the monotonic clock."""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from sd2core.errors import Sd2Error
from sd2core.live.rehearsal import TEST, TEST_RATE_HZ, TestCamera

_MANUAL_EXPOSURE = 1.0 if sys.platform.startswith("linux") else 0.25
"""Value of OpenCV's automatic exposure that means: by hand (V4L2, the others)."""


class Camera(Protocol):
    """Source of pictures."""

    about: str  # camera, size and rate, in words
    simulated: bool
    size_px: tuple[int, int]  # width and height, both even
    rate_hz: float  # that it says it has
    delay_s: float  # from the middle of an exposure to when the picture is there

    def read(self) -> tuple[NDArray[np.uint8], float] | None:
        """Wait for the next picture, (height, width, 3); None at the end."""

    def close(self) -> None:
        """Let go of it."""


@dataclass(frozen=True)
class CameraChoice:
    """Camera to film with."""

    name: str
    """Its number, the URL of a stream, a video file, which is played at its rate, or ``test``."""
    size_px: Sequence[int] | None = None
    """Width and height to ask for; by default what the camera gives."""
    rate_hz: float | None = None
    """Frames per second to ask for."""
    exposure: float | None = None
    """Fixed exposure, in the driver's own unit; by default the camera chooses."""

    @property
    def is_played(self) -> bool:
        """True for a video file, which each recording begins anew."""
        return not (self.name == TEST or self.name.isdecimal() or "://" in self.name)

    def open(self) -> Camera:
        """Open it; Sd2Error if there is no such camera, or it gives no picture."""
        if self.name == TEST:
            width, height = self.size_px or (640, 360)
            return TestCamera((width, height), self.rate_hz or TEST_RATE_HZ)
        return PlayedVideo(Path(self.name)) if self.is_played else OpenCvCamera(self)


def shrunk(picture: NDArray[np.uint8], width_px: int) -> NDArray[np.uint8]:
    """Picture (height, width, 3) of another width, each pixel the mean of those it covers."""
    import cv2

    height, width = picture.shape[:2]
    size = (width_px, max(round(width_px * height / width), 1))
    return np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)


class OpenCvCamera:
    """Camera or stream that OpenCV opens."""

    simulated = False
    delay_s = 0.0

    def __init__(self, choice: CameraChoice) -> None:
        import cv2

        is_number = choice.name.isdecimal()
        asked_width, asked_height = choice.size_px or (None, None)
        self._capture = cv2.VideoCapture(int(choice.name) if is_number else choice.name)
        named = f"Camera {int(choice.name)}" if is_number else choice.name
        wanted: list[tuple[int, float | None]] = [
            (cv2.CAP_PROP_FRAME_WIDTH, asked_width),
            (cv2.CAP_PROP_FRAME_HEIGHT, asked_height),
            (cv2.CAP_PROP_FPS, choice.rate_hz),
            (cv2.CAP_PROP_AUTO_EXPOSURE, None if choice.exposure is None else _MANUAL_EXPOSURE),
            (cv2.CAP_PROP_EXPOSURE, choice.exposure),
        ]
        for setting, value in wanted:
            if value is not None:
                self._capture.set(setting, value)
        first = self.read()
        if first is None:
            self.close()
            raise Sd2Error(
                f"{named} cannot be opened, or gives no picture",
                "a camera that no other program uses: its number from 0 on, or a URL",
                "Try the next number; `--camera test` records test pictures",
            )
        height, width = first[0].shape[:2]
        self.size_px = width, height
        self.rate_hz = float(self._capture.get(cv2.CAP_PROP_FPS)) or choice.rate_hz or 30.0
        self.about = f"{named}, {width} × {height} px at {self.rate_hz:g} frames/s"

    def read(self) -> tuple[NDArray[np.uint8], float] | None:
        """Wait for the next picture, (height, width, 3); None where the camera has gone."""
        # A driver that hands over what waited would give it a later time than it had.
        if not self._capture.grab():
            return None
        taken_s = time.monotonic()
        is_there, picture = self._capture.retrieve()
        if not is_there:
            return None
        height, width = (length - length % 2 for length in picture.shape[:2])
        return np.ascontiguousarray(picture[:height, :width, ::-1]), taken_s

    def close(self) -> None:
        """Let go of the camera."""
        self._capture.release()


class PlayedVideo:
    """Video file whose pictures come at their times."""

    simulated = False
    delay_s = 0.0

    def __init__(self, path: Path) -> None:
        from sd2core.io.video import open_video

        self._reader: Any = open_video(path)
        picture = self._reader.read(0)
        height, width = (length - length % 2 for length in picture.shape[:2])
        self.size_px = width, height
        times_s = self._reader.timebase.times_s
        self._times_s = times_s - times_s[0]
        self.rate_hz = self._reader.timebase.frames_per_s
        self.about = f"{path.name}, played at {self.rate_hz:g} frames/s"
        self._number = 0
        self._begin_s: float | None = None

    def read(self) -> tuple[NDArray[np.uint8], float] | None:
        """Wait for the next picture, (height, width, 3); None at the end."""
        if self._number == len(self._times_s):
            return None
        picture = self._reader.read(self._number)
        if self._begin_s is None:
            self._begin_s = time.monotonic()
        due_s = self._begin_s + float(self._times_s[self._number])
        time.sleep(max(due_s - time.monotonic(), 0.0))
        self._number += 1
        width, height = self.size_px
        return np.ascontiguousarray(picture[:height, :width]), time.monotonic()

    def close(self) -> None:
        """Close the file."""
        self._reader.close()
